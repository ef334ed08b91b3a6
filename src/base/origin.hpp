#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace cumulet {

/// Returns the point nearest to the center of a box, on a grid whose step is a power of two and at least min_step.
/// The point therefore stays the same while the box changes a little. Not finite if the box is not.
inline glm::dvec3 origin_near(const glm::dvec3& low, const glm::dvec3& high, double min_step) {
  const double step = std::exp2(std::ceil(std::log2(min_step)));
  return glm::round(0.5 * (low + high) / step) * step + 0.0;  // no -0
}

/// Returns an origin relative to which floats can represent all positions in a box of the given size (> 0). It is
/// exactly 0 if the box center is within 256 sizes of 0 on each axis. Floats there round by at most 2^-16 of the size.
/// Otherwise it is within 64 sizes of the center.
inline glm::dvec3 far_origin(const glm::dvec3& low, const glm::dvec3& high, double size) {
  constexpr double near_sizes = 256.0;
  constexpr double sizes_per_step = 64.0;
  const glm::dvec3 middle = glm::abs(0.5 * (low + high));
  if (std::max({middle.x, middle.y, middle.z}) <= near_sizes * size) return glm::dvec3(0.0);
  return origin_near(low, high, sizes_per_step * size);
}

/// Returns the transform to a world whose origin is `origin`.
inline glm::dmat4 counted_from(glm::dmat4 to_world, const glm::dvec3& origin) {
  to_world[3] -= glm::dvec4(origin, 0.0);
  return to_world;
}

}  // namespace cumulet
