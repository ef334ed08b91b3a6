#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "grid/channel_table.hpp"
#include "grid/lattice.hpp"
#include "jobs/built.hpp"
#include "jobs/resource_limits.hpp"
#include "scene/channels.hpp"
#include "scene/march_source.hpp"

namespace cumulet::viewer {

/// Minimum number of cells of any grid: the roots of the cube.
inline constexpr std::uint64_t fewest_cells = 24;

/// Channels that cells store beside density.
struct Carried {
  std::array<bool, grid::channel_table.size()> channels{};
  bool change = false;
  bool corners = false;  ///< grid::TetGrid::corners

  static Carried of(const grid::Channels& channels, bool corners);
  /// For a tetrahedral source.
  static Carried of(const scene::MarchSource& source);
};

/// Returns how many cells a CPU-built grid may have: at most max_cells, limited by GPU memory, and by main memory
/// beside `held` bytes.
[[nodiscard]] std::uint64_t cells_that_fit(std::uint64_t max_cells, const Carried& carried, std::uint64_t held,
                                           const ResourceLimits& resource_limits);
/// Returns how many cells a GPU-built grid of this lattice may have. Nullopt: the lattice leaves so little memory that
/// a CPU-built grid would be far finer.
[[nodiscard]] std::optional<std::uint64_t> planned_cells_that_fit(std::uint64_t max_cells, const Carried& carried,
                                                                  const grid::Lattice& lattice, std::uint64_t held,
                                                                  const ResourceLimits& resource_limits);
/// Returns true if a tetrahedral grid has as many cells as the limits allow; else rebuilding would give a different
/// grid.
[[nodiscard]] bool has_cells_allowed(const Built& built, const ResourceLimits& resource_limits);

}  // namespace cumulet::viewer
