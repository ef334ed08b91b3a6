#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "gl/programs.hpp"
#include "path_blocks.glsl"

namespace cumulet::render {

/// Programs that trace paths among triangles, each the paths that wait for it: glsl/path_queue.glsl.
struct StagePrograms {
  const gl::Program* begin = nullptr;  // trace_camera.comp over all pixels of a dispatch
  const gl::Program* travel = nullptr;
  const gl::Program* meet = nullptr;
  const gl::Program* shade = nullptr;
  const gl::Program* camera = nullptr;
};

/// What kernels of paths keep between dispatches, and how a dispatch is run: as one kernel, or as several over queues.
/// All calls need the context current and a StateGuard around.
class PathKernels {
 public:
  static constexpr std::uint32_t block_lanes = CM_BLOCK_LANES;
  static constexpr std::uint32_t most_lanes = CM_BLOCK_LANES * CM_MOST_BLOCKS;
  static constexpr std::uint32_t begins_tile = CM_BEGINS;

  explicit PathKernels(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Makes room for so many paths, with queues if they are to be run by stages, with what paths among several
  /// volumes keep of their visits, with what they keep of the glass that they are within, and with sums of so many
  /// groups of lights. Returns whether paths that were under way still are. Throws on a GL error.
  bool reserve(std::size_t lanes, bool stages, bool visits, bool within, std::uint32_t groups);
  /// Binds all that reserve made.
  void bind() const;
  /// The buffer of counters: which blocks a dispatch covers, and what it did (CmBlocks of glsl/path_store.glsl).
  [[nodiscard]] GLuint counters() const { return blocks_.name(); }
  void set_counters(std::span<const glm::uvec4> words) const;
  /// The list of a tile's squares that are sampled (CM_SQUARE_ROWS of glsl/path_blocks.glsl); no place of theirs is
  /// taken but those that so many lanes begin with. All blocks begin, with their first turn.
  void set_squares(std::span<const std::uint32_t> squares, std::uint32_t lanes) const;
  /// One kernel over so many blocks of so many lanes; its program is in use.
  void run_one(std::uint32_t lanes, std::size_t blocks) const;
  /// Rounds of stages over them.
  void run_stages(const StagePrograms& programs, std::uint32_t lanes, std::size_t blocks, std::uint32_t rounds) const;
  /// Rounds that run_stages does at most.
  static std::uint32_t most_rounds();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  gl::FunctionsPtr gl_;
  gl::Object paths_;
  std::size_t path_bytes_ = 0;
  gl::Object queues_;
  std::size_t queues_lanes_ = 0;
  gl::Object blocks_;
  std::size_t ranked_lanes_ = 0;
};

}  // namespace cumulet::render
