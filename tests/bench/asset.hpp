#pragma once

#include "assets/volume_asset.hpp"
#include "options.hpp"

namespace cumulet::bench {

struct Asset {
  std::string name;
  viewer::VolumeAssetPtr volume;
  double mean_optical_depth = 0.0;  ///< at density scale 1
  double load_seconds = 0.0;        ///< 0 for a synthetic one

  /// The density scale for this mean optical depth; 1 for a fire without density.
  [[nodiscard]] double density_scale(double optical_depth) const {
    return mean_optical_depth > 0.0 ? optical_depth / mean_optical_depth : 1.0;
  }
};

/// Reads or generates the asset. all_fields: reads all fields that a volume has by default, not only density. Throws
/// Error.
Asset load_asset(const Input& input, bool all_fields = false);

}  // namespace cumulet::bench
