#pragma once

#include <cstdint>
#include <optional>

#include "grid/lattice.hpp"
#include "scene/channels.hpp"
#include "scene/march_source.hpp"
#include "viewer/allowance.hpp"
#include "viewer/builder.hpp"

namespace cumulet::viewer {

/// Of any grid: those of the cube.
inline constexpr std::uint64_t fewest_cells = 24;

/// What cells carry beside density.
struct Carried {
  bool emission = false;
  bool colour = false;
  bool anisotropy = false;
  bool velocity = false;
  bool change = false;

  static Carried of(const grid::Channels& channels);
  /// Of tetrahedra.
  static Carried of(const scene::MarchSource& source);
};

/// How many cells a grid may have that the CPU builds: of max_cells what has room in GL memory, and in main memory
/// beside so many bytes.
[[nodiscard]] std::uint64_t cells_that_fit(std::uint64_t max_cells, const Carried& carried, std::uint64_t held,
                                           const Allowance& allowance);
/// One that GL builds of that lattice. Nothing: the lattice leaves so little that the CPU's would be far finer.
[[nodiscard]] std::optional<std::uint64_t> planned_cells_that_fit(std::uint64_t max_cells, const Carried& carried,
                                                                  const grid::Lattice& lattice, std::uint64_t held,
                                                                  const Allowance& allowance);
/// Whether one of tetrahedra has as many cells as it may have. Else it would be another, built anew.
[[nodiscard]] bool has_cells_allowed(const Built& built, const Allowance& allowance);

}  // namespace cumulet::viewer
