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
      {"None", static_cast<int>(Tool::none), "The picture alone: no outlines, handles and lights' marks (Q)."},
      {"Move", static_cast<int>(Tool::move), "Along an axis, in a plane, or freely in the picture's (W)."},
      {"Rotate", static_cast<int>(Tool::rotate), "About an axis, or about the sight (E)."},
      {"Scale", static_cast<int>(Tool::scale), "Along its own axes, two, or all alike (R)."}};
  if (ui_.choose("Handles", "What dragging the chosen thing's handles does. Ctrl: by steps.", tools, tool))
    model.tool = static_cast<Tool>(tool);
  int axes = static_cast<int>(model.axes);
  if (ui_.choose("Axes", "Along which handles move and turn (X). Scaling is along the thing's own.",
                 {{"World", static_cast<int>(Axes::world), "The world's."},
                  {"Local", static_cast<int>(Axes::local), "The thing's own."}},
                 axes))
    model.axes = static_cast<Axes>(axes);
  if (!model.scene.surfaces.empty()) {
    ImGui::Indent(ui_.px(6.0f));
    ImGui::TextUnformatted(surfaces_row(model.scene).c_str());
    ui_.remember("Scene/Surfaces", "Stands as its file has it. One that is added under Models can be moved.");
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
  for (const Item& item : items) {
    const std::string label = "Scene/" + title_of(model.scene, item);
    const bool chosen = model.chosen == item;
    ImGui::PushID(label.c_str());
    if (ImGui::Selectable(name_of(model.scene, item).c_str(), chosen)) {
      if (chosen)
        model.chosen.reset();
      else
        model.chosen = item;
    }
    ui_.remember(label.c_str(), "Shows its outline and its handles in the picture, where a click chooses it, too.");
    ImGui::PopID();
  }
  ImGui::PopStyleColor();
  ImGui::EndChild();
}

}  // namespace cumulet::demo
