#pragma once

#include <cstddef>
#include <optional>
#include <ramp.hpp>
#include <span>
#include <string>

namespace cumulet::demo {

/// State of a curve editor for a ramp: the ranges of both axes, which begin at 0, and the edited points.
struct RampView {
  float max_value = 1.0f;
  float max_result = 1.0f;
  std::optional<std::size_t> held;  // point dragged by the mouse; the ranges stay constant meanwhile
  std::size_t chosen = 0;           // point whose numbers can be typed
};

/// Fits the ranges to the points and to the maximum grid value.
void fit(RampView& view, const settings::RampPoints& points, float max_value);

/// Inserts a point, or moves the existing point with the same value. Returns its index; nullopt if the maximum number
/// of points is reached.
std::optional<std::size_t> add_point(settings::RampPoints& points, settings::RampPoint point);
/// Moves a point; its value is limited by the neighboring points.
void move_point(settings::RampPoints& points, std::size_t index, settings::RampPoint to);
/// Removes a point. Returns false if only two are left, the minimum for a ramp.
bool remove_point(settings::RampPoints& points, std::size_t index);

/// A shape of a ramp for the panel.
struct RampPreset {
  const char* label;
  const char* tip;
  std::span<const settings::RampPoint> points;  // for values from 0 to 1
};
[[nodiscard]] std::span<const RampPreset> ramp_presets();
/// Returns the points of a preset for a grid with values from 0 to max_value.
[[nodiscard]] settings::RampPoints points_of(const RampPreset& preset, float max_value);

/// Returns the points as the flags of ramps take them: "0:0,0.5:0.1,1:1".
[[nodiscard]] std::string ramp_text(const settings::RampPoints& points);
/// Returns the points of such a text; nullopt if it is not one.
[[nodiscard]] std::optional<settings::RampPoints> ramp_of_text(const std::string& text);

}  // namespace cumulet::demo
