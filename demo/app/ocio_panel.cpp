// The rows of the panel that choose a view of OpenColorIO, which replaces the tone map.

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <program.hpp>
#include <string>
#include <vector>

#include "panel.hpp"

namespace cumulet::demo {
namespace {

/// A row that chooses one of these names. chosen: "" is the default. Returns true if the user chose another one.
bool choose_name(Ui& ui, const char* label, const char* tip, const std::vector<std::string>& names,
                 const std::string& standard, std::string& chosen) {
  std::vector<Choice> choices;
  choices.reserve(names.size());
  for (const std::string& name : names)
    choices.push_back({name.c_str(), static_cast<int>(choices.size()), name == standard ? "The default." : tip});
  const auto found = std::ranges::find(names, chosen.empty() ? standard : chosen);
  int index = found == names.end() ? -1 : static_cast<int>(found - names.begin());
  if (!ui.choose(label, tip, choices, index)) return false;
  chosen = names[static_cast<std::size_t>(index)];
  return true;
}

}  // namespace

void Panel::ocio(Model& model, std::vector<Command>& commands) {
  OcioView& view = model.scene.ocio;
  const bool any = !view.config.empty();
  ui_.value_row("OpenColorIO", any ? std::filesystem::path(view.config).filename().string() : "none: the tone map");
  // The viewer reads the displays of another configuration later.
  if (const auto& known = model.status.ocio; any && known && known->config == view.config) {
    std::vector<std::string> names;
    names.reserve(known->displays.size());
    for (const OcioDisplay& display : known->displays) names.push_back(display.name);
    if (choose_name(ui_, "Display", "Display of the configuration.", names, known->default_display, view.display))
      view.view.clear();
    if (const OcioDisplay* const display = known->find(view.display))
      choose_name(ui_, "Display view", "View of the display.", display->views, display->default_view, view.view);
    const std::string automatic = "found by its name";
    std::vector<std::string> spaces = {automatic};
    spaces.insert(spaces.end(), known->color_spaces.begin(), known->color_spaces.end());
    choose_name(ui_, "Radiance space", "Color space of the configuration that is linear Rec. 709.", spaces, automatic,
                view.input);
    if (view.input == automatic) view.input.clear();
  }
  const std::string named = environment_variable("OCIO");
  const bool two = any || !named.empty();
  const float width = two ? Ui::width_beside("Open configuration", any ? "Remove configuration" : "Use $OCIO") : -1.0f;
  if (ui_.button("Open configuration", "Opens an OpenColorIO configuration (.ocio). Its view replaces the tone map.",
                 {width, 0.0f}))
    commands.push_back({Action::ocio_dialog});
  if (!two) return;
  if (width > 0.0f) ImGui::SameLine();
  if (any) {
    if (ui_.button("Remove configuration", "Uses the tone map again.", {width, 0.0f})) view = {};
  } else if (ui_.button("Use $OCIO", named.c_str(), {width, 0.0f})) {
    commands.push_back({Action::open_ocio, named});
  }
}

}  // namespace cumulet::demo
