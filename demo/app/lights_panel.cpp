// The lights section of the panel.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <type_traits>

#include "panel.hpp"

namespace cumulet::demo {

namespace {

using Desc = cumulet_light_desc;

constexpr double sun_at_noon = 4.0;  // W/m²

/// Returns a point light above the camera's target, with the irradiance of the noon sun there.
Desc new_analytic_light(const cumulet_camera_desc& camera) {
  const double distance =
      std::hypot(camera.eye[0] - camera.target[0], camera.eye[1] - camera.target[1], camera.eye[2] - camera.target[2]);
  const double above = distance > 0.0 ? 0.5 * distance : 1.0;
  Desc analytic_light{};
  analytic_light.struct_size = sizeof analytic_light;
  std::copy(camera.target, camera.target + 3, analytic_light.position);
  analytic_light.position[1] += above;
  analytic_light.direction[1] = -1.0;
  analytic_light.power = static_cast<float>(sun_at_noon * 4.0 * std::numbers::pi * above * above);
  settings::spell_out_zeros(analytic_light);
  return analytic_light;
}

/// Returns true if lights of this kind have the setting.
template <class Setting>
bool has(const Setting& setting, cumulet_light_kind kind) {
  const bool area = kind == CUMULET_LIGHT_DISK || kind == CUMULET_LIGHT_RECT;
  if (setting.is(&Desc::position)) return kind != CUMULET_LIGHT_DISTANT;
  if (setting.is(&Desc::direction)) return kind != CUMULET_LIGHT_POINT;
  if (setting.is(&Desc::width)) return area;
  if (setting.is(&Desc::tangent) || setting.is(&Desc::height)) return kind == CUMULET_LIGHT_RECT;
  if (setting.is(&Desc::angle_degrees)) return kind == CUMULET_LIGHT_SPOT || kind == CUMULET_LIGHT_DISTANT;
  return !setting.is(&Desc::blend) || kind == CUMULET_LIGHT_SPOT;
}

}  // namespace

void Panel::analytic_lights(Model& model) {
  std::vector<Desc>& analytic_lights = model.scene.analytic_lights;
  std::optional<std::size_t> removed;
  for (std::size_t i = 0; i < analytic_lights.size(); ++i) {
    Desc& analytic_light = analytic_lights[i];
    const std::string number = std::string(" ").append(std::to_string(i + 1));
    settings::for_each<Desc>([&](auto setting) {
      if (*setting.row.label == '\0' || !has(setting, analytic_light.kind)) return;  // no label: only in scene files
      const std::string label = setting.row.label + number;
      setting.row.label = label.c_str();
      auto& value = analytic_light.*setting.field;
      if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, double[3]>) {
        const double length = std::hypot(value[0], value[1], value[2]);
        ui_.numbers(label.c_str(), setting.row.tip, value, static_cast<float>(0.01 * std::max(1.0, length)));
      } else if (rows_.draw(setting, value) && setting.is(&Desc::kind)) {
        // Changing the kind sets values that suit it: a distant light's power is in W/m², and a spot needs a cone
        // angle.
        if (analytic_light.kind == CUMULET_LIGHT_DISTANT) analytic_light.power = static_cast<float>(sun_at_noon);
        if (analytic_light.kind == CUMULET_LIGHT_SPOT && analytic_light.angle_degrees == 0.0)
          analytic_light.angle_degrees = 45.0;
      }
    });
    if (analytic_light.kind == CUMULET_LIGHT_DISTANT)
      analytic_light.angle_degrees = std::min(analytic_light.angle_degrees, 90.0);
    if (ui_.button(("Remove light" + number).c_str(), "Removes this light.", {-1.0f, 0.0f})) removed = i;
  }
  if (removed) {
    analytic_lights.erase(analytic_lights.begin() + static_cast<std::ptrdiff_t>(*removed));
    forget(model.chosen, Item::Kind::analytic_light, *removed);
  }
  if (!ui_.button("Add light", "Adds a point light above the camera's target.", {-1.0f, 0.0f})) return;
  analytic_lights.push_back(new_analytic_light(model.scene.camera));
  model.chosen = Item{Item::Kind::analytic_light, analytic_lights.size() - 1, 0};
}

}  // namespace cumulet::demo
