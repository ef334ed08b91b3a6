#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "grid/lattice.hpp"
#include "grid/statistics.hpp"
#include "grid/tet_grid.hpp"
#include "scene/glow.hpp"

namespace cumulet::scene {

enum class March { tet = 0, dense = 1, brick = 2 };

/// How a grid of tetrahedra is built in GL: the lattice of its splits, and what one view allows of it.
struct GridPlan {
  grid::LatticePtr lattice;
  std::vector<std::uint8_t> levels;  ///< grid::OwnPriorities::levels() of the view
  std::uint64_t max_cells = 0;
};
using GridPlanPtr = std::shared_ptr<const GridPlan>;

/// What one march needs of the volume, in main memory: all that a new context needs too.
struct MarchSource {
  March march = March::tet;
  grid::Cube cube;
  float max_value = 0.0F;      // value of density 1, in the unit
  double value_unit = 1.0;     // values of the volume's grid = this x values here (volume::value_unit)
  double optical_depth = 0.0;  // a unit of density scale, as grid::Statistics has the mean, of the grid's values

  // tet: the grid, or how GL builds it, then with the volume and its statistics
  std::shared_ptr<const grid::TetGrid> grid;
  GridPlanPtr plan;
  bool linear = false;
  GlowTable glow;  // of the grid; of a plan it is known once that is built
  // dense: read from these; brick: as packed by make_voxel_source
  std::shared_ptr<const volume::ScalarVolume> volume;
  std::shared_ptr<const grid::Statistics> statistics;
  glm::ivec3 box_low{0};  // voxels, cube space
  glm::ivec3 box_size{0};
  std::vector<std::uint16_t> brick_values;   // half floats, 512 a slot
  std::vector<std::uint16_t> brick_changes;  // likewise: half of how they do while the shutter is open, if any does
  std::vector<std::uint32_t> brick_slots;
  glm::ivec3 brick_count{0};
  grid::Channels channels;

  /// Whether both can be shown together.
  [[nodiscard]] bool goes_with(const MarchSource& other) const {
    return march == other.march && linear == other.linear;
  }
  [[nodiscard]] bool emits() const { return channels.emission || (grid && !grid->emission.empty()); }
  [[nodiscard]] bool coloured() const { return channels.scattering || (grid && !grid->colour.empty()); }
  [[nodiscard]] bool anisotropic() const { return channels.forward || (grid && !grid->anisotropy.empty()); }
  [[nodiscard]] bool moves() const { return channels.momentum || (grid && !grid->velocity.empty()); }
  /// Whether its density does while the shutter is open.
  [[nodiscard]] bool changes() const { return channels.ends || (grid && !grid->change.empty()); }
  /// Main memory that it holds, voxels among it that others may hold as well.
  [[nodiscard]] std::uint64_t bytes() const {
    return (grid ? grid->bytes() : 0) + (plan ? plan->lattice->bytes() + plan->levels.size() : 0) +
           glow.cells.size() * sizeof(GlowingCell) + (volume ? volume->bytes() : 0) +
           (statistics ? statistics->bytes() : 0) + (brick_values.size() + brick_changes.size()) * 2 +
           brick_slots.size() * 4 + channels.bytes();
  }
  /// From grid values to density 0 to 1.
  [[nodiscard]] float density_a_value() const { return max_value > 0.0F ? 1.0F / max_value : 1.0F; }
};
using MarchSourcePtr = std::shared_ptr<const MarchSource>;

/// Throws Error(cancelled).
MarchSource make_tet_source(std::shared_ptr<const grid::TetGrid> grid, bool linear, float max_value,
                            const Progress* progress = nullptr);
/// Of tetrahedra that GL builds. statistics: of the volume's density; of these and the channels the lattice is.
MarchSource make_planned_source(GridPlan plan, std::shared_ptr<const volume::ScalarVolume> volume,
                                std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels);
/// dense and brick. O(voxels of the bounds) only when uploaded; brick: O(bricks) memory.
MarchSource make_voxel_source(March march, std::shared_ptr<const volume::ScalarVolume> volume,
                              std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels = {});

}  // namespace cumulet::scene
