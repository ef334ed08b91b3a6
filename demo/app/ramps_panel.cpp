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

void Panel::ramps(Model& model) {
  for (std::size_t i = 0; i < model.scene.ramps.size(); ++i) {
    const settings::RampInfo& info = settings::ramps[i];
    const FieldValues& field = model.status.fields[i];
    settings::RampPoints& points = model.scene.ramps[i];
    RampView& view = ramp_views_[i];
    bool on = !points.empty();
    if (ui_.checkbox(info.label, info.tip, on)) {
      const float most = field.most > 0.0f ? std::min(field.most, settings::max_ramp_value) : 1.0f;
      points.clear();
      if (on) points = {{0.0f, 0.0f}, {most, most}};
    }
    fit(view, points, field.most);
    if (points.empty()) continue;
    shape_ramp(model, i);
    ui_.curve((std::string(info.label) + " curve").c_str(),
              "Drag to move a point. Click to add one. Right-click removes it.", points, view, field.heights,
              field.most);
    double chosen[2] = {static_cast<double>(points[view.chosen][0]), static_cast<double>(points[view.chosen][1])};
    if (ui_.numbers(info.point, "Input and output value of the selected point.", chosen, 0.005f * view.max_value))
      move_point(points, view.chosen, {static_cast<float>(chosen[0]), static_cast<float>(chosen[1])});
  }
}

void Panel::shape_ramp(Model& model, std::size_t index) {
  const settings::RampInfo& info = settings::ramps[index];
  settings::RampPoints& points = model.scene.ramps[index];
  const float most = model.status.fields[index].most;
  std::vector<Choice> choices;
  for (const RampPreset& preset : ramp_presets())
    choices.push_back({preset.label, static_cast<int>(choices.size()), preset.tip});
  int chosen = -1;
  std::string label = std::string(info.name) + " shape";
  label.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(label.front())));
  if (ui_.choose(label.c_str(), "Replaces the curve by a common one.", choices, chosen))
    points = points_of(ramp_presets()[static_cast<std::size_t>(chosen)],
                       most > 0.0f ? std::min(most, settings::max_ramp_value) : 1.0f);
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

}  // namespace cumulet::demo
