#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <string>

#include "gl/objects.hpp"
#include "grid/channel_table.hpp"
#include "grid/tet_grid.hpp"
#include "scene/emissive_cells.hpp"
#include "scene/march_source.hpp"

namespace cumulet::render {

/// A grid that was built on the GPU. Equal to a grid::TetGrid bit for bit, except for rounding of coefficients and
/// channels.
struct BuiltGrid {
  gl::Object cells;  ///< grid::CellRecord each
  gl::Object tree;   ///< 26 grid::RootEntry, of which the last is padding, then TetGrid::tree
  /// Records as in TetGrid, indexed by grid::Channel; null: there is no such channel.
  std::array<gl::Object, grid::channel_table.size()> channels;
  gl::Object corners;             ///< TetGrid::corners, undefined for larger cells; null: none
  scene::EmissiveTable emissive;  ///< in main memory
  /// Set instead of the buffers if the GPU could not build it; why_not then gives the reason.
  std::shared_ptr<const grid::TetGrid> grid;
  std::string why_not;
  std::uint32_t count = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  glm::vec3 content_min{0.0F};
  glm::vec3 content_max{0.0F};

  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const;
};
/// Grids that were built for the GPU, by source.
using BuiltGrids = std::map<scene::MarchSourcePtr, BuiltGrid>;

}  // namespace cumulet::render
