#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "base/progress.hpp"
#include "grid/cube.hpp"
#include "volume/volume.hpp"

namespace cumulet::grid {

/// Exact integrals of the field f over a region, in cube space (unit: voxel).
struct Moments {
  double volume = 0.0;
  double mass = 0.0;      ///< integral of f
  double square = 0.0;    ///< integral of f^2
  glm::dvec3 first{0.0};  ///< integral of f x, about the cube's origin
  float min = 3.0e38F;    ///< over all voxels that the region covers, or between which it interpolates
  float max = -3.0e38F;

  Moments& operator+=(const Moments& other);
  [[nodiscard]] double mean() const { return mass / volume; }
  [[nodiscard]] double variance() const;
};

/// Returns the covariance of position and f over a cell, in the cell's frame and unit: integral of (f - mean)(x -
/// centroid) / volume.
glm::vec3 frame_covariance(const Moments& moments, std::uint32_t shape, const glm::dvec3& centroid);

/// The least-squares linear fit of f over a cell, scaled so that it is not negative anywhere. The mean is kept.
struct LinearFit {
  glm::vec3 gradient{0.0F};  ///< along the cell's frame axes, per frame unit
  float explained = 0.0F;    ///< the part of the variance that the fit removes
};

/// Solves the normal equations with the tetrahedron's own covariance matrix, a constant of its class
/// (glsl/grid/cell_fit.glsl). covariance: from frame_covariance().
LinearFit fit_linear(std::uint32_t cell_class, const glm::vec3& covariance, float mean);

/// Subdivision of a brick's Kuhn tetrahedron (class B, unit 8) into 512 sixths of voxels; one table for each of the 48
/// frames. Heap order: 1 is the whole, 2h and 2h + 1 are the children of h, 512 to 1023 are the sixths.
struct BrickTree {
  std::array<std::uint16_t, 512> voxel;            ///< per leaf: index into the brick's values
  std::array<std::array<float, 512>, 3> centroid;  ///< per leaf: x, y and z of its centroid, from the brick's low
                                                   ///< corner
  std::array<std::uint16_t, 512> shape;            ///< shape of internal node h
  std::array<glm::u8vec3, 512> midpoint;           ///< midpoint of the refinement edge of node h, from the brick's low
                                                   ///< corner
  std::array<glm::vec3, 512> node_centroid;        ///< centroid of internal node h, from the brick's low corner

  /// The axes of a leaf's frame in the 9^3 lattice points of a brick, for interpolation.
  struct Leaf {
    std::uint16_t first;               ///< index of its vertex 0
    std::array<std::int16_t, 3> step;  ///< of the index, along each axis of its frame
    std::array<std::int16_t, 3> axis;  ///< axis of the cube; negative direction: ~axis
  };
  std::array<Leaf, 512> leaf;
};
const BrickTree& brick_tree(std::uint32_t frame);

/// Index 0..5 of a frame's axis permutation.
std::uint32_t permutation_of(std::uint32_t shape);
/// The frame (bits 0-8 of a shape word) of the Kuhn tetrahedron with this permutation in the octree cube at corner.
std::uint32_t kuhn_frame(const glm::ivec3& corner, int size, std::uint32_t permutation);

/// Values at the 9^3 lattice points of a brick, z fastest.
inline constexpr int brick_corners = volume::brick_size + 1;
using BrickCorners = std::array<float, std::size_t{brick_corners} * brick_corners * brick_corners>;

/// Sums over the heap of one brick tetrahedron, relative to a reference value to avoid float cancellation.
struct BrickSums {
  float reference = 0.0F;
  std::array<float, 1024> mass;     ///< sum of (f - reference) over the leaves below
  std::array<float, 1024> square;   ///< sum of (f - reference)^2
  std::array<float, 1024> x, y, z;  ///< sum of (f - reference) * leaf centroid, from the brick's low corner
  std::array<float, 1024> min, max;

  /// Returns the reference value of a brick's sums: its mean, the same for all of its trees. This takes as long as one
  /// compute().
  static float reference_of(const float* values);
  void compute(const float* values, float of_brick, const BrickTree& tree);
  /// Computes the sums of the trilinear function between the 9^3 values at a brick's lattice points.
  void compute_between(const BrickCorners& corners, float of_brick, const BrickTree& tree);
  /// Returns the moments of heap node h of a brick whose low corner is at corner.
  [[nodiscard]] Moments moments(unsigned h, const glm::ivec3& corner, const BrickTree& tree) const;

 private:
  void add_up();
};
/// Returns the moments of a brick's whole tetrahedron, from the brick's summary.
Moments moments_of(const volume::BrickSummary& summary, std::uint32_t permutation, const glm::ivec3& corner,
                   const BrickTree& tree);

/// The volume's octree down to bricks, with exact moments of the six Kuhn tetrahedra of every cube.
///
/// Only non-uniform cubes are subdivided: O(active nodes) memory.
class Statistics {
 public:
  struct Node {
    glm::ivec3 corner{0};
    int log2_size = 0;
    std::uint32_t child = 0;       ///< first of 8 children (x fastest bit), 0: none
    std::int32_t values = -1;      ///< brick payload: its number, -1: none
    float uniform = 0.0F;          ///< the value if there are neither children nor payload
    std::uint32_t moments = none;  ///< index of six Moments, none for a uniform node
    static constexpr std::uint32_t none = 0xffffffffU;
    [[nodiscard]] bool is_uniform() const { return child == 0 && values < 0; }
  };

  /// progress, here and below: receives the fraction done. Throws Error(cancelled) if it is cancelled.
  Statistics(const volume::ScalarVolume& volume, const Cube& cube, Progress* progress = nullptr);

  [[nodiscard]] const Cube& cube() const { return cube_; }
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] bool interpolates() const { return cube_.interpolation == Interpolation::linear; }
  /// Returns the 512 values of a brick node, possibly stored in `room`: of its voxels, or with interpolation the means
  /// of its cells. Not available for a brick with a summary.
  const float* values(const Node& node, volume::BrickValues::Brick& room) const;
  /// Reads the voxels at the lattice points of a brick node. Only with interpolation.
  void read_corners(const Node& node, BrickCorners& corners) const;
  /// Returns the summary of a GPU-resident brick node, else null.
  [[nodiscard]] const volume::BrickSummary* summary(const Node& node) const {
    return on_device_ && node.values >= 0 ? &on_device_->summary(static_cast<std::size_t>(node.values)) : nullptr;
  }
  /// Null if brick values are in main memory.
  [[nodiscard]] const volume::DeviceBricksPtr& on_device() const { return on_device_; }
  /// Returns true if all brick values are exactly representable as half floats.
  [[nodiscard]] bool values_are_halves() const;
  /// Exact moments of any cell no smaller than a brick's Kuhn tetrahedron, or within a uniform node.
  [[nodiscard]] Moments moments(const glm::vec3& v0, std::uint32_t shape) const;
  /// The smallest node that holds voxel p of the cube.
  [[nodiscard]] const Node& node_at(const glm::ivec3& p, int min_log2_size = 3) const;
  [[nodiscard]] const Moments& kuhn(const Node& node, std::uint32_t permutation) const {
    return moments_[node.moments + permutation];
  }
  /// Optical depth per unit extinction scale, in grid value x world unit: the mean over the rays along the three axes
  /// that hit any density.
  [[nodiscard]] double mean_optical_depth() const { return mean_optical_depth_; }
  /// Nodes of one size that are not uniform.
  [[nodiscard]] const std::vector<std::uint32_t>& nodes_of_size(int log2_size) const {
    return by_size_[static_cast<std::size_t>(log2_size)];
  }
  /// Main memory in bytes, without the volume's.
  [[nodiscard]] std::uint64_t bytes() const {
    return nodes_.size() * (sizeof(Node) + 4) + moments_.size() * sizeof(Moments) + extra_values_.size() * 4;
  }

 private:
  void build_topology(const volume::ScalarVolume& volume, Progress* progress);
  // Sets the values of a node of a brick's size, and stores them if the volume has no such brick. tiles: all that
  // overlap the node.
  void set_values(Node& node, const std::optional<std::uint32_t>& brick, const std::vector<std::uint32_t>& tiles);
  // Sets the values of such a node with interpolation: those of its lattice points. Sets its uniform value if all are
  // equal. tiles: all that overlap its lattice points.
  void set_corners(Node& node, const std::vector<std::uint32_t>& tiles);
  void compute_moments(Progress* progress);
  void compute_mean_optical_depth(const volume::ScalarVolume& volume, Progress* progress);

  Cube cube_;
  std::vector<Node> nodes_;
  std::vector<std::vector<std::uint32_t>> by_size_;
  std::vector<Moments> moments_;
  const volume::ScalarVolume* volume_;
  volume::DeviceBricksPtr on_device_;
  std::vector<float> extra_values_;  // payloads of bricks in which a tile or the background ends: voxels, or corners
  double mean_optical_depth_ = 0.0;
};

/// The values of one brick, for the sums of its tetrahedra.
class BrickField {
 public:
  void read(const Statistics& statistics, const Statistics::Node& node);
  void sum(const BrickTree& tree, BrickSums& sums) const;

 private:
  bool interpolates_ = false;
  float reference_ = 0.0F;
  const float* values_ = nullptr;  // without interpolation
  volume::BrickValues::Brick room_{};
  BrickCorners corners_{};
};

/// Moments of a cell in which f is uniform.
Moments uniform_moments(const glm::vec3& v0, std::uint32_t shape, float value);

}  // namespace cumulet::grid
