#pragma once

#include <headless.hpp>

#include "asset.hpp"
#include "bvh_times.hpp"
#include "results.hpp"

namespace cumulet::bench {

/// Prints a line on standard error with the time since the start.
void progress(const std::string& line);

/// Measures everything about one asset.
AssetResult measure(headless::Context& context, const Asset& asset, const Options& options);

/// Measures and prints only the cost of surfaces, on a linear grid of Options::surfaces_threshold.
void measure_surfaces_alone(headless::Context& context, const Asset& asset, const Options& options);

/// Measures the BVH of each mesh.
std::vector<TreeTimes> measure_trees(const Options& options);

}  // namespace cumulet::bench
