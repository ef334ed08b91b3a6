#pragma once

#include <headless.hpp>
#include <string>

#include "asset.hpp"

namespace cumulet::bench {

/// How far the pictures of grids by default are from the voxels', and how much faster: rows of a table, in Markdown.
std::string measure_defaults(headless::Context& context, const Asset& asset, const Options& options);

/// The head of that table.
std::string defaults_head();

}  // namespace cumulet::bench
