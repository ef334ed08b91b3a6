#pragma once

// A host's ramps (1-D transfer functions) and color ramps.

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "settings/ramp.hpp"
#include "viewer/c_support.hpp"
#include "viewer/settings.hpp"
#include "volume/ramp.hpp"

namespace cumulet::c_abi {

struct ParsedRamp {
  volume::Ramp viewer::Ramps::*target;
  volume::Ramp ramp;
};

/// Throws Error(invalid_argument) for an invalid ramp.
inline ParsedRamp read_ramp(cumulet_ramp of, const float* points, std::uint64_t count) {
  constexpr std::array targets = {&viewer::Ramps::density, &viewer::Ramps::temperature, &viewer::Ramps::flame};
  static_assert(targets.size() == settings::ramps.size());
  require(number(of) < targets.size(), "ramp is unknown");
  const auto accept = [&](const std::string& why) {
    if (!why.empty()) refuse(std::string("the ramp of ") + settings::ramps.at(number(of)).name + " " + why);
  };
  accept(settings::ramp_count_refusal(count));
  const std::span<const float> given = array_of(points, count, 2, "points");
  settings::RampPoints checked;
  std::vector<glm::vec2> curve;
  for (std::size_t i = 0; i < given.size(); i += 2) {
    checked.push_back({given[i], given[i + 1]});
    curve.emplace_back(given[i], given[i + 1]);
  }
  accept(settings::ramp_refusal(checked));
  return {targets.at(number(of)), volume::Ramp(std::move(curve))};
}

struct ParsedColorRamp {
  volume::ColorRamp viewer::Ramps::*target;
  volume::ColorRamp ramp;
};

/// Throws Error(invalid_argument) for an invalid color ramp.
inline ParsedColorRamp read_color_ramp(cumulet_ramp of, const float* stops, std::uint64_t count) {
  constexpr std::array targets = {&viewer::Ramps::density_colors, &viewer::Ramps::temperature_colors,
                                  &viewer::Ramps::flame_colors};
  static_assert(targets.size() == settings::color_ramps.size());
  require(number(of) < targets.size(), "ramp is unknown");
  const settings::ColorRampInfo& info = settings::color_ramps.at(number(of));
  const auto accept = [&](const std::string& why) {
    if (!why.empty()) refuse(std::string("the color ramp of ") + info.name + " " + why);
  };
  accept(settings::ramp_count_refusal(count));
  const std::span<const float> given = array_of(stops, count, 4, "stops");
  settings::ColorStops checked;
  std::vector<glm::vec4> colors;
  for (std::size_t i = 0; i < given.size(); i += 4) {
    checked.push_back({given[i], given[i + 1], given[i + 2], given[i + 3]});
    colors.emplace_back(given[i], given[i + 1], given[i + 2], given[i + 3]);
  }
  accept(settings::color_ramp_refusal(info, checked));
  return {targets.at(number(of)), volume::ColorRamp(std::move(colors))};
}

}  // namespace cumulet::c_abi
