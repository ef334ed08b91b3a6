#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace cumulet {

/// The point nearest to the middle of a box, of a grid whose step is a power of two and at least that: so it stays
/// where it is while the box changes a little. Not finite where the box is not.
inline glm::dvec3 origin_near(const glm::dvec3& low, const glm::dvec3& high, double least_step) {
  const double step = std::exp2(std::ceil(std::log2(least_step)));
  return glm::round(0.5 * (low + high) / step) * step + 0.0;  // no -0
}

/// A point from which floats hold all positions in a box of that size: exactly 0 if the box is within 256 of its sizes
/// of 0, where floats round by 2^-16 of the size at most; else one within 64 sizes of the box's middle. size: more than
/// 0.
inline glm::dvec3 far_origin(const glm::dvec3& low, const glm::dvec3& high, double size) {
  constexpr double near_sizes = 256.0;
  constexpr double sizes_a_step = 64.0;
  const glm::dvec3 middle = glm::abs(0.5 * (low + high));
  if (std::max({middle.x, middle.y, middle.z}) <= near_sizes * size) return glm::dvec3(0.0);
  return origin_near(low, high, sizes_a_step * size);
}

/// The same place, in a world that begins at that origin.
inline glm::dmat4 counted_from(glm::dmat4 to_world, const glm::dvec3& origin) {
  to_world[3] -= glm::dvec4(origin, 0.0);
  return to_world;
}

}  // namespace cumulet
