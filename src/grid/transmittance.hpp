#pragma once

#include <array>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// Approximate transmittance from outside to each block of 2^3 voxels, for the refinement criterion. It is fast to
/// compute and never 0. For each of the six axis directions it is 1 / (1 + optical depth), which is how light falls off
/// with depth in scattering media. The result is the sum of the six divided by 3, at most 1, so three directions in
/// full light count as full light.
class Transmittance {
 public:
  static constexpr int blocks_per_brick = 64;

  /// extinction: per grid value and world unit. Runs in parallel; O(voxels of bricks). Throws Error(cancelled) if
  /// progress is cancelled.
  Transmittance(const Statistics& statistics, double extinction, const Progress* progress = nullptr);

  /// Returns the values of the 64 blocks of the brick at this corner (cube space), z fastest, each at most 1. Null if
  /// the field has no such brick.
  [[nodiscard]] const float* blocks(const glm::ivec3& corner) const;
  /// Returns the maximum in the octree cube at this corner; 1 where the field has no detail.
  [[nodiscard]] float most(const glm::ivec3& corner, int log2_size) const;

 private:
  void sum_blocks(const Progress* progress);
  void sweep(int axis, const Progress* progress);
  void sweep_column(int axis, glm::ivec3 at);
  void fill_pyramid();

  const Statistics* statistics_;
  glm::vec3 voxel_depth_{0.0F};       // optical depth of a voxel of value 1, along each axis
  std::vector<float> sums_;           // per block: sum of its voxels
  std::vector<float> transmittance_;  // per block
  std::vector<float> most_;           // per non-uniform node: the maximum, in the order of its moments
};

/// Maximum transmittance per heap node of one brick tetrahedron, in the heap order of BrickSums.
struct BrickTransmittance {
  std::array<float, 1024> most;

  void compute(const float* blocks, const BrickTree& tree);
};

}  // namespace cumulet::grid
