// The inspector of a light.

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "panel.hpp"

namespace cumulet::demo {

namespace {

using Desc = cumulet_light_desc;

constexpr double sun_at_noon = 4.0;  // W/m²

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

void Panel::analytic_light(Desc& analytic_light) {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.row.label == '\0' || !has(setting, analytic_light.kind)) return;  // no label: only in scene files
    auto& value = analytic_light.*setting.field;
    settings::SettingInfo info = setting;
    if (setting.is(&Desc::power))
      info.row.format = analytic_light.kind == CUMULET_LIGHT_DISTANT ? "%.4g W/m²" : "%.4g W";
    if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, double[3]>) {
      const double length = std::hypot(value[0], value[1], value[2]);
      ui_.numbers(setting.row.label, setting.row.tip, value, static_cast<float>(0.01 * std::max(1.0, length)));
      // Without a reset, because the defaults of a light, such as no power, make no light.
    } else if (rows_.draw(info, value) && setting.is(&Desc::kind)) {
      // Changing the kind sets values that suit it: a distant light's power is in W/m², and a spot needs a cone angle.
      if (analytic_light.kind == CUMULET_LIGHT_DISTANT) analytic_light.power = static_cast<float>(sun_at_noon);
      if (analytic_light.kind == CUMULET_LIGHT_SPOT && analytic_light.angle_degrees == 0.0)
        analytic_light.angle_degrees = 45.0;
    }
  });
  if (analytic_light.kind == CUMULET_LIGHT_DISTANT)
    analytic_light.angle_degrees = std::min(analytic_light.angle_degrees, 90.0);
}

}  // namespace cumulet::demo
