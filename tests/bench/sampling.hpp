#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// What pictures take to Options::targets of noise, and how far they are from the reference, with adaptive sampling
/// over without: a table in Markdown, of the judged scenes.
void measure_adaptive(headless::Context& context, const Options& options);

/// Whether pictures of Options::reference_samples have the same means with each technique off (by an edited shader): a
/// table in Markdown, of the judged scenes.
void measure_techniques(headless::Context& context, const Options& options);

}  // namespace cumulet::bench
