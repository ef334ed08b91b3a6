#pragma once

#include <headless.hpp>
#include <string>

#include "asset.hpp"

namespace cumulet::bench {

/// Measures the image error of default grids relative to voxels, and their speedup. Returns Markdown table rows.
std::string measure_defaults(headless::Context& context, const Asset& asset, const Options& options);

/// The header of that table.
std::string defaults_head();

}  // namespace cumulet::bench
