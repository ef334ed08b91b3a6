#pragma once

#include <string>
#include <vector>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// An entry of a menu.
struct MenuEntry {
  const char* label;  // "": a separator
  Command command;
  const char* tip;
  bool (*enabled)(const Model& model) = nullptr;  // null: always
  bool (*checked)(const Model& model) = nullptr;  // null: no check mark
};

struct Menu {
  const char* label;
  std::vector<MenuEntry> entries;
};

/// Returns the menus of the menu bar.
[[nodiscard]] const std::vector<Menu>& menus();

/// Draws the menu bar at the top of the window, and the name of the scene at its right.
void draw_menu_bar(Ui& ui, const Model& model, std::vector<Command>& commands);

}  // namespace cumulet::demo
