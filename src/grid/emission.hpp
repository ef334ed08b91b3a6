#pragma once

#include <array>
#include <memory>

#include "grid/statistics.hpp"

namespace cumulet::grid {

/// Light that a volume gives off by itself, as the grid needs it: statistics of each component of linear Rec. 709 over
/// the density's cube. Radiance a world unit of length; it needs no density.
class Emission {
 public:
  using Radiance = std::array<volume::ScalarVolume, 3>;

  /// radiance: on the lattice that the cube is of, all with the same bounds. progress: as for Statistics.
  Emission(Radiance radiance, const Cube& cube, Progress* progress = nullptr);
  Emission(const Emission&) = delete;
  Emission& operator=(const Emission&) = delete;

  [[nodiscard]] const Statistics& component(std::size_t i) const { return *statistics_[i]; }
  /// Radiance of the mean ray along an axis that meets any, in its strongest component.
  [[nodiscard]] double mean_radiance() const;
  [[nodiscard]] float max_radiance() const;
  /// Of what gives off light: voxels, inclusive.
  [[nodiscard]] const glm::ivec3& bounds_min() const { return radiance_[0].bounds_min; }
  [[nodiscard]] const glm::ivec3& bounds_max() const { return radiance_[0].bounds_max; }
  /// Whether the brick at this corner (cube space) gives off nothing.
  [[nodiscard]] bool is_zero(const glm::ivec3& corner) const;

 private:
  Radiance radiance_;  // the statistics point into it
  std::array<std::unique_ptr<const Statistics>, 3> statistics_;
};

}  // namespace cumulet::grid
