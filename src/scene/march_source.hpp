#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "grid/channel_table.hpp"
#include "grid/lattice.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"
#include "scene/emissive_cells.hpp"

namespace cumulet::scene {

enum class March { tet = 0, dense = 1, brick = 2 };

/// Inputs for building a tetrahedral grid on the GPU: the lattice of splits, and the levels that one view allows.
struct GridPlan {
  grid::LatticePtr lattice;
  std::vector<std::uint8_t> levels;  ///< grid::OwnPriorities::levels() for the view
  std::uint64_t max_cells = 0;
};
using GridPlanPtr = std::shared_ptr<const GridPlan>;

/// Data of a volume for one grid type (tetrahedra, dense voxels or bricks), in main memory: everything a new context
/// needs.
struct MarchSource {
  March march = March::tet;
  grid::Cube cube;
  float max_value = 0.0F;      // grid value that maps to density 1, in the volume's unit
  double value_unit = 1.0;     // file grid value = value_unit * value here (volume::value_unit)
  double optical_depth = 0.0;  // mean (grid::Statistics) per unit of density scale, for the file's grid values

  // tet: the grid, or the plan to build it in GL; a plan also needs the volume and its statistics
  std::shared_ptr<const grid::TetGrid> grid;
  GridPlanPtr plan;
  bool linear = false;     // tet: density is linear in a cell; dense, brick: interpolated between voxels
  bool trilinear = false;  // tet: in sixths of cells it is interpolated between voxels (grid::TetGrid::corners)
  EmissiveTable emissive;  // of the grid; if GL builds the grid, it is known only after the build
  // dense: GL reads from these; brick: packed by make_voxel_source
  std::shared_ptr<const volume::ScalarVolume> volume;
  std::shared_ptr<const grid::Statistics> statistics;
  glm::ivec3 box_low{0};  // cells, cube space: voxels, or with interpolation the cubes between eight of them
  glm::ivec3 box_size{0};
  std::vector<std::uint16_t> brick_values;   // half floats, brick_side()^3 per slot
  std::vector<std::uint16_t> brick_changes;  // the same: half the change while the shutter is open; else empty
  std::vector<std::uint32_t> brick_slots;
  glm::ivec3 brick_count{0};
  grid::Channels channels;

  /// Whether both can be rendered in one scene.
  [[nodiscard]] bool goes_with(const MarchSource& other) const {
    return march == other.march && linear == other.linear && trilinear == other.trilinear;
  }
  /// dense: number of voxels that the cells of the box use, along each axis.
  [[nodiscard]] glm::ivec3 voxel_count() const { return box_size + (linear ? 1 : 0); }
  /// brick: number of voxels that the cells of a brick use, along each axis.
  [[nodiscard]] int brick_side() const { return linear ? grid::brick_corners : volume::brick_size; }
  [[nodiscard]] bool has(grid::Channel channel) const {
    const grid::ChannelRow& row = grid::row_of(channel);
    return row.is_in(channels) || (grid && !row.records(grid->channels).empty());
  }
  [[nodiscard]] bool emits() const { return has(grid::Channel::emission); }
  [[nodiscard]] bool colored() const { return has(grid::Channel::color); }
  [[nodiscard]] bool anisotropic() const { return has(grid::Channel::anisotropy); }
  [[nodiscard]] bool moves() const { return has(grid::Channel::velocity); }
  /// Whether the density changes while the shutter is open.
  [[nodiscard]] bool changes() const { return channels.ends || (grid && !grid->change.empty()); }
  /// Main memory in use, including voxels that may be shared with other owners.
  [[nodiscard]] std::uint64_t bytes() const {
    return (grid ? grid->bytes() : 0) + (plan ? plan->lattice->bytes() + plan->levels.size() : 0) +
           emissive.cells.size() * sizeof(GlowingCell) + (volume ? volume->bytes() : 0) +
           (statistics ? statistics->bytes() : 0) + (brick_values.size() + brick_changes.size()) * 2 +
           brick_slots.size() * 4 + channels.bytes();
  }
  /// Factor from grid values to densities in [0, 1].
  [[nodiscard]] float density_a_value() const { return max_value > 0.0F ? 1.0F / max_value : 1.0F; }
};
using MarchSourcePtr = std::shared_ptr<const MarchSource>;

/// Throws Error(cancelled).
MarchSource make_tet_source(std::shared_ptr<const grid::TetGrid> grid, bool linear, float max_value,
                            const Progress* progress = nullptr);
/// For tetrahedra that GL builds. statistics: of the volume's density. The lattice of the plan was made from these and
/// the channels.
MarchSource make_planned_source(GridPlan plan, std::shared_ptr<const volume::ScalarVolume> volume,
                                std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels);
/// For dense and brick. dense: O(voxels of the bounds) only when uploaded; brick: O(bricks) memory.
MarchSource make_voxel_source(March march, std::shared_ptr<const volume::ScalarVolume> volume,
                              std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels = {});

}  // namespace cumulet::scene
