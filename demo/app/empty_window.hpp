#pragma once

#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Draws the image area of an empty scene: the program's name, how to open files, the sample scenes, and the recent
/// files. view: the area in window coordinates. The controls are "Start/Open", and "Start/" with the name of a sample
/// or of a recent file.
void draw_empty_window(Ui& ui, const Rectangle& view, const Model& model, std::vector<Command>& commands);

/// Returns the kind of a file by its name: "Scene", "Model", "Environment" or "Volume".
[[nodiscard]] const char* kind_of_file(const std::string& path);

}  // namespace cumulet::demo
