#pragma once

#include <cumulet/cumulet.h>

#include <scene_file.hpp>

namespace cumulet::demo {

/// Sets the ramps and color ramps of the viewer's first volume.
[[nodiscard]] cumulet_status set_ramps(cumulet_viewer* viewer, const SceneVolume& volume);

}  // namespace cumulet::demo
