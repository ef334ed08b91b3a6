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

  /// World-space points about what is seen of it along this direction (unit) at this density scale: of every ray whose
  /// opacity is at least 5 %, what lies between the half of that from one end and from the other. The same against the
  /// direction. Empty if there is no such ray.
  [[nodiscard]] std::vector<glm::dvec3> visible(const glm::dvec3& direction, double density_scale) const;

 private:
  struct Ray {
    double depth;
    double area;
  };
  /// Cells, both inclusive.
  struct Box {
    glm::ivec3 low;
    glm::ivec3 high;
  };
  /// Parallel rays, one through the middle of each pixel of a plane through the origin.
  struct Sheet {
    glm::dvec3 u;  ///< unit, as v; both at right angles to the rays
    glm::dvec3 v;
    glm::dvec2 least;  ///< the first pixel's corner, along u and v
    glm::dvec2 pixel;
    [[nodiscard]] glm::dvec3 centre(int x, int y) const {
      return u * (least.x + (x + 0.5) * pixel.x) + v * (least.y + (y + 0.5) * pixel.y);
    }
  };

  [[nodiscard]] std::size_t index(glm::ivec3 cell) const {
    return (static_cast<std::size_t>(cell.z) * static_cast<std::size_t>(size_.y) + static_cast<std::size_t>(cell.y)) *
               static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(cell.x);
  }
  /// visit(from, to, mean) for each cell that the ray meets, near ones first; from and to are in the direction's
  /// lengths.
  template <class Visit>
  void walk(const glm::dvec3& origin, const glm::dvec3& direction, Visit&& visit) const;
  [[nodiscard]] double depth_along(const glm::dvec3& origin, const glm::dvec3& direction) const;
  /// Of all that is not zero.
  [[nodiscard]] std::optional<Box> occupied() const;
  /// So many rays a side, over all of the box.
  [[nodiscard]] Sheet sheet(const Box& box, const glm::dvec3& direction, int rays) const;
  [[nodiscard]] std::vector<Ray> rays() const;

  glm::ivec3 size_{0};
  double unit_ = 1.0;  ///< of the means
  std::vector<float> means_;
  glm::dmat4 to_world_{1.0};  ///< cell (i,j,k) is the box from (i,j,k) on
};

}  // namespace cumulet::volume
