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

/// What stands at a point of the lattice of a scale m, 1 and up: of the cube of 8^m voxels from there on, and about it.
/// glsl/lattice.glsl; glsl/grid_places.glsl reads it.
struct LatticePlace {
  std::uint32_t block = 0;   ///< the block of the next finer scale there; 0: none
  std::uint32_t brick = 0;   ///< whose values the cube has, if there is no such block, or it is a brick
  std::uint32_t coarse = 0;  ///< of the octree's cube about this point; 0: it has one value, or is none
};

/// What the records of a cube's cells above bricks have of density: by cm_coarse_cell().
struct CoarseCells {
  std::array<glm::uvec2, CM_COARSE_CELLS> coefficients{};  ///< as in a record's data
  std::array<std::uint32_t, 2> dense{};                    ///< a bit each: has any density
};
static_assert(sizeof(CoarseCells) == 4 * CM_COARSE_WORDS);

/// Where what cells have of a channel comes from, as the lattice has it for density: glsl/grid_channels.comp reads it.
struct LatticeChannel {
  Channel channel = Channel::emission;
  std::size_t numbers = 0;           ///< of a voxel
  std::vector<LatticePlace> places;  ///< as the lattice's, with bricks and coarse cells of its own
  /// Of each cube's cells above bricks their records, by cm_coarse_cell(); of emission then a bit each: any light. The
  /// first is of none.
  std::vector<std::uint32_t> coarse;
  std::vector<ChannelNumbers> even_bricks;  ///< of one voxel like all others, the very first 0
  std::vector<glm::ivec3> bricks;           ///< the corners of those that follow
  float fastest = 0.0F;                     ///< of velocity: voxels a second

  [[nodiscard]] std::uint64_t bytes() const {
    return places.size() * sizeof(LatticePlace) + coarse.size() * 4 + even_bricks.size() * sizeof(ChannelNumbers) +
           bricks.size() * sizeof(glm::ivec3);
  }
};

/// All that a grid for any view and any budget is made of, packed: the splits' own priorities, the blocks of the
/// lattice that any of them can ever raise, and where the values of cells come from. Made once a volume and medium;
/// what a view adds is a byte a node (OwnPriorities::levels).
struct Lattice {
  /// settings: but for the camera and the budget. In parallel. progress: as
  /// for Statistics.
  Lattice(const Statistics& statistics, const Channels& beside, const RefineSettings& settings, float max_value,
          Progress* progress = nullptr);

  Cube cube;
  OwnPriorities own;
  /// By scale, the coarsest first; the first is none, the second the one that all others are found from.
  std::vector<glm::uvec2> blocks;
  /// Blocks of a scale: from `first` of it up to that of the scale below, of scale 0 to the end.
  std::array<std::uint32_t, Cube::max_log2_size / 3 + 1> first{};
  /// CM_BLOCK_POINTS for each block of scale 1 and up, and for the first.
  std::vector<LatticePlace> places;
  std::vector<CoarseCells> coarse;  ///< the first is of none
  /// The first bricks have one value each, the very first 0; then follow the statistics', in the order of
  /// nodes_of_size(3).
  std::vector<float> even_bricks;
  std::size_t bricks = 0;     ///< all of them
  bool halves = false;        ///< what all their values are exactly
  float density_unit = 1.0F;  ///< grid value of a record's density 1
  CellKind cells = CellKind::linear;
  std::vector<LatticeChannel> channels;  ///< of those that there are

  [[nodiscard]] std::uint32_t top_scale() const { return static_cast<std::uint32_t>(cube.log2_size) / 3; }
  /// Main memory, without the volume's.
  [[nodiscard]] std::uint64_t bytes() const {
    std::uint64_t beside = 0;
    for (const LatticeChannel& channel : channels) beside += channel.bytes();
    return beside + own.bytes() + blocks.size() * sizeof(glm::uvec2) + places.size() * sizeof(LatticePlace) +
           coarse.size() * sizeof(CoarseCells) + even_bricks.size() * 4;
  }
  /// In buffers for shaders, with the values of bricks and room for priorities.
  [[nodiscard]] std::uint64_t device_bytes() const;

 private:
  void find_blocks(const Statistics& statistics, const std::vector<ChannelFields>& beside, Progress* progress);
  void fill_places(const Statistics& statistics, const Progress* progress);
  void fill_coarse(const Statistics& statistics, const Progress* progress);
  [[nodiscard]] LatticeChannel make_channel(const ChannelFields& fields, const Progress* progress) const;
  void fill_bricks(const ChannelFields& fields, LatticeChannel& made, const Progress* progress) const;
  // Calls visit(index, corner, scale) for the places of cubes.
  template <class Visit>
  void for_each_place(const Progress* progress, Visit&& visit) const;
  // Of the octree's cube that has its middle there.
  [[nodiscard]] std::size_t place_about(const glm::ivec3& corner, int log2_size) const;
  // Of a scale; 0: none.
  [[nodiscard]] std::uint32_t block_at(const glm::ivec3& corner, std::uint32_t scale) const;
};
using LatticePtr = std::shared_ptr<const Lattice>;

/// Part of a cell within a brick: what it has of one voxel, in the cell's frame. As shaders read it:
/// glsl/grid_records.comp, glsl/grid_channels.comp.
struct CellPart {
  glm::vec3 from_centroid;  ///< of that part's middle, from the cell's, in the cell's units
  std::uint32_t packed;     ///< x | y << 4 | z << 8 | sixths << 12; x, y, z: the voxel's low corner from v0 on
};
static_assert(sizeof(CellPart) == 16);
/// Those of cells of each of the ten shapes within bricks, by level from a brick's Kuhn tetrahedron (0) to a sixth of a
/// voxel (9): those of a level are [parts_of_levels[level], parts_of_levels[level + 1]).
using CellParts = std::array<CellPart, CM_CELL_PARTS>;
inline constexpr std::array<unsigned, brick_levels + 2> parts_of_levels{CM_PARTS_OF_LEVELS};
const CellParts& cell_parts();

}  // namespace cumulet::grid
