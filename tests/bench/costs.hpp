#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// Measures the cost and the noise of channels and kinds of light on one volume. Prints Markdown tables with ratios to
/// their first rows.
void measure_costs(headless::Context& context, const Input& input, const Options& options);

/// Measures the time per grid type until a fire's image reaches the same error, including grid error and noise. Prints
/// a Markdown table. The tetrahedral grids use Options::thresholds.
void measure_equal_error(headless::Context& context, const Input& input, const Options& options);

}  // namespace cumulet::bench
