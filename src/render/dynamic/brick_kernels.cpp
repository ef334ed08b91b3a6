#include "render/dynamic/brick_kernels.hpp"

#include <algorithm>
#include <string>

#include "gl/bindings.hpp"
#include "grid/cell.hpp"
#include "grid/statistics.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

void dispatch_groups(const gl::Functions& gl, std::uint32_t groups) {
  constexpr std::uint32_t most = 65535;
  const std::uint32_t across = std::min(groups, most);
  gl.DispatchCompute(across, (groups + across - 1) / across, 1);
}

gl::Object make_brick_tree(const gl::FunctionsPtr& gl, const std::array<float, CM_BRICK_EDGES>& edges_squared) {
  struct Words {
    std::array<std::uint32_t, 1024> cells{};
    std::array<float, 56> edges{};
  };
  Words words;
  const grid::BrickTree& tree = grid::brick_tree(grid::kuhn_frame(glm::ivec3(0), 8, 0));
  const auto centroid = [](const glm::vec3& at) {
    const glm::uvec3 quarters(4.0F * at);
    return quarters.x | (quarters.y << 6U) | (quarters.z << 12U);
  };
  for (std::size_t i = 1; i < 512; ++i) {
    const std::uint32_t shape = tree.shape[i];
    words.cells[i] = centroid(tree.node_centroid[i]) | ((shape & 0x1ffU) << 18U) |
                     (core::cm_shape_class(shape) << 27U) | (core::cm_shape_exponent(shape) << 29U);
  }
  for (std::size_t i = 0; i < 512; ++i)
    words.cells[512 + i] = centroid({tree.centroid[0][i], tree.centroid[1][i], tree.centroid[2][i]});
  std::ranges::copy(edges_squared, words.edges.begin());
  return gl::make_buffer(gl, sizeof words, &words, 0, "creating the cell tree of a brick");
}

std::uint32_t bricks_per_step(const gl::Functions& gl) {
  // If a driver runs dispatches within the call, the call takes as long as the kernel. The count is small enough that a
  // frame can stop between two dispatches.
  return gl.dispatches_in_call ? 64 : 4096;
}

std::vector<std::vector<MovedBrick>> moves_of(const volume::DeviceBricks& bricks, std::span<const MovedBrick> moved) {
  std::vector<std::vector<MovedBrick>> moves(bricks.memories.size());
  for (const MovedBrick& brick : moved) {
    const volume::DeviceBricks::Location& location = bricks.locations[brick.x];
    moves[location.memory].emplace_back(location.brick, brick.y);
  }
  return moves;
}

gl::ProgramKey BrickCopies::program() const {
  return {"copy_bricks.comp", {gl::macros::from_halves(from_halves), gl::macros::to_halves(to_halves)}};
}

void BrickCopies::dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first,
                           std::uint32_t end) const {
  gl.ProgramUniform2ui(program.name(), 0, first, end);
  gl.ProgramUniform1ui(program.name(), 1, to_first);
  gl.ProgramUniform2ui(program.name(), 2, numbers.x, numbers.y);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_FROM, from->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_TO, to->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_MOVED, moved->name());
  program.use(gl);
  dispatch_groups(gl, end - first);
}

gl::ProgramKey BrickSummaries::program() const {
  return {"summarize_bricks.comp", {gl::macros::format(format), gl::macros::field(field)}};
}

void BrickSummaries::dispatch(const gl::Functions& gl, const gl::Program& program, std::uint32_t first,
                              std::uint32_t end) const {
  const bool cells = field == Field::cells;
  gl.ProgramUniform2ui(program.name(), 0, first, end);
  if (cells) gl.ProgramUniform3ui(program.name(), 1, bricks.x, bricks.y, bricks.z);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_BRICKS, packed_bricks->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PACKED_VALUES, values->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICKS_KEPT, kept->name());
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BRICK_SUMMARIES, summaries->name());
  if (cells) gl.BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_BRICK_TREE, tree->name());
  program.use(gl);
  dispatch_groups(gl, end - first);
}

}  // namespace cumulet::render
