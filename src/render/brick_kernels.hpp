#pragma once

// What shaders do to bricks that are in GL.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "render/upload.hpp"
#include "volume/device_bricks.hpp"

namespace cumulet::render {

/// As glsl/pack_bricks.comp: floats, halves, and whole numbers that stand for 0 to 1.
enum class VoxelFormat { floats = 0, halves = 1, shorts = 2, bytes = 3 };

/// So many groups, of kernels that count them along x, then along y.
void dispatch_groups(const gl::Functions& gl, std::uint32_t groups);

/// What kernels know of a brick's cells, for CM_UNIFORM_BRICK_TREE. Throws what GL's allocations throw.
[[nodiscard]] gl::Object make_brick_tree(const gl::FunctionsPtr& gl,
                                         const std::array<float, CM_BRICK_EDGES>& edges_squared);

/// How many bricks a dispatch has of kernels that look at every cell of theirs.
[[nodiscard]] std::uint32_t bricks_a_step(const gl::Functions& gl);

/// Of a brick that is copied: which of its memory, and where to.
using MovedBrick = glm::uvec2;
/// The same by the memories that they are in; moved: which of the field, and where to.
[[nodiscard]] std::vector<std::vector<MovedBrick>> moves_of(const volume::DeviceBricks& bricks,
                                                            std::span<const MovedBrick> moved);
/// Copies of bricks that a buffer of MovedBrick names.
struct BrickCopies {
  const gl::Object* from = nullptr;
  bool from_halves = false;
  const gl::Object* to = nullptr;
  bool to_halves = false;
  std::uint32_t to_first = 0;  ///< brick of `to` that places count from
  const gl::Object* moved = nullptr;
  glm::uvec2 numbers{1, 0};  ///< how many floats a voxel has in `to`, and which it is; of halves one

  [[nodiscard]] gl::ProgramKey program() const;
  /// Of these that are moved; with that program, which is usable.
  void dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first, std::uint32_t end) const;
};

/// Of bricks, as glsl/pack_bricks.comp leaves them, the values that are kept, and what main memory is to know of them.
struct BrickSummaries {
  VoxelFormat format = VoxelFormat::floats;
  enum class Field {
    as_is,         ///< may be negative; the most, either way, the box and how many voxels are not 0
    not_negative,  ///< the same
    cells          ///< the same, and what is known of its cells
  };
  Field field = Field::cells;
  const gl::Object* places = nullptr;
  glm::uvec3 bricks{0};  ///< that places count, along each axis
  const gl::Object* values = nullptr;
  const gl::Object* kept = nullptr;  ///< may be the values themselves, where these are floats
  const gl::Object* summaries = nullptr;
  const gl::Object* tree = nullptr;  ///< make_brick_tree(), of cells

  [[nodiscard]] gl::ProgramKey program() const;
  /// With that program, which is usable.
  void dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first, std::uint32_t end) const;
};

}  // namespace cumulet::render
