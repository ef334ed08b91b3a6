#pragma once

#include <cstddef>
#include <optional>
#include <ramp.hpp>

namespace cumulet::demo {

/// What a curve editor shows of a ramp: values from 0 on, and what they become from 0 on; and what is done there.
struct RampView {
  float most_value = 1.0f;
  float most_result = 1.0f;
  std::optional<std::size_t> held;  // by the mouse; meanwhile the two above stay
  std::size_t chosen = 0;           // whose numbers can be typed
};

/// Shows all of the points, and of the grid's values up to this.
void fit(RampView& view, const settings::RampPoints& points, float most_value);

/// A new point, or, of a value that has one, that one moved: its place. None where there are as many as can be.
std::optional<std::size_t> add_point(settings::RampPoints& points, settings::RampPoint point);
/// As far as it goes between the points beside it.
void move_point(settings::RampPoints& points, std::size_t place, settings::RampPoint to);
/// False where two are left, which a ramp needs.
bool remove_point(settings::RampPoints& points, std::size_t place);

}  // namespace cumulet::demo
