#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// Measures time and error of images at Options::targets of noise, with adaptive sampling relative to without. Prints a
/// Markdown table of the scenes.
void measure_adaptive(headless::Context& context, const Options& options);

/// Measures whether images of Options::reference_samples keep their means with each technique disabled by an edited
/// shader. Prints a Markdown table of the scenes.
void measure_techniques(headless::Context& context, const Options& options);

}  // namespace cumulet::bench
