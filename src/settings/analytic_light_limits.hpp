#pragma once

// Limits of analytic lights (cumulet_set_lights) beyond the range of each single setting.

#include <cumulet/cumulet.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>

namespace cumulet::settings {

inline constexpr std::size_t max_analytic_lights = 4096;
inline constexpr double farthest_analytic_light = 1e30;  ///< maximum absolute coordinate
inline constexpr float brightest_analytic_light =
    1e30F;  ///< stays finite when multiplied by the geometry term of a near point
inline constexpr double widest_sun_analytic_light = 90.0;  ///< degrees

/// Returns why that many lights are rejected; "" if they are accepted.
inline std::string analytic_light_count_refusal(std::uint64_t count) {
  if (count <= max_analytic_lights) return "";
  return std::to_string(count) + " lights exceed the limit of " + std::to_string(max_analytic_lights);
}

struct AnalyticLightRefusal {
  const char* name;   // of the field, and of its key in scene files
  std::string cause;  // text that follows the name
};

/// Checks a light whose settings are each within their range.
inline std::optional<AnalyticLightRefusal> analytic_light_refusal(const cumulet_light_desc& analytic_light) {
  if (!std::all_of(std::begin(analytic_light.position), std::end(analytic_light.position),
                   [](double x) { return std::abs(x) <= farthest_analytic_light; }))
    return AnalyticLightRefusal{"position", "exceeds 1e30"};
  if (analytic_light.kind == CUMULET_LIGHT_DISTANT && analytic_light.angle_degrees > widest_sun_analytic_light)
    return AnalyticLightRefusal{"angle_degrees", "is above 90, the maximum for a distant light"};
  if (!(*std::max_element(std::begin(analytic_light.color), std::end(analytic_light.color)) * analytic_light.power <=
        brightest_analytic_light))
    return AnalyticLightRefusal{"power", "times color exceeds 1e30"};
  return std::nullopt;
}

}  // namespace cumulet::settings
