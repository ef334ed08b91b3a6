#pragma once

#include <clip.hpp>
#include <optional>

#include "scene_items.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Draws the rows of a volume's clip. box: bounds of the volume, if they are known.
void clip_rows(Ui& ui, settings::Clip& clip, const std::optional<Box>& box);

}  // namespace cumulet::demo
