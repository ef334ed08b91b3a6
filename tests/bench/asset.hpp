#pragma once

#include "options.hpp"
#include "viewer/volume_asset.hpp"

namespace cumulet::bench {

struct Asset {
  std::string name;
  viewer::VolumeAssetPtr volume;
  double mean_optical_depth = 0.0;  ///< at density scale 1
  double load_seconds = 0.0;        ///< 0 for a synthetic one
};

/// Reads or makes it. Throws Error.
Asset load_asset(const Input& input);

}  // namespace cumulet::bench
