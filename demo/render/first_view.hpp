#pragma once

#include <cumulet/cumulet.h>

namespace cumulet::demo {

/// Returns true if the camera is not placed, so that the library fits it to the scene.
[[nodiscard]] bool fits(const cumulet_camera_desc& camera);

/// Turns the viewer's camera, which the library has placed, into the programs' first view: a 3/4 view from the left
/// that fits the scene. Does nothing while the camera waits for a scene.
void turn_to_first_view(cumulet_viewer* viewer);

}  // namespace cumulet::demo
