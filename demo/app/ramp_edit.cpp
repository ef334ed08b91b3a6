#include "ramp_edit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <option_values.hpp>
#include <setting.hpp>

namespace cumulet::demo {

using settings::RampPoint;
using settings::RampPoints;

namespace {

constexpr float farthest = settings::max_ramp_value;

float value_of(const RampPoint& point) { return point[0]; }
float result_of(const RampPoint& point) { return point[1]; }

}  // namespace

void fit(RampView& view, const RampPoints& points, float max_value) {
  // An undo may have removed the dragged point.
  if (view.held && *view.held >= points.size()) view.held.reset();
  view.chosen = std::min(view.chosen, std::max<std::size_t>(points.size(), 1) - 1);
  if (view.held || points.empty()) return;
  constexpr float room = 1.25f;  // space above the highest point for dragging
  view.max_value = std::max(max_value, value_of(points.back()));
  if (!(view.max_value > 0.0f)) view.max_value = 1.0f;
  const float highest = result_of(*std::ranges::max_element(points, {}, result_of));
  view.max_result = std::min(room * (highest > 0.0f ? highest : view.max_value), farthest);
}

std::optional<std::size_t> add_point(RampPoints& points, RampPoint point) {
  const auto at = std::ranges::lower_bound(points, value_of(point), {}, value_of);
  const auto index = static_cast<std::size_t>(at - points.begin());
  if (at != points.end() && value_of(*at) == value_of(point)) {
    *at = point;
  } else if (points.size() < settings::max_ramp_points) {
    points.insert(at, point);
  } else {
    return std::nullopt;
  }
  return index;
}

void move_point(RampPoints& points, std::size_t index, RampPoint to) {
  const float least = index > 0 ? std::nextafter(value_of(points[index - 1]), farthest) : -farthest;
  const float most = index + 1 < points.size() ? std::nextafter(value_of(points[index + 1]), -farthest) : farthest;
  points[index] = {std::clamp(value_of(to), least, most), std::clamp(result_of(to), 0.0f, farthest)};
}

bool remove_point(RampPoints& points, std::size_t index) {
  if (points.size() <= 2) return false;
  points.erase(points.begin() + static_cast<std::ptrdiff_t>(index));
  return true;
}

namespace {

constexpr auto same_points = std::to_array<RampPoint>({{0.0f, 0.0f}, {1.0f, 1.0f}});
constexpr auto cut_points = std::to_array<RampPoint>({{0.0f, 0.0f}, {0.15f, 0.0f}, {1.0f, 1.0f}});
constexpr auto soft_points =
    std::to_array<RampPoint>({{0.0f, 0.0f}, {0.25f, 0.0625f}, {0.5f, 0.25f}, {0.75f, 0.5625f}, {1.0f, 1.0f}});
constexpr auto full_points =
    std::to_array<RampPoint>({{0.0f, 0.0f}, {0.0625f, 0.25f}, {0.25f, 0.5f}, {0.5625f, 0.75f}, {1.0f, 1.0f}});
constexpr auto contrast_points =
    std::to_array<RampPoint>({{0.0f, 0.0f}, {0.25f, 0.1f}, {0.5f, 0.5f}, {0.75f, 0.9f}, {1.0f, 1.0f}});
constexpr auto shell_points =
    std::to_array<RampPoint>({{0.0f, 0.0f}, {0.1f, 0.0f}, {0.3f, 1.0f}, {0.5f, 0.0f}, {1.0f, 0.0f}});
constexpr auto solid_points = std::to_array<RampPoint>({{0.0f, 0.0f}, {0.1f, 0.0f}, {0.12f, 1.0f}, {1.0f, 1.0f}});

constexpr auto presets = std::to_array<RampPreset>({
    {"Linear", "The grid's own values.", same_points},
    {"Cut", "Removes thin parts.", cut_points},
    {"Soft", "Lowers small values.", soft_points},
    {"Full", "Raises small values.", full_points},
    {"Contrast", "Lowers small values and raises large ones.", contrast_points},
    {"Shell", "Keeps a layer of medium values.", shell_points},
    {"Solid", "The largest value inside a hard edge.", solid_points},
});

}  // namespace

std::span<const RampPreset> ramp_presets() { return presets; }

RampPoints points_of(const RampPreset& preset, float max_value) {
  RampPoints points;
  for (const RampPoint& point : preset.points)
    points.push_back({value_of(point) * max_value, result_of(point) * max_value});
  return points;
}

std::string ramp_text(const RampPoints& points) {
  std::string text;
  for (const RampPoint& point : points) {
    if (!text.empty()) text += ',';
    text += settings::number_text(value_of(point)) + ':' + settings::number_text(result_of(point));
  }
  return text;
}

std::optional<RampPoints> ramp_of_text(const std::string& text) {
  try {
    RampPoints points = parse_ramp(text);
    if (points.empty()) return std::nullopt;
    return points;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace cumulet::demo
