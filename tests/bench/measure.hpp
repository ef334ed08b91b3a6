#pragma once

#include <headless.hpp>

#include "asset.hpp"
#include "results.hpp"

namespace cumulet::bench {

/// A line on standard error, with the time since the start.
void progress(const std::string& line);

/// Everything about one asset.
AssetResult measure(headless::Context& context, const Asset& asset, const Options& options);

}  // namespace cumulet::bench
