#pragma once

#include <glm/glm.hpp>

#include "volume/volume.hpp"

namespace cumulet::grid {

/// The control cube over a volume: the smallest power-of-two cube of voxels, aligned to bricks, that holds the bounds.
///
/// Cube space has the voxel as its unit: voxel (i,j,k) of the volume is the box [p, p + 1] with p = (i,j,k) - origin,
/// so cells tile voxels exactly (six a voxel at the finest).
struct Cube {
  glm::ivec3 origin{0};  ///< index-space voxel at the cube's low corner, a multiple of 8
  int log2_size = 4;     ///< edge length is 2^log2_size voxels, 4 (the first cells hold a brick) to max_log2_size
  glm::dmat4 to_world{1.0};

  static constexpr int max_log2_size = 18;  // what a cell's record holds: glsl/cell.glsl
  [[nodiscard]] int size() const { return 1 << log2_size; }
  /// Whether its cells have the records of wide cubes (glsl/cell.glsl).
  [[nodiscard]] bool wide() const;
};

/// Over these bounds of the volume's lattice, inclusive; of one on a device aligned to two bricks. Throws
/// Error(unsupported) if they are wider than 2^18 voxels.
Cube fit_cube(const volume::ScalarVolume& volume, const glm::ivec3& bounds_min, const glm::ivec3& bounds_max);
inline Cube fit_cube(const volume::ScalarVolume& volume) {
  return fit_cube(volume, volume.bounds_min, volume.bounds_max);
}

}  // namespace cumulet::grid
