#pragma once

#include <headless.hpp>

#include "asset.hpp"
#include "bvh_times.hpp"
#include "results.hpp"

namespace cumulet::bench {

/// A line on standard error, with the time since the start.
void progress(const std::string& line);

/// Everything about one asset.
AssetResult measure(headless::Context& context, const Asset& asset, const Options& options);

/// What surfaces cost alone, on a linear grid of Options::surfaces_threshold: printed.
void measure_surfaces_alone(headless::Context& context, const Asset& asset, const Options& options);

/// The triangle tree over each of its meshes.
std::vector<TreeTimes> measure_trees(const Options& options);

}  // namespace cumulet::bench
