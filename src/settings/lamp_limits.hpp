#pragma once

// Limits of lights (cumulet_set_lamps) beyond the range of each single setting.

#include <cumulet/cumulet.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>

namespace cumulet::settings {

inline constexpr std::size_t most_lamps = 4096;
inline constexpr double farthest_lamp = 1e30;    ///< maximum absolute coordinate
inline constexpr float brightest_lamp = 1e30F;   ///< stays finite when multiplied by the geometry term of a near point
inline constexpr double widest_sun_lamp = 90.0;  ///< degrees

/// Returns why that many lights are rejected; "" if they are accepted.
inline std::string lamp_count_refusal(std::uint64_t count) {
  if (count <= most_lamps) return "";
  return std::to_string(count) + " lamps are more than " + std::to_string(most_lamps);
}

struct LampRefusal {
  const char* name;   // of the field, and of its key in scene files
  std::string cause;  // text that follows the name
};

/// Checks a light whose settings are each within their range.
inline std::optional<LampRefusal> lamp_refusal(const cumulet_lamp_desc& lamp) {
  if (!std::all_of(std::begin(lamp.position), std::end(lamp.position),
                   [](double x) { return std::abs(x) <= farthest_lamp; }))
    return LampRefusal{"position", "is beyond 1e30"};
  if (lamp.kind == CUMULET_LAMP_SUN && lamp.angle_degrees > widest_sun_lamp)
    return LampRefusal{"angle_degrees", "of a sun is above 90"};
  if (!(*std::max_element(std::begin(lamp.color), std::end(lamp.color)) * lamp.power <= brightest_lamp))
    return LampRefusal{"power", "times color is above 1e30"};
  return std::nullopt;
}

}  // namespace cumulet::settings
