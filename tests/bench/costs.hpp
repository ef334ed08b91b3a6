#pragma once

#include <headless.hpp>

#include "options.hpp"

namespace cumulet::bench {

/// What channels and kinds of light cost on one volume and how noisy they are: tables in Markdown, as ratios to their
/// first rows.
void measure_costs(headless::Context& context, const Input& input, const Options& options);

/// What each march takes until a fire's picture has the same error, of its grid and its noise together: a table in
/// Markdown. The tetrahedra's grids are Options::thresholds.
void measure_equal_error(headless::Context& context, const Input& input, const Options& options);

}  // namespace cumulet::bench
