#pragma once

// Dispatches of the compute kernels that process bricks in GL buffers.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "render/pacing/upload.hpp"
#include "volume/device_bricks.hpp"

namespace cumulet::render {

/// Voxel formats, numbered as in glsl/grid/pack_bricks.comp: float, half float, and 16-bit and 8-bit unsigned
/// normalized.
enum class VoxelFormat { floats = 0, halves = 1, shorts = 2, bytes = 3 };

/// Dispatches this many work groups, for kernels that number their groups along x, then y.
void dispatch_groups(const gl::Functions& gl, std::uint32_t groups);

/// Makes the uniform buffer CM_UNIFORM_BRICK_TREE: geometry of the cells within a brick. Throws the errors of GL
/// allocations.
[[nodiscard]] gl::Object make_brick_tree(const gl::FunctionsPtr& gl,
                                         const std::array<float, CM_BRICK_EDGES>& edges_squared);

/// Returns the number of bricks per dispatch for kernels that visit every cell of a brick.
[[nodiscard]] std::uint32_t bricks_per_step(const gl::Functions& gl);

/// A copied brick: its index in the source memory and its index in the destination.
using MovedBrick = glm::uvec2;
/// Splits copies by source memory. moved: index of the brick in the field, and index in the destination. Returns, per
/// memory of the field, the indices in that memory.
[[nodiscard]] std::vector<std::vector<MovedBrick>> moves_of(const volume::DeviceBricks& bricks,
                                                            std::span<const MovedBrick> moved);
/// Copies of the bricks that a buffer of MovedBrick lists.
struct BrickCopies {
  const gl::Object* from = nullptr;
  bool from_halves = false;
  const gl::Object* to = nullptr;
  bool to_halves = false;
  std::uint32_t to_first = 0;  ///< brick of `to` that destination indices start at
  const gl::Object* moved = nullptr;
  glm::uvec2 numbers{1, 0};  ///< floats per voxel in `to`, and the component to write; 1 and 0 for half floats

  [[nodiscard]] gl::ProgramKey program() const;
  /// Copies the entries [first, end) of `moved`. program: program(), usable.
  void dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first, std::uint32_t end) const;
};

/// Converts bricks as glsl/grid/pack_bricks.comp leaves them into the values that are kept, and summarizes them for
/// main memory.
struct BrickSummaries {
  VoxelFormat format = VoxelFormat::floats;
  enum class Field {
    as_is,  ///< values may be negative; the summary has the maximum magnitude, the box and the number of nonzero voxels
    not_negative,  ///< the same summary; negative values become 0
    cells          ///< a complete summary, with the sums of the cells in the brick; negative values become 0
  };
  Field field = Field::cells;
  const gl::Object* packed_bricks = nullptr;
  glm::uvec3 bricks{0};  ///< size of the lattice that `packed_bricks` index, in bricks per axis
  const gl::Object* values = nullptr;
  const gl::Object* kept = nullptr;  ///< may be `values` itself if these are floats
  const gl::Object* summaries = nullptr;
  const gl::Object* tree = nullptr;  ///< make_brick_tree(); for Field::cells

  [[nodiscard]] gl::ProgramKey program() const;
  /// Processes the bricks [first, end). program: program(), usable.
  void dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first, std::uint32_t end) const;
};

}  // namespace cumulet::render
