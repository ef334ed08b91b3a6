// The inspector of a light.

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "panel.hpp"
#include "selection.hpp"

namespace cumulet::demo {

namespace {

using Desc = cumulet_light_desc;

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

void Panel::analytic_light(Model& model, Desc& analytic_light) {
  const cumulet_light_kind before = analytic_light.kind;
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.row.label == '\0' || !has(setting, analytic_light.kind)) return;  // no label: only in scene files
    auto& value = analytic_light.*setting.field;
    settings::SettingInfo info = setting;
    if (setting.is(&Desc::power))
      info.row.format = analytic_light.kind == CUMULET_LIGHT_DISTANT ? "%.4g W/m²" : "%.4g W";
    if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, double[3]>) {
      const double length = std::hypot(value[0], value[1], value[2]);
      ui_.numbers(setting.row.label, setting.row.tip, value, static_cast<float>(0.01 * std::max(1.0, length)));
    } else if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, float[3]>) {
      light_color_.draw(info.row.label, info.row.tip, value);
    } else {
      // Without a reset, because the defaults of a light, such as no power, make no light.
      rows_.draw(info, value);
    }
  });
  if (analytic_light.kind != before) adapt_light(analytic_light, before, model.scene);
  if (analytic_light.kind == CUMULET_LIGHT_DISTANT)
    analytic_light.angle_degrees = std::min(analytic_light.angle_degrees, 90.0);
}

}  // namespace cumulet::demo
