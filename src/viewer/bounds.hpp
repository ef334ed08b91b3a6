#pragma once

#include <glm/glm.hpp>

namespace cumulet::viewer {

/// An axis-aligned box in world space.
struct Bounds {
  glm::dvec3 min{0.0};
  glm::dvec3 max{0.0};
};

/// Of the voxels from first to last, both inclusive.
inline Bounds world_bounds(const glm::ivec3& first, const glm::ivec3& last, const glm::dmat4& index_to_world) {
  Bounds bounds;
  for (int corner = 0; corner < 8; ++corner) {
    glm::dvec3 p(first);
    for (int axis = 0; axis < 3; ++axis) p[axis] = ((corner >> axis) & 1) != 0 ? last[axis] + 0.5 : first[axis] - 0.5;
    const glm::dvec3 world(index_to_world * glm::dvec4(p, 1.0));
    bounds.min = corner == 0 ? world : glm::min(bounds.min, world);
    bounds.max = corner == 0 ? world : glm::max(bounds.max, world);
  }
  return bounds;
}

}  // namespace cumulet::viewer
