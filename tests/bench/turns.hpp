#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "subject.hpp"

namespace cumulet::bench {

/// Cost of the runs of one scene, which alternated with other scenes.
struct Cost {
  std::vector<double> step;    ///< seconds
  std::vector<double> sample;  ///< seconds
  double steps = 0.0;          ///< per path
  double variance = 0.0;       ///< of one sample, relative to the squared mean, without the noisiest pixels
  std::array<std::vector<double>, 2> halves;  ///< luminance of even and of odd runs
};

/// Indices of the pixels that show the medium.
std::vector<std::size_t> pixels_of(const std::vector<Run>& runs);

double mean_of(const std::vector<double>& values);

/// samples: per pixel, of each run.
Cost cost_of(const std::vector<Run>& runs, const std::vector<std::size_t>& pixels, std::uint32_t samples);

}  // namespace cumulet::bench
