#pragma once

// Ramps and color ramps (transfer functions) of grid values (cumulet_set_ramp, cumulet_set_color_ramp): their texts for
// users, and checks of their points.

#include <cumulet/cumulet.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "setting.hpp"

namespace cumulet::settings {

/// A grid value, and the value that it is mapped to.
using RampPoint = std::array<float, 2>;
/// Empty: values are unchanged.
using RampPoints = std::vector<RampPoint>;

/// A grid value, and its color: linear Rec. 709.
using ColorStop = std::array<float, 4>;
/// Empty: no color ramp.
using ColorStops = std::vector<ColorStop>;

/// Returns the points or stops in the form that cumulet_set_ramp and cumulet_set_color_ramp take.
template <class Points>
const float* numbers_of(const Points& points) {
  return points.empty() ? nullptr : points.front().data();
}

/// The names and texts of a ramp; fields as in SettingInfo.
struct RampInfo {
  const char* name;
  const char* key;
  const char* flag;
  const char* help;
  const char* label;
  const char* tip;
  const char* point;  // label of a point's two numbers in the demo
};

/// Indexed by the ramp enum of cumulet.h.
inline constexpr std::array ramps = {
    RampInfo{"density", "medium.density_ramp", "--density-ramp",
             "Remaps the density (transfer function), linear between points: \"0:0,0.1:0,1:1\" removes thin smoke "
             "(default: none)",
             "Density ramp", "Curve (transfer function) that changes the values of the density grid. 0 stays 0.",
             "Density point"},
    RampInfo{"temperature", "medium.temperature_ramp", "--temperature-ramp",
             "Remaps the temperature grid, before scale and offset (default: none)", "Temperature ramp",
             "Curve (transfer function) that changes the values of the temperature grid. 0 stays 0.",
             "Temperature point"},
    RampInfo{"flame", "medium.flame_ramp", "--flame-ramp",
             "Remaps the flame grid, before the flame strength (default: none)", "Flame ramp",
             "Curve (transfer function) that changes the values of the flame grid. 0 stays 0.", "Flame point"}};
static_assert(CUMULET_RAMP_DENSITY == 0 && CUMULET_RAMP_TEMPERATURE == 1 && CUMULET_RAMP_FLAME == 2);

/// The names and texts of a color ramp; fields as in SettingInfo.
struct ColorRampInfo {
  const char* name;
  const char* key;
  const char* flag;
  const char* help;
  const char* label;
  const char* tip;
  float most;  // maximum of a color component
};

/// Indexed by the ramp enum of cumulet.h.
inline constexpr std::array color_ramps = {
    ColorRampInfo{"density", "medium.density_color_ramp", "--density-color-ramp",
                  "Colors of scattered light by density, a factor of the albedo: \"0:#80a0ff,1:1/0.8/0.6\", sRGB or "
                  "linear (default: none)",
                  "Density colors",
                  "Color for each value of the density grid. It multiplies the scatter color. The density ramp does "
                  "not move it.",
                  1.0F},
    ColorRampInfo{"temperature", "medium.temperature_color_ramp", "--temperature-color-ramp",
                  "Colors of emitted light by temperature, instead of those of black bodies (default: none)",
                  "Temperature colors",
                  "Color of the fire for each value of the temperature grid, instead of that of its heat. Fire "
                  "brightness sets the brightness.",
                  1e30F},
    ColorRampInfo{"flame", "medium.flame_color_ramp", "--flame-color-ramp",
                  "Colors of emitted light by flame, instead of the flame color (default: none)", "Flame colors",
                  "Color of the flame for each value of the flame grid, instead of the flame color.", 1e30F}};
static_assert(color_ramps.size() == ramps.size());

inline constexpr std::size_t max_ramp_points = 32;
inline constexpr float max_ramp_value = 1e30F;  ///< maximum of values and of mapped values

/// Returns why that many points are rejected; "" if they are accepted.
inline std::string ramp_count_refusal(std::uint64_t count) {
  if (count == 0 || (count >= 2 && count <= max_ramp_points)) return "";
  return "has " + std::to_string(count) + (count == 1 ? " point" : " points") + "; it must have 0 or 2 to " +
         std::to_string(max_ramp_points);
}

/// Returns why the points are rejected, as text that follows the ramp's name; "" if they are accepted.
inline std::string ramp_refusal(std::span<const RampPoint> points) {
  if (std::string why = ramp_count_refusal(points.size()); !why.empty()) return why;
  const auto text = [](const RampPoint& point) { return number_text(point[0]) + ":" + number_text(point[1]); };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [value, result] = points[i];
    if (!(std::abs(value) <= max_ramp_value))
      return "has a point " + text(points[i]) + " whose input is not from -1e30 to 1e30";
    if (!(result >= 0.0F && result <= max_ramp_value))
      return "has a point " + text(points[i]) + " whose output is not from 0 to 1e30";
    if (i > 0 && !(value > points[i - 1][0]))
      return "has a point " + text(points[i]) + " whose input is not above that of " + text(points[i - 1]);
  }
  return "";
}

/// Returns a stop as "0.5:1/0.8/0.6".
inline std::string color_stop_text(const ColorStop& stop) {
  return number_text(stop[0]) + ':' + number_text(stop[1]) + '/' + number_text(stop[2]) + '/' + number_text(stop[3]);
}

/// Returns why the stops of a color ramp are rejected, as text that follows its name; "" if they are accepted.
inline std::string color_ramp_refusal(const ColorRampInfo& info, std::span<const ColorStop> stops) {
  if (std::string why = ramp_count_refusal(stops.size()); !why.empty()) return why;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const ColorStop& stop = stops[i];
    if (!(std::abs(stop[0]) <= max_ramp_value))
      return "has a point " + color_stop_text(stop) + " whose input is not from -1e30 to 1e30";
    for (std::size_t c = 1; c < stop.size(); ++c) {
      if (!(stop[c] >= 0.0F && stop[c] <= info.most))
        return "has a point " + color_stop_text(stop) + " whose color is not from 0 to " + number_text(info.most);
    }
    if (i > 0 && !(stop[0] > stops[i - 1][0]))
      return "has a point " + color_stop_text(stop) + " whose input is not above that of " +
             color_stop_text(stops[i - 1]);
  }
  return "";
}

}  // namespace cumulet::settings
