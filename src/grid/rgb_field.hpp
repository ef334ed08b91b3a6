#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "grid/statistics.hpp"

namespace cumulet::grid {

/// A field of colours, as the grid needs it: statistics of each component over the density's cube.
class RgbField {
 public:
  using Components = std::array<volume::ScalarVolume, 3>;

  /// components: red, green and blue, on the lattice that the cube is of, all with the same bounds. progress: as for
  /// Statistics.
  RgbField(Components components, const Cube& cube, Progress* progress = nullptr);
  RgbField(const RgbField&) = delete;
  RgbField& operator=(const RgbField&) = delete;

  [[nodiscard]] const Statistics& component(std::size_t i) const { return *statistics_[i]; }
  /// Of each component the integral along the mean ray that meets any, along an axis.
  [[nodiscard]] glm::dvec3 mean_depth() const;
  [[nodiscard]] float max_value() const;
  /// Of what is not black: voxels, inclusive.
  [[nodiscard]] const glm::ivec3& bounds_min() const { return components_[0].bounds_min; }
  [[nodiscard]] const glm::ivec3& bounds_max() const { return components_[0].bounds_max; }
  /// Whether the brick at this corner (cube space) is black.
  [[nodiscard]] bool is_zero(const glm::ivec3& corner) const;
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < 3; ++i) bytes += components_[i].bytes() + statistics_[i]->bytes();
    return bytes;
  }

 private:
  Components components_;  // the statistics point into it
  std::array<std::unique_ptr<const Statistics>, 3> statistics_;
};

/// A field of numbers, likewise.
class ScalarField {
 public:
  ScalarField(volume::ScalarVolume values, const Cube& cube, Progress* progress = nullptr)
      : values_(std::move(values)), statistics_(values_, cube, progress) {}
  ScalarField(const ScalarField&) = delete;
  ScalarField& operator=(const ScalarField&) = delete;

  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const { return values_.bytes() + statistics_.bytes(); }

 private:
  volume::ScalarVolume values_;  // the statistics point into it
  Statistics statistics_;
};

/// How what scatters moves, of which with the density a mean velocity is had.
class MomentumField {
 public:
  /// Of each axis of the cube density x (velocity / fastest + 1) / 2, so that none is negative.
  struct Values {
    RgbField::Components components;
    float fastest;  ///< voxels a second: no velocity is more along an axis
  };

  MomentumField(Values values, const Cube& cube, Progress* progress = nullptr)
      : components_(std::move(values.components), cube, progress), fastest_(values.fastest) {}

  [[nodiscard]] const Statistics& component(std::size_t i) const { return components_.component(i); }
  [[nodiscard]] float fastest() const { return fastest_; }
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const { return components_.bytes(); }

 private:
  RgbField components_;
  float fastest_;
};

/// Density as the shutter opens, and as it closes.
struct DensityEnds {
  DensityEnds(volume::ScalarVolume at_open, volume::ScalarVolume at_close, const Cube& cube,
              Progress* progress = nullptr)
      : open(std::move(at_open), cube, progress), close(std::move(at_close), cube, progress) {}

  ScalarField open;
  ScalarField close;

  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const { return open.bytes() + close.bytes(); }
};

/// What cells carry beside density; null: nothing.
struct Channels {
  /// Light that the volume gives off by itself: radiance a world unit of length, linear Rec. 709. It needs no density.
  std::shared_ptr<const RgbField> emission;
  /// Density x colour: the mean of products is not the product of means.
  std::shared_ptr<const RgbField> scattering;
  /// What scatters (luminance of density x colour) x (1 + anisotropy) / 2: the part of it that goes forward.
  std::shared_ptr<const ScalarField> forward;
  /// Light knows nothing of it: no cell is split for it.
  std::shared_ptr<const MomentumField> momentum;
  /// Of which the density that goes with these is the mean: cells are split for both in its place.
  std::shared_ptr<const DensityEnds> ends = nullptr;

  bool operator==(const Channels&) const = default;
  /// Main memory.
  [[nodiscard]] std::uint64_t bytes() const {
    return (emission ? emission->bytes() : 0) + (scattering ? scattering->bytes() : 0) +
           (forward ? forward->bytes() : 0) + (momentum ? momentum->bytes() : 0) + (ends ? ends->bytes() : 0);
  }
};

}  // namespace cumulet::grid
