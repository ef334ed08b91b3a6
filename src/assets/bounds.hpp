#pragma once

#include <glm/glm.hpp>
#include <limits>

#include "base/corners.hpp"

namespace cumulet::viewer {

/// An axis-aligned box in world space.
struct Bounds {
  glm::dvec3 min{0.0};
  glm::dvec3 max{0.0};
};

/// World bounds of the voxels from first to last, both inclusive.
inline Bounds world_bounds(const glm::ivec3& first, const glm::ivec3& last, const glm::dmat4& index_to_world) {
  Bounds bounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                -glm::dvec3(std::numeric_limits<double>::infinity())};
  for (const glm::dvec3& corner : corners_of(glm::dvec3(first) - 0.5, glm::dvec3(last) + 0.5)) {
    const glm::dvec3 world(index_to_world * glm::dvec4(corner, 1.0));
    bounds.min = glm::min(bounds.min, world);
    bounds.max = glm::max(bounds.max, world);
  }
  return bounds;
}

}  // namespace cumulet::viewer
