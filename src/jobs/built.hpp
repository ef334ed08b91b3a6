#pragma once

#include <cstdint>

#include "assets/volume_asset.hpp"
#include "grid/refine.hpp"
#include "scene/channels.hpp"
#include "scene/march_source.hpp"
#include "volume/ramp.hpp"

namespace cumulet::viewer {

/// Device that builds tetrahedral grids.
enum class BuildOn { cpu = 0, gpu = 1 };

/// Inputs of a grid build (acceleration structure).
struct BuildSettings {
  scene::March march = scene::March::tet;
  BuildOn on = BuildOn::cpu;
  grid::Interpolation interpolation = grid::Interpolation::nearest;
  grid::RefineSettings refine;
  volume::Ramp density_ramp;
  volume::ColorRamp density_colors;
  scene::Emission emission;
  bool anisotropic = true;       ///< the volume's anisotropy grid replaces the medium's anisotropy
  double shutter_seconds = 0.0;  ///< for volumes with velocities
  bool operator==(const BuildSettings&) const = default;
};

/// Returns true if a grid built with `made` can be used for `wanted`. Opacities may differ by a factor of 2.
[[nodiscard]] bool suits(const BuildSettings& made, const BuildSettings& wanted);

struct BuildSeconds {
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
};

/// A built grid or voxel source in main memory, usable by any GL context.
struct Built {
  VolumeAssetPtr volume;
  scene::MarchSourcePtr source;
  BuildSettings settings;
  std::uint64_t active_voxels = 0;
  bool moves = false;  ///< changes while a shutter is open
  // For a grid built on the GPU: known once it has been built.
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t cell_limit = 0;  ///< limit that applied to a tetrahedral grid
  BuildSeconds seconds;

  /// Main memory in bytes, including data shared with others.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Returns true if it can be used for these settings of the same volume. A volume that does not move is the same for
  /// any shutter.
  [[nodiscard]] bool serves(const BuildSettings& wanted) const;
};

}  // namespace cumulet::viewer
