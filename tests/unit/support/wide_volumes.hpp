#pragma once

// Sparse volumes in very large bounds.

#include <glm/glm.hpp>

#include "support/volumes.hpp"

namespace cumulet::test {

/// The same voxels, translated by a multiple of the brick size.
inline volume::ScalarVolume moved(volume::ScalarVolume v, const glm::ivec3& by) {
  v.bounds_min += by;
  v.bounds_max += by;
  for (glm::ivec3& origin : v.brick_origins) origin += by;
  return v;
}

/// The union of two volumes. The bricks of b come after those of a.
inline volume::ScalarVolume both(volume::ScalarVolume a, const volume::ScalarVolume& b) {
  a.bounds_min = glm::min(a.bounds_min, b.bounds_min);
  a.bounds_max = glm::max(a.bounds_max, b.bounds_max);
  a.max_value = std::max(a.max_value, b.max_value);
  a.active_voxels += b.active_voxels;
  a.brick_origins.insert(a.brick_origins.end(), b.brick_origins.begin(), b.brick_origins.end());
  std::vector<float>& values = a.brick_values.as_floats();
  for (std::size_t i = 0; i < b.brick_values.size(); ++i) values.push_back(b.brick_values[i]);
  return a;
}

/// A small cloud and a copy of it at this offset.
inline volume::ScalarVolume clouds_apart(const volume::ScalarVolume& cloud, const glm::ivec3& by) {
  return both(cloud, moved(cloud, by));
}

}  // namespace cumulet::test
