#pragma once

#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// A volume reduced to mean values in at most 96 cells per axis, for estimates of its optical depth and visible extent.
class CoarseVolume {
 public:
  /// An empty volume.
  CoarseVolume() = default;
  /// O(voxels). Throws Error(cancelled) if progress is cancelled.
  explicit CoarseVolume(const ScalarVolume& volume, const Progress* progress = nullptr);

  /// Returns the factor from voxel values to extinction that gives a mean optical depth of 8: the mean over rays from
  /// all directions through the visibly occupied region. A ray counts if its depth is at least a twentieth of the
  /// depth-weighted mean depth, which excludes haze. Depths are clamped to that of the densest 0.5 % of all rays that
  /// hit the volume, because of extreme voxels. The result is rounded to three significant digits. It depends only on
  /// the volume: rotation hardly changes it, and scaling changes it in inverse proportion. Returns nullopt for a volume
  /// without extinction.
  [[nodiscard]] std::optional<double> suggest_density_scale() const;

  /// Returns world-space points around the visible part for this view direction (unit) and density scale. Each ray with
  /// an opacity of at least 5 % contributes the two points at which half of the corresponding optical depth is reached
  /// from either end. The opposite direction gives the same points. Empty if there is no such ray.
  [[nodiscard]] std::vector<glm::dvec3> visible(const glm::dvec3& direction, double density_scale) const;

  /// A quantity as a function of a voxel value above 0.
  using Quantity = std::function<double(float)>;
  [[nodiscard]] bool empty() const { return means_.empty(); }
  /// Returns the maximum of the quantity over all cells, at least 0. O(cells).
  [[nodiscard]] double most(const Quantity& quantity) const;
  /// Returns world-space points around the cells in which the quantity is at least `least`, which is above 0. O(cells).
  [[nodiscard]] std::vector<glm::dvec3> points_where(const Quantity& quantity, double least) const;

 private:
  struct Ray {
    double depth;
    double area;
  };
  /// Range of cells, both ends inclusive.
  struct Box {
    glm::ivec3 low;
    glm::ivec3 high;
  };
  /// Parallel rays, one through the center of each pixel of a plane through the origin.
  struct Sheet {
    glm::dvec3 u;  ///< unit, like v; both are perpendicular to the rays
    glm::dvec3 v;
    glm::dvec2 least;  ///< corner of the first pixel, along u and v
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
  /// Calls visit(from, to, mean) for each cell that the ray crosses, in order; from and to are in units of the
  /// direction's length.
  template <class Visit>
  void walk(const glm::dvec3& origin, const glm::dvec3& direction, Visit&& visit) const;
  [[nodiscard]] double depth_along(const glm::dvec3& origin, const glm::dvec3& direction) const;
  [[nodiscard]] double of(const Quantity& quantity, glm::ivec3 cell) const {
    const double mean = means_[index(cell)];
    return mean > 0.0 ? quantity(static_cast<float>(unit_ * mean)) : 0.0;
  }
  /// Returns the box of all non-zero cells.
  [[nodiscard]] std::optional<Box> occupied() const;
  /// Returns a sheet of rays x rays rays that covers the box.
  [[nodiscard]] Sheet sheet(const Box& box, const glm::dvec3& direction, int rays) const;
  [[nodiscard]] std::vector<Ray> rays() const;

  glm::ivec3 size_{0};
  double unit_ = 1.0;  ///< unit of the means
  std::vector<float> means_;
  glm::dmat4 to_world_{1.0};  ///< cell (i,j,k) is the unit box that begins at (i,j,k)
};

}  // namespace cumulet::volume
