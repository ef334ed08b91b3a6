#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// A volume in at most 96 cells an axis, of mean values: enough to judge how much light it lets through, and where.
class CoarseVolume {
 public:
  /// O(voxels). Throws Error(cancelled) if progress is cancelled.
  explicit CoarseVolume(const ScalarVolume& volume, const Progress* progress = nullptr);

  /// What extinction is to be, times the voxels' values, for a mean optical depth of 8: the mean over rays from all
  /// directions through what is visibly occupied. A ray counts if its depth is at least a twentieth of the mean depth
  /// that the medium itself sees (each ray weighted by its depth), so that haze does not; and no ray counts as deeper
  /// than the densest two hundredth of all rays that meet anything, so that a few extreme voxels do not. Three
  /// significant digits. Depends on the volume alone, and turning or scaling it changes the result by as little as it
  /// must. Nothing for a volume without extinction.
  [[nodiscard]] std::optional<double> suggest_density_scale() const;

  /// World space points whose convex hull is about that of what can be seen at this density scale: of the cells that
  /// lie, along two axes of the grid or more, in columns of an opacity of at least 5 %; if there are none, of all that
  /// is not zero. Empty if all is.
  [[nodiscard]] std::vector<glm::dvec3> visible_hull(double density_scale) const;

 private:
  struct Ray {
    double depth;
    double area;
  };

  [[nodiscard]] std::size_t index(glm::ivec3 cell) const {
    return (static_cast<std::size_t>(cell.z) * static_cast<std::size_t>(size_.y) + static_cast<std::size_t>(cell.y)) *
               static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(cell.x);
  }
  [[nodiscard]] double depth_along(const glm::dvec3& origin, const glm::dvec3& direction) const;
  [[nodiscard]] std::vector<Ray> rays() const;

  glm::ivec3 size_{0};
  std::vector<float> means_;
  glm::dmat4 to_world_{1.0};  ///< cell (i,j,k) is the box from (i,j,k) on
};

}  // namespace cumulet::volume
