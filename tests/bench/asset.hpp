#pragma once

#include "options.hpp"
#include "viewer/volume_asset.hpp"

namespace cumulet::bench {

struct Asset {
  std::string name;
  viewer::VolumeAssetPtr volume;
  double mean_optical_depth = 0.0;  ///< at density scale 1
  double load_seconds = 0.0;        ///< 0 for a synthetic one

  /// Of a mean optical depth; 1 for fire alone, which has no density.
  [[nodiscard]] double density_scale(double optical_depth) const {
    return mean_optical_depth > 0.0 ? optical_depth / mean_optical_depth : 1.0;
  }
};

/// Reads or makes it; all_fields: not density alone, and by default what makes a volume of a file. Throws Error.
Asset load_asset(const Input& input, bool all_fields = false);

}  // namespace cumulet::bench
