#pragma once

#include <headless.hpp>

#include "asset.hpp"

namespace cumulet::bench {

/// What marches take to equal variance, those through NanoVDB grids among them: a table on standard output.
void measure_peers(headless::Context& context, const Asset& asset, const Options& options);

}  // namespace cumulet::bench
