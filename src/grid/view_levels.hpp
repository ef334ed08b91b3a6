#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "grid/cube.hpp"
#include "grid/refine_settings.hpp"

namespace cumulet::grid {

/// Number of bisection levels whose cells may split, in a cube of 2^log2_size voxels. The last level, of sixths of
/// voxels, does not split.
constexpr unsigned splitting_levels(int log2_size) { return static_cast<unsigned>(3 * log2_size - 2); }
/// Level of a cell in that cube; the roots have level 0.
unsigned level_of(std::uint32_t shape, int log2_size);
/// Level of the six Kuhn tetrahedra of an octree cube of 2^node_size voxels; negative for the whole cube.
constexpr int kuhn_level(int log2_size, int node_size) { return 3 * (log2_size - 1 - node_size) + 1; }

/// Number of levels of splitting cells inside a brick, starting with its Kuhn tetrahedra. For larger cubes the first
/// three levels are the cube's own.
inline constexpr unsigned brick_levels = CM_BRICK_LEVELS;

/// For each octree cube, the number of bisection levels, from the roots on, that may split in a camera's view. A level
/// may split if its longest edge, in the volume's world space, covers the settings' pixel_size at the point of the cube
/// nearest to the camera. No level splits in a cube outside the frustum. The numbers are integers, so every builder
/// makes the same grid from them.
class ViewLevels {
 public:
  /// settings: only the camera and pixel_size are used; they are copied. Without a camera all levels may split.
  ViewLevels(const Cube& cube, const RefineSettings& settings);

  /// Returns the number of levels for the cube of 2^node_size voxels at this corner (cube space): 0 to
  /// splitting_levels().
  [[nodiscard]] unsigned in(const glm::ivec3& corner, int node_size) const;

 private:
  struct Instance {
    glm::dmat4 to_camera{1.0};  // from cube space to the camera's world space
    double stretch = 1.0;       // maximum scale factor of the instance transform
  };
  [[nodiscard]] double shortest_edge(const Instance& instance, const glm::dvec3& centre, double radius) const;

  int log2_size_;
  double angle_ = 0.0;  // minimum angle that an edge must cover, in radians
  glm::dvec3 eye_{0.0};
  std::vector<Instance> instances_;  // empty: no camera
  std::vector<glm::dvec3> planes_;
  double unit_radius_ = 0.0;     // radius of the sphere around a voxel, in the volume's world space
  std::vector<double> longest_;  // per level: longest edge of this level and all finer ones
};

/// Returns looser settings for a moving camera. Cells that were split stay split while these settings allow it, so that
/// cells do not appear and disappear with each step (OwnPriorities::levels).
RefineSettings with_slack(const RefineSettings& settings);

}  // namespace cumulet::grid
