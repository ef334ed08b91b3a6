#pragma once

#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Draws the render queue in a window at the upper right of the image, if it is open. view: the image's rectangle.
void draw_renders(Ui& ui, const Rectangle& view, Model& model, std::vector<Command>& commands);

}  // namespace cumulet::demo
