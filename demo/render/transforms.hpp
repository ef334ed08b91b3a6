#pragma once

#include <cumulet/cumulet.h>

#include <scene_file.hpp>

namespace cumulet::demo {

/// Sets the instance transforms and the shutter transforms of the viewer's first volume.
[[nodiscard]] cumulet_status set_transforms(cumulet_viewer* viewer, const SceneOptions& scene);
/// Sets the scene's camera and its shutter poses.
[[nodiscard]] cumulet_status set_camera(cumulet_camera* camera, const SceneOptions& scene);

}  // namespace cumulet::demo
