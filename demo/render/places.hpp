#pragma once

#include <cumulet/cumulet.h>

#include <scene_file.hpp>

namespace cumulet::demo {

/// Where the first volume stands, in that viewer, and how it moves.
[[nodiscard]] cumulet_status set_places(cumulet_viewer* viewer, const SceneOptions& scene);
/// The scene's camera, and how it moves.
[[nodiscard]] cumulet_status set_camera(cumulet_camera* camera, const SceneOptions& scene);

}  // namespace cumulet::demo
