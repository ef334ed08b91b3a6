#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

namespace cumulet {

/// Returns the corners of the box from low to high; x varies fastest.
inline std::array<glm::dvec3, 8> corners_of(const glm::dvec3& low, const glm::dvec3& high) {
  std::array<glm::dvec3, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i)
    corners[i] = glm::mix(low, high, glm::bvec3((i & 1U) != 0, (i & 2U) != 0, (i & 4U) != 0));
  return corners;
}

}  // namespace cumulet
