#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "grid/cube.hpp"

namespace cumulet::grid {

/// Refinement criterion: the error indicator of a cell that is compared with the threshold. s is the standard deviation
/// that the cell leaves, e its longest edge, and d the mean optical depth of the volume's rays.
///
///  - deviation: s e / d.
///  - range_mean: (max - min) / mean, as in the paper.
///  - transmittance: s e weighted by visibility: T^2 s e / (1 + r m e) / (1 - exp(-d)). Extinctions use
///    RefineSettings::density_scale. m is the cell's mean, r the reduced extinction (hiding()), and T the transmittance
///    from outside to the cell (Transmittance of r). T^2 is the two-way transmittance. The first divisor is there
///    because only the front of an opaque cell is visible, the second because the opacity in an image saturates. In
///    thin media this equals deviation. Emission has one-way transmittance: 1.2 T s e, divided by the mean depth of the
///    strongest component, or of the luminance.
enum class Criterion { deviation = 0, range_mean = 1, transmittance = 2 };
/// Density in a cell: its linear fit, or its mean. Trilinear: the linear fit, and in sixths of cells of eight voxels
/// the interpolated field itself; without interpolation between voxels as linear.
enum class CellKind { linear, constant, trilinear };
constexpr bool has_fits(CellKind cells) { return cells != CellKind::constant; }
/// Whether the finest cells have the interpolated field itself (TetGrid::corners).
constexpr bool has_corners(CellKind cells, Interpolation interpolation) {
  return cells == CellKind::trilinear && interpolation == Interpolation::linear;
}

/// A pinhole camera for adaptive refinement, in world space.
struct RefineCamera {
  glm::dvec3 eye{0.0};
  glm::dvec3 forward{0.0, 0.0, -1.0};  ///< unit vectors: forward, right and up
  glm::dvec3 right{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double tan_half_x = 0.5;
  double tan_half_y = 0.5;
  double pixels_per_radian = 1000.0;  ///< image height / (2 tan_half_y)
  /// Instance transforms (affine) from the volume's world space to the camera's. The grid is refined for the instance
  /// that needs the finest cells.
  std::vector<glm::dmat4> transforms{glm::dmat4(1.0)};
  bool operator==(const RefineCamera&) const = default;
};

/// Returns the reduced extinction of a grid value, by similarity theory: forward scattering does not count. anisotropy:
/// mean cosine of the phase function.
inline double hiding(double density_scale, double anisotropy) {
  return density_scale * (1.0 - std::max(anisotropy, 0.0));
}

struct RefineSettings {
  Criterion criterion = Criterion::deviation;
  CellKind cells = CellKind::linear;
  double threshold = 0.02;  ///< negative: split every cell that is not uniform, down to the voxel
  // Medium; used by Criterion::transmittance.
  double density_scale = 1.0;
  double anisotropy = 0.0;
  std::uint64_t max_cells = 5'400'000;
  std::optional<RefineCamera> camera;  ///< if set: no split outside its frustum or below pixel_size (ViewLevels)
  double pixel_size = 1.0;             ///< pixels that the longest edge of a splitting level must cover
  bool operator==(const RefineSettings&) const = default;
};

}  // namespace cumulet::grid
