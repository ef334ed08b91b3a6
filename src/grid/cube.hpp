#pragma once

#include <glm/glm.hpp>

#include "volume/volume.hpp"

namespace cumulet::grid {

/// The field that voxels stand for (docs/architecture/interpolation.md).
enum class Interpolation {
  nearest,  ///< constant in each voxel
  linear    ///< trilinear between the centers of voxels
};

/// The control cube of a volume: the smallest power-of-two cube of voxels, aligned to bricks, that holds the bounds.
///
/// The unit of cube space is the voxel. Without interpolation, voxel (i,j,k) of the volume is the box [p, p + 1] with
/// p = (i,j,k) - origin, so cells tile voxels exactly (at the finest level six cells per voxel). With linear
/// interpolation p is the center of that voxel, and the box [p, p + 1] has eight voxels at its corners.
struct Cube {
  glm::ivec3 origin{0};  ///< index-space voxel at the cube's low corner, a multiple of 8
  int log2_size = 4;     ///< edge length is 2^log2_size voxels; 4 (the first cells hold a brick) to max_log2_size
  glm::dmat4 to_world{1.0};
  Interpolation interpolation = Interpolation::nearest;

  static constexpr int max_log2_size = 18;  // limit of the cell record: glsl/grid/cell.glsl
  [[nodiscard]] int size() const { return 1 << log2_size; }
  /// Returns true if the cells use the record layout of wide cubes (glsl/grid/cell.glsl).
  [[nodiscard]] bool wide() const;
};

/// Returns the control cube for these inclusive index-space bounds. For a GPU-resident volume the origin is aligned to
/// two bricks. With linear interpolation the cube also holds the boxes around the bounds, in which the field falls to
/// the background. Throws Error(unsupported) if the bounds are wider than 2^18 voxels, and Error(file) if the transform
/// is singular.
Cube fit_cube(const volume::ScalarVolume& volume, const glm::ivec3& bounds_min, const glm::ivec3& bounds_max,
              Interpolation interpolation = Interpolation::nearest);
inline Cube fit_cube(const volume::ScalarVolume& volume, Interpolation interpolation = Interpolation::nearest) {
  return fit_cube(volume, volume.bounds_min, volume.bounds_max, interpolation);
}

}  // namespace cumulet::grid
