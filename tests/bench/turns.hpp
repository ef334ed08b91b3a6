#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "subject.hpp"

namespace cumulet::bench {

/// Of the runs of one scene, which took turns with others'.
struct Cost {
  std::vector<double> step;                   ///< seconds
  std::vector<double> sample;                 ///< seconds
  double steps = 0.0;                         ///< a path
  double variance = 0.0;                      ///< of one sample, over the mean's square, without the noisiest pixels
  std::array<std::vector<double>, 2> halves;  ///< luminance of even runs and of odd ones
};

/// The pixels that show the medium.
std::vector<std::size_t> pixels_of(const std::vector<Run>& runs);

double mean_of(const std::vector<double>& values);

/// samples: a pixel, of each run.
Cost cost_of(const std::vector<Run>& runs, const std::vector<std::size_t>& pixels, std::uint32_t samples);

}  // namespace cumulet::bench
