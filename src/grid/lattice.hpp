#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/progress.hpp"
#include "grid/lattice_channel.hpp"
#include "grid/priorities.hpp"
#include "grid/refine.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

/// Entry for a lattice point p of scale m >= 1. It describes the cube of 8^m voxels with its low corner at p and the
/// octree cube with its center at p. Layout: glsl/grid/lattice.glsl; reader: glsl/grid/lattice_lookup.glsl.
struct LatticeEntry {
  std::uint32_t block = 0;   ///< index of the block of the next finer scale in this cube; 0: none
  std::uint32_t brick = 0;   ///< index of the brick with the cube's values, if the cube is a brick or has no finer
                             ///< block
  std::uint32_t coarse = 0;  ///< index of the coarse cells of the octree cube centered here; 0: that cube is uniform or
                             ///< does not exist
};

/// Density data of the records of a cube's cells above bricks, indexed by cm_coarse_cell().
struct CoarseCells {
  std::array<glm::uvec2, CM_COARSE_CELLS> coefficients{};  ///< as in CellRecord::data
  std::array<std::uint32_t, 2> dense{};                    ///< one bit per cell: the cell has density
};
static_assert(sizeof(CoarseCells) == 4 * CM_COARSE_WORDS);

/// Source data of a channel's cell records, as Lattice has it for density. Reader: glsl/grid/grid_channels.comp.
struct LatticeChannel {
  Channel channel = Channel::emission;
  std::size_t numbers = 0;            ///< values per voxel
  std::size_t brick_voxels = 0;       ///< as Lattice::brick_voxels()
  std::vector<LatticeEntry> entries;  ///< as Lattice::entries, with this channel's bricks and coarse cells
  /// Per octree cube above bricks: the records of its cells, indexed by cm_coarse_cell(). For emission one bit per cell
  /// follows, set if the cell emits. The first cube is an empty placeholder.
  std::vector<std::uint32_t> coarse;
  std::vector<ChannelNumbers> even_bricks;  ///< voxel values of each uniform brick; the first is 0
  std::vector<glm::ivec3> bricks;           ///< corners of the non-uniform bricks, numbered after even_bricks
  float fastest = 0.0F;                     ///< for velocity: maximum, in voxels per second

  [[nodiscard]] std::uint64_t bytes() const {
    return entries.size() * sizeof(LatticeEntry) + coarse.size() * 4 + even_bricks.size() * sizeof(ChannelNumbers) +
           bricks.size() * sizeof(glm::ivec3);
  }
};

/// Packed data from which the grid for any view and any cell budget is built: the priorities of splits, the lattice
/// blocks that any of them can raise, and the source of cell values. It is built once per volume and medium. A view
/// adds one byte per node (OwnPriorities::levels).
struct Lattice {
  /// settings: all except the camera and the cell budget are used. Runs in parallel. progress: as for Statistics.
  Lattice(const Statistics& statistics, const Channels& beside, const RefineSettings& settings, float max_value,
          Progress* progress = nullptr);

  Cube cube;
  OwnPriorities own;
  /// Sorted by scale, coarsest first. Block 0 is an empty placeholder, block 1 the root from which lookups start.
  std::vector<glm::uvec2> blocks;
  /// Blocks of scale s are [first[s], first[s - 1]); those of scale 0 extend to the end.
  std::array<std::uint32_t, Cube::max_log2_size / 3 + 1> first{};
  /// CM_BLOCK_POINTS entries for the placeholder and for each block of scale 1 or coarser.
  std::vector<LatticeEntry> entries;
  std::vector<CoarseCells> coarse;  ///< the first is an empty placeholder
  /// Values of uniform bricks; the first is 0. Higher brick numbers are bricks of the statistics, in the order of
  /// nodes_of_size(3).
  std::vector<float> even_bricks;
  std::size_t bricks = 0;     ///< number of bricks, uniform ones included
  bool halves = false;        ///< all brick values are exactly representable as half floats
  float density_unit = 1.0F;  ///< grid value of a record's density 1
  CellKind cells = CellKind::linear;
  std::vector<LatticeChannel> channels;  ///< one for each channel that the volume has

  /// Number of voxels in GPU memory for each brick: its own, or with interpolation those at its lattice points.
  [[nodiscard]] std::size_t brick_voxels() const {
    return cube.interpolation == Interpolation::linear ? BrickCorners().size() : volume::brick_voxels;
  }
  /// Whether its grids have TetGrid::corners.
  [[nodiscard]] bool has_corners() const { return grid::has_corners(cells, cube.interpolation); }
  [[nodiscard]] std::uint32_t top_scale() const { return static_cast<std::uint32_t>(cube.log2_size) / 3; }
  /// Main memory in bytes, without the volume's.
  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t beside = 0;
    for (const LatticeChannel& channel : channels) beside += channel.bytes();
    return beside + own.bytes() + blocks.size() * sizeof(glm::uvec2) + entries.size() * sizeof(LatticeEntry) +
           coarse.size() * sizeof(CoarseCells) + even_bricks.size() * 4;
  }
  /// GPU buffer memory in bytes, with brick values and space for priorities.
  [[nodiscard]] std::uint64_t device_bytes() const;

 private:
  void find_blocks(const Statistics& statistics, const std::vector<ChannelFields>& beside, Progress* progress);
  void fill_entries(const Statistics& statistics, const Progress* progress);
  void fill_coarse(const Statistics& statistics, const Progress* progress);
  [[nodiscard]] LatticeChannel make_channel(const ChannelFields& fields, const Progress* progress) const;
  void fill_bricks(const ChannelFields& fields, LatticeChannel& made, const Progress* progress) const;
  // Calls visit(index, corner, scale) for each entry of `entries` within the cube.
  template <class Visit>
  void for_each_entry(const Progress* progress, Visit&& visit) const;
  // Returns the index in `entries` for the point at the center of this octree cube.
  [[nodiscard]] std::size_t entry_about(const glm::ivec3& corner, int log2_size) const;
  // Returns the index of the block with this corner and scale; 0: none.
  [[nodiscard]] std::uint32_t block_at(const glm::ivec3& corner, std::uint32_t scale) const;
};
using LatticePtr = std::shared_ptr<const Lattice>;

/// The part of a cell that lies in one voxel, for cells within a brick, in the cell's frame. With interpolation: the
/// share of the voxel at a lattice point. Readers: glsl/grid/grid_records.comp, glsl/grid/grid_channels.comp.
struct CellPart {
  glm::vec3 from_centroid;  ///< from the cell's centroid to this part's centroid, in the cell's units
  std::uint32_t packed;     ///< x | y << 4 | z << 8 | weight << 12; x, y, z: the voxel's low corner, or the lattice
                            ///< point, relative to v0
};
static_assert(sizeof(CellPart) == 16);
/// Parts of the ten cell shapes within bricks, by level: 0 is a brick's Kuhn tetrahedron, 9 a sixth of a voxel. Parts
/// of a level are [first[level], first[level + 1]).
struct CellParts {
  std::array<CellPart, CM_CELL_PARTS_BETWEEN> parts{};
  std::array<unsigned, brick_levels + 2> first{};
  unsigned sixth = 1;  ///< sum of the weights in a sixth of a voxel
  [[nodiscard]] unsigned size() const { return first.back(); }
};
const CellParts& cell_parts(Interpolation interpolation);

}  // namespace cumulet::grid
