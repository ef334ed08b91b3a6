#pragma once

// Memory that grids take on the GPU.

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include "grid/cell.hpp"

namespace cumulet::grid {

/// A cell of the tree during a build on the GPU. Layout as in glsl/grid/grid_leaves.glsl.
struct TreeCell {
  std::uint32_t child;
  std::uint32_t rank;
  glm::uvec2 where;
};
static_assert(sizeof(TreeCell) == 16);

/// Includes the cell's links, the counts below it, and its list entry.
inline constexpr std::uint64_t tree_cell_bytes =
    sizeof(TreeCell) + sizeof(glm::uvec4) + sizeof(glm::uvec2) + sizeof(std::uint32_t);

/// Rows of occupancy. Layout as in glsl/grid/grid_clear.comp: they are followed by rows per cone, and the cones of each
/// cube.
inline constexpr std::uint64_t clear_full_bytes = std::uint64_t{2} * CM_CLEAR_ROWS * sizeof(glm::uvec2);
inline constexpr std::uint64_t clear_bytes = clear_full_bytes +
                                             std::uint64_t{CM_CLEAR_CONES} * CM_CLEAR_ROWS * sizeof(glm::uvec2) +
                                             std::uint64_t{CM_CLEAR_CUBES} * sizeof(std::uint32_t);

/// Words per entry of the list of emissive cells. Layout as in glsl/grid/grid_emissive.comp: cell number, position,
/// emission.
inline constexpr std::size_t glowing_words = 7;

/// Returns the GPU memory per cell of a build in progress, in addition to its result.
[[nodiscard]] std::uint64_t building_bytes_per_cell(bool emits);
/// Returns the minimum GPU memory of a build in progress, however few cells it has.
[[nodiscard]] std::uint64_t building_bytes_at_least();

}  // namespace cumulet::grid
