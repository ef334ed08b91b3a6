#include "ramp_edit.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace cumulet::demo
