#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "grid/statistics.hpp"

namespace cumulet::grid {

/// An RGB field with statistics of each component over the density's control cube.
class RgbField {
 public:
  using Components = std::array<volume::ScalarVolume, 3>;

  /// components: red, green and blue, on the cube's lattice, all with the same bounds. progress: as for Statistics.
  RgbField(Components components, const Cube& cube, Progress* progress = nullptr);
  RgbField(const RgbField&) = delete;
  RgbField& operator=(const RgbField&) = delete;

  [[nodiscard]] const Statistics& component(std::size_t i) const { return *statistics_[i]; }
  /// Integral of each component along a ray: the mean over the axis-parallel rays that hit any of it.
  [[nodiscard]] glm::dvec3 mean_depth() const;
  [[nodiscard]] float max_value() const;
  /// Inclusive voxel bounds of everything that is not black.
  [[nodiscard]] const glm::ivec3& bounds_min() const { return components_[0].bounds_min; }
  [[nodiscard]] const glm::ivec3& bounds_max() const { return components_[0].bounds_max; }
  /// Returns true if the brick at this corner (cube space) is black.
  [[nodiscard]] bool is_zero(const glm::ivec3& corner) const;
  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < 3; ++i) bytes += components_[i].bytes() + statistics_[i]->bytes();
    return bytes;
  }

 private:
  Components components_;  // statistics_ points into it
  std::array<std::unique_ptr<const Statistics>, 3> statistics_;
};

/// A scalar field with its statistics.
class ScalarField {
 public:
  ScalarField(volume::ScalarVolume values, const Cube& cube, Progress* progress = nullptr)
      : values_(std::move(values)), statistics_(values_, cube, progress) {}
  ScalarField(const ScalarField&) = delete;
  ScalarField& operator=(const ScalarField&) = delete;

  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const { return values_.bytes() + statistics_.bytes(); }

 private:
  volume::ScalarVolume values_;  // statistics_ points into it
  Statistics statistics_;
};

/// Density-weighted velocity. Its sum divided by the density's gives a cell's mean velocity.
class MomentumField {
 public:
  /// For each axis of the cube: density x (velocity / fastest + 1) / 2, which is never negative.
  struct Values {
    RgbField::Components components;
    float fastest;  ///< maximum velocity component along any axis, in voxels per second
  };

  MomentumField(Values values, const Cube& cube, Progress* progress = nullptr)
      : components_(std::move(values.components), cube, progress), fastest_(values.fastest) {}

  [[nodiscard]] const Statistics& component(std::size_t i) const { return components_.component(i); }
  [[nodiscard]] float fastest() const { return fastest_; }
  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const { return components_.bytes(); }

 private:
  RgbField components_;
  float fastest_;
};

/// Density at shutter open and at shutter close.
struct DensityEnds {
  DensityEnds(volume::ScalarVolume at_open, volume::ScalarVolume at_close, const Cube& cube,
              Progress* progress = nullptr)
      : open(std::move(at_open), cube, progress), close(std::move(at_close), cube, progress) {}

  ScalarField open;
  ScalarField close;

  /// Main memory in bytes.
  [[nodiscard]] std::uint64_t bytes() const { return open.bytes() + close.bytes(); }
};

}  // namespace cumulet::grid
