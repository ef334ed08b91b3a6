#pragma once

// Trilinear interpolation by definition, in double precision.

#include <glm/glm.hpp>

#include "support/volumes.hpp"

namespace cumulet::test {

/// The interpolated value at a point of index space.
inline double value_between(const volume::ScalarVolume& volume, const glm::dvec3& p) {
  const glm::dvec3 low = glm::floor(p);
  const glm::dvec3 at = p - low;
  double sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    const glm::ivec3 offset(i & 1, (i >> 1) & 1, i >> 2);
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) weight *= offset[axis] != 0 ? at[axis] : 1.0 - at[axis];
    if (weight > 0.0) sum += weight * double{value_at(volume, glm::ivec3(low) + offset)};
  }
  return sum;
}

/// The sum of all voxels within bounds.
inline double sum_of_voxels(const volume::ScalarVolume& volume) {
  double sum = 0.0;
  for (int x = volume.bounds_min.x; x <= volume.bounds_max.x; ++x) {
    for (int y = volume.bounds_min.y; y <= volume.bounds_max.y; ++y) {
      for (int z = volume.bounds_min.z; z <= volume.bounds_max.z; ++z) sum += double{value_at(volume, {x, y, z})};
    }
  }
  return sum;
}

}  // namespace cumulet::test
