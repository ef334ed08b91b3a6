#pragma once

#include <headless.hpp>

#include "asset.hpp"

namespace cumulet::bench {

/// Measures the time of grid types, including NanoVDB grids, to equal variance. Prints a table on standard output.
void measure_peers(headless::Context& context, const Asset& asset, const Options& options);

}  // namespace cumulet::bench
