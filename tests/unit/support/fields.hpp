#pragma once

// Fields of volumes for tests.

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "support/volumes.hpp"
#include "volume/volume.hpp"

namespace cumulet::test {

/// A volume of one empty voxel.
inline volume::ScalarVolume nothing() {
  volume::ScalarVolume empty;
  empty.bounds_max = glm::ivec3(0);
  return empty;
}

/// A box of one value.
inline volume::ScalarVolume field(const glm::ivec3& size, const glm::ivec3& low, float value) {
  return make_volume(size, low, [=](const glm::ivec3& /*p*/) { return value; });
}

/// The colors given by a function.
inline std::array<volume::ScalarVolume, 3> colors(const glm::ivec3& size, const glm::ivec3& low,
                                                  glm::vec3 (*color)(const glm::ivec3&)) {
  std::array<volume::ScalarVolume, 3> fields;
  for (int i = 0; i < 3; ++i)
    fields[static_cast<std::size_t>(i)] = make_volume(size, low, [=](const glm::ivec3& p) { return color(p)[i]; });
  return fields;
}

/// The mean cosines given by a function, positive and negative parts separately.
template <class Function>
std::array<volume::ScalarVolume, 2> anisotropy(const glm::ivec3& size, const glm::ivec3& low, Function of) {
  return {make_volume(size, low, [=](const glm::ivec3& p) { return std::max(of(p), 0.0F); }),
          make_volume(size, low, [=](const glm::ivec3& p) { return std::max(-of(p), 0.0F); })};
}

}  // namespace cumulet::test
