#pragma once

#include <clip.hpp>
#include <optional>

#include "scene_items.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Returns the clip that cuts the same voxels after the volume's up axis was changed to this one.
[[nodiscard]] settings::Clip turned(const settings::Clip& clip, UpAxis to);

/// Draws the rows of a volume's clip. box: bounds of the volume, if they are known.
void clip_rows(Ui& ui, settings::Clip& clip, const std::optional<Box>& box);

}  // namespace cumulet::demo
