#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// Measures the quality of images with few samples, noisy and denoised, the sample count at which noisy images are as
/// good, flicker, and the time per pass. Prints Markdown tables, and writes plots and images into Options::out.
void measure_denoise(headless::Context& context, const Options& options);

/// Measures the difference of displayed images to the converged image as a function of the time since a change. Prints
/// Markdown tables, and writes plots and images into Options::out.
void measure_settle(headless::Context& context, const Options& options);

}  // namespace cumulet::bench
