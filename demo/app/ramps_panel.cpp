// The ramps (transfer functions) of the panel.

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <string>
#include <vector>

#include "panel.hpp"

namespace cumulet::demo {

namespace {

// Returns the name of a grid at the beginning of a label, with a text behind it.
std::string label_of(const char* grid, const char* rest) {
  std::string label = std::string(grid) + rest;
  label.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(label.front())));
  return label;
}

float reach_of(float most) { return most > 0.0f ? std::min(most, settings::max_ramp_value) : 1.0f; }

}  // namespace

void Panel::ramps(Model& model, SceneVolume& volume, const Fields& fields) {
  for (std::size_t i = 0; i < volume.ramps.size(); ++i) {
    const settings::RampInfo& info = settings::ramps[i];
    const FieldValues& field = fields[i];
    settings::RampPoints& points = volume.ramps[i];
    const bool has_grid = field.most > 0.0f;
    // A ramp of a grid that the volume does not have can only be removed.
    if (has_grid || !points.empty()) {
      RampView& view = ramp_views_[i];
      bool on = !points.empty();
      if (ui_.checkbox(info.label, info.tip, on)) {
        const float most = reach_of(field.most);
        points.clear();
        if (on) points = {{0.0f, 0.0f}, {most, most}};
      }
      fit(view, points, field.most);
      if (!points.empty()) {
        shape_ramp(model, points, i, field.most);
        ui_.curve((std::string(info.label) + " curve").c_str(),
                  "Drag to move a point. Click to add one. Right-click removes it.", points, view, field.heights,
                  field.most);
        double chosen[2] = {static_cast<double>(points[view.chosen][0]), static_cast<double>(points[view.chosen][1])};
        if (ui_.numbers(info.point, "Input and output value of the selected point.", chosen, 0.005f * view.max_value))
          move_point(points, view.chosen, {static_cast<float>(chosen[0]), static_cast<float>(chosen[1])});
      }
    }
    if (has_grid || !volume.color_ramps[i].empty()) color_ramp(model, volume, i, field.most);
  }
}

void Panel::shape_ramp(Model& model, settings::RampPoints& points, std::size_t index, float most) {
  const settings::RampInfo& info = settings::ramps[index];
  std::vector<Choice> choices;
  for (const RampPreset& preset : ramp_presets())
    choices.push_back({preset.label, static_cast<int>(choices.size()), preset.tip});
  int chosen = -1;
  if (ui_.choose(label_of(info.name, " shape").c_str(), "Replaces the curve by a common one.", choices, chosen))
    points = points_of(ramp_presets()[static_cast<std::size_t>(chosen)], reach_of(most));
  const float width = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2.0f;
  const std::string id = std::string("##") + info.name;
  if (ui_.button(("Copy" + id).c_str(), "Copies the curve as text, which the command line takes too.", {width, 0.0f}))
    ImGui::SetClipboardText(ramp_text(points).c_str());
  ImGui::SameLine();
  if (!ui_.button(("Paste" + id).c_str(), "Replaces the curve by the copied one.", {width, 0.0f})) return;
  const char* const copied = ImGui::GetClipboardText();
  if (const auto pasted = ramp_of_text(copied != nullptr ? copied : ""))
    points = *pasted;
  else
    show_message(model, false, "The clipboard has no curve", time_);
}

void Panel::color_ramp(Model& model, SceneVolume& volume, std::size_t index, float most) {
  const settings::ColorRampInfo& info = settings::color_ramps[index];
  settings::ColorStops& stops = volume.color_ramps[index];
  ColorRampView& view = color_ramp_views_[index];
  bool on = !stops.empty();
  if (ui_.checkbox(info.label, info.tip, on)) {
    stops.clear();
    if (on) stops = first_stops(index, reach_of(most), volume.medium);
  }
  fit(view, stops, most);
  if (stops.empty()) return;
  choose_colors(model, stops, index, most);
  ui_.gradient((std::string(info.label) + " bar").c_str(),
               "Drag to move a stop. Click to add one. Right-click, Delete or a drag off the bar removes it.", stops,
               view);
  settings::ColorStop& stop = stops[view.chosen];
  double value[1] = {static_cast<double>(stop[0])};
  if (ui_.numbers((std::string("Stop##") + info.label).c_str(), "Grid value of the selected stop.", value,
                  0.005f * (view.max_value - view.min_value)))
    move_stop(stops, view.chosen, static_cast<float>(value[0]));
  // Emission may be brighter than a color field can show. Its brightness stays.
  const float peak = std::max({1.0f, stop[1], stop[2], stop[3]});
  float color[3] = {stop[1] / peak, stop[2] / peak, stop[3] / peak};
  if (ui_.color((std::string("Stop color##") + info.label).c_str(), "Color of the selected stop.", color))
    for (std::size_t i = 0; i < 3; ++i) stop[i + 1] = peak * color[i];
}

void Panel::choose_colors(Model& model, settings::ColorStops& stops, std::size_t index, float most) {
  const settings::ColorRampInfo& info = settings::color_ramps[index];
  std::vector<Choice> choices;
  for (const ColorRampPreset& preset : color_ramp_presets())
    choices.push_back({preset.label, static_cast<int>(choices.size()), preset.tip});
  int chosen = -1;
  if (ui_.choose((std::string("Palette##") + info.label).c_str(), "Replaces the colors by common ones.", choices,
                 chosen))
    stops = stops_of(color_ramp_presets()[static_cast<std::size_t>(chosen)], reach_of(most));
  const float width = (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x) / 2.0f;
  const std::string id = std::string("##") + info.label;
  if (ui_.button(("Copy" + id).c_str(), "Copies the colors as text, which the command line takes too.", {width, 0.0f}))
    ImGui::SetClipboardText(color_ramp_text(stops).c_str());
  ImGui::SameLine();
  if (!ui_.button(("Paste" + id).c_str(), "Replaces the colors by the copied ones.", {width, 0.0f})) return;
  const char* const copied = ImGui::GetClipboardText();
  if (const auto pasted = color_ramp_of_text(info, copied != nullptr ? copied : ""))
    stops = *pasted;
  else
    show_message(model, false, "The clipboard has no colors that suit this grid", time_);
}

}  // namespace cumulet::demo
