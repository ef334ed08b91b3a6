#pragma once

#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Width of the tool bar at user interface scale 1.
inline constexpr float tool_bar_width = 40.0f;

/// Draws the tools at the left edge of the window, beside the image. Its controls are named "Tool/Move" and so on.
void draw_tool_bar(Ui& ui, const Rectangle& view, const Model& model, std::vector<Command>& commands);

}  // namespace cumulet::demo
