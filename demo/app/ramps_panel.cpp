// The ramps (transfer functions) of the panel.

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

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
    ui_.curve((std::string(info.label) + " curve").c_str(),
              "Drag to move a point. Click to add one. Right-click removes it.", points, view, field.heights,
              field.most);
    double chosen[2] = {static_cast<double>(points[view.chosen][0]), static_cast<double>(points[view.chosen][1])};
    if (ui_.numbers(info.point, "Input and output value of the selected point.", chosen, 0.005f * view.max_value))
      move_point(points, view.chosen, {static_cast<float>(chosen[0]), static_cast<float>(chosen[1])});
  }
}

}  // namespace cumulet::demo
