#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "grid/cube.hpp"
#include "grid/refine.hpp"

namespace cumulet::grid {

/// How many levels of the bisection a cube of 2^log2_size voxels has whose cells may split: those down to sixths of
/// voxels, which do not.
constexpr unsigned splitting_levels(int log2_size) { return static_cast<unsigned>(3 * log2_size - 2); }
/// The level of a cell in that cube; the roots' is 0.
unsigned level_of(std::uint32_t shape, int log2_size);
/// The level of the six Kuhn tetrahedra of a cube of the octree, of 2^node_size voxels; below 0 for the whole cube.
constexpr int kuhn_level(int log2_size, int node_size) { return 3 * (log2_size - 1 - node_size) + 1; }

/// What a camera allows, in whole numbers: of each cube of the octree, how many levels of the bisection, from the roots
/// on, may split there. A level may if its longest edge, in the volume's world, covers the settings' pixels where the
/// cube is nearest, and none does in a cube out of sight. Whoever builds a grid from the same numbers builds the same.
class ViewLevels {
 public:
  /// settings: of which the camera and the pixels count, copied. Without a camera all levels may.
  ViewLevels(const Cube& cube, const RefineSettings& settings);

  /// In the cube of 2^node_size voxels at this corner (cube space): 0 to splitting_levels().
  [[nodiscard]] unsigned in(const glm::ivec3& corner, int node_size) const;

 private:
  struct Placed {
    glm::dmat4 to_camera{1.0};  // from cube space to the world that the camera is in
    double stretch = 1.0;       // the most that a length of the volume's world grows on its way there
  };
  [[nodiscard]] double shortest_edge(const Placed& placed, const glm::dvec3& centre, double radius) const;

  int log2_size_;
  double angle_ = 0.0;  // that an edge has to cover, in radians
  glm::dvec3 eye_{0.0};
  std::vector<Placed> placed_;  // none: no camera
  std::vector<glm::dvec3> planes_;
  double unit_radius_ = 0.0;     // of the ball about a voxel, in the volume's world
  std::vector<double> longest_;  // edge of a level, or of a finer one
};

/// For cameras in motion: what these settings allow, and some more about it. What was split stays so within that, so
/// that cells do not come and go with each step (OwnPriorities::levels).
RefineSettings with_slack(const RefineSettings& settings);

}  // namespace cumulet::grid
