// The scene section of the panel: a list of all objects.

#include <imgui.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "panel.hpp"

namespace cumulet::demo {
namespace {

std::string surfaces_row(const SceneOptions& scene) {
  return "Surfaces: " + std::filesystem::path(scene.surfaces).filename().string();
}

}  // namespace

void Panel::items(Model& model) {
  int tool = static_cast<int>(model.tool);
  const std::vector<Choice> tools = {
      {"None", static_cast<int>(Tool::none), "No outlines, handles or light icons (Q)."},
      {"Move", static_cast<int>(Tool::move), "Move along an axis, in a plane, or in the image plane (W)."},
      {"Rotate", static_cast<int>(Tool::rotate), "Rotate about an axis or the viewing direction (E)."},
      {"Scale", static_cast<int>(Tool::scale), "Scale along one or two of the object's axes, or uniformly (R)."}};
  if (ui_.choose("Handles", "Transform tool for the selected object. Hold Ctrl to snap.", tools, tool))
    model.tool = static_cast<Tool>(tool);
  int axes = static_cast<int>(model.axes);
  if (ui_.choose("Axes", "Axes for moving and rotating (X). Scaling always uses the object's own axes.",
                 {{"World", static_cast<int>(Axes::world), "World axes."},
                  {"Local", static_cast<int>(Axes::local), "The object's own axes."}},
                 axes))
    model.axes = static_cast<Axes>(axes);
  if (!model.scene.surfaces.empty()) {
    ImGui::Indent(ui_.px(6.0f));
    ImGui::TextUnformatted(surfaces_row(model.scene).c_str());
    ui_.remember("Scene/Surfaces", "Cannot be moved. Add the file under Models to move it.");
    ImGui::Unindent(ui_.px(6.0f));
  }
  const std::vector<Item> items = items_of(model.scene);
  if (items.empty()) return;
  // Maximum height of the list in rows; longer lists scroll.
  constexpr std::size_t max_rows = 10;
  const float height = ImGui::GetTextLineHeightWithSpacing();
  const auto rows = static_cast<float>(std::min(items.size(), max_rows));
  ImGui::BeginChild("items", {0.0f, rows * height}, false, ImGuiWindowFlags_NavFlattened);
  ImGui::PushStyleColor(ImGuiCol_Header, IM_COL32(95, 143, 191, 120));
  ImGui::Indent(ui_.px(6.0f));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Item& item = items[i];
    const std::string label = "Scene/" + title_of(model.scene, item);
    const bool chosen = model.chosen == item;
    if (Ui::entry(name_of(model.scene, item), i, chosen)) {
      if (chosen)
        model.chosen.reset();
      else
        model.chosen = item;
    }
    ui_.remember(label.c_str(),
                 "Selects the object and shows its outline and handles. Objects can also be clicked in the image.");
  }
  ImGui::PopStyleColor();
  ImGui::EndChild();
}

}  // namespace cumulet::demo
