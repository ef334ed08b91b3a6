#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// What part of the light outside gets to a place in a medium, as the refinement wants to know it: roughly, fast, never
/// 0. Of each block of 2^3 voxels along the six axes, 1 / (1 + optical depth), which is how light falls with the depth
/// where it is scattered; three directions of full light, as before a wall, count as all of it.
class Transmittance {
 public:
  static constexpr int blocks_a_brick = 64;

  /// extinction: of a grid value of the statistics' field, per world unit. In parallel; O(voxels of bricks). progress:
  /// where it is cancelled, Error(cancelled) is thrown.
  Transmittance(const Statistics& statistics, double extinction, const Progress* progress = nullptr);

  /// Of the 64 blocks of the brick at this corner (cube space), z fastest, each at most 1; null where the field has no
  /// such brick.
  [[nodiscard]] const float* blocks(const glm::ivec3& corner) const;
  /// The most in the cube of the octree at this corner; 1 where the field has no detail there.
  [[nodiscard]] float most(const glm::ivec3& corner, int log2_size) const;

 private:
  void sum_blocks(const Progress* progress);
  void sweep(int axis, const Progress* progress);
  void sweep_column(int axis, glm::ivec3 at);
  void fill_pyramid();

  const Statistics* statistics_;
  glm::vec3 voxel_depth_{0.0F};       // optical depth of a voxel of value 1, along each axis
  std::vector<float> sums_;           // of a block's voxels
  std::vector<float> transmittance_;  // of a block
  std::vector<float> most_;           // of a node that is not uniform, by the place of its moments
};

/// The most over the heap of one brick tetrahedron, as BrickSums has sums.
struct BrickTransmittance {
  std::array<float, 1024> most;

  void compute(const float* blocks, const BrickTree& tree);
};

}  // namespace cumulet::grid
