#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "gl/programs.hpp"
#include "path/path_blocks.glsl"

namespace cumulet::render {

/// Wavefront programs for paths among triangles. Each processes the paths in its queue: glsl/path/path_queue.glsl.
struct StagePrograms {
  const gl::Program* begin = nullptr;  // trace_camera.comp over all pixels of a dispatch
  const gl::Program* travel = nullptr;
  const gl::Program* intersect = nullptr;
  const gl::Program* shade = nullptr;
  const gl::Program* camera = nullptr;
};

/// Buffers that path kernels keep between dispatches, and the dispatch itself: one kernel (megakernel), or several over
/// queues (wavefront). All calls need a current context and an active StateGuard.
class PathKernels {
 public:
  static constexpr std::uint32_t block_lanes = CM_BLOCK_LANES;
  static constexpr std::uint32_t max_lanes = CM_BLOCK_LANES * CM_MAX_BLOCKS;
  static constexpr std::uint32_t begins_tile = CM_BEGINS;
  static constexpr std::size_t header_words = CM_HEADER_WORDS;

  explicit PathKernels(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Allocates buffers for this many paths. slots: number of pixel slots. stages: with queues for the wavefront stages.
  /// visits: with the state of paths among several volumes. within: with the transmissive materials that contain the
  /// ray. groups: with sums of this many light groups. Returns whether the in-flight paths were kept. Throws on a GL
  /// error.
  bool reserve(std::size_t lanes, std::size_t slots, bool stages, bool visits, bool within, std::uint32_t groups);
  /// Binds all buffers that reserve() made.
  void bind() const;
  /// The buffer of counters: the blocks that a dispatch covers, and its results (CmBlocks of
  /// glsl/path/path_store.glsl).
  [[nodiscard]] GLuint counters() const { return blocks_.name(); }
  void set_counters(std::span<const glm::uvec4> words) const;
  /// Sets the list of a tile's sampled blocks (CM_SQUARE_ROWS of glsl/path/path_blocks.glsl). Sets the next free pixel
  /// slot to `lanes`, because the lanes start with the first ones. Clears the entry cells of the slots, and the lane
  /// lists, so that all blocks start with their first.
  void set_squares(std::span<const std::uint32_t> squares, std::uint32_t lanes) const;
  /// Runs the megakernel over this many blocks of lanes; its program must be in use.
  void run_one(std::uint32_t lanes, std::size_t blocks) const;
  /// Runs rounds of the wavefront stages over the blocks.
  void run_stages(const StagePrograms& programs, std::uint32_t lanes, std::size_t blocks, std::uint32_t rounds) const;
  /// Maximum rounds of run_stages().
  static std::uint32_t max_rounds();
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  gl::FunctionsPtr gl_;
  gl::Object paths_;
  std::size_t path_bytes_ = 0;
  gl::Object queues_;
  std::size_t queues_lanes_ = 0;
  gl::Object blocks_;
  std::size_t list_words_ = 0;  // of pixel slots and lane lists
};

}  // namespace cumulet::render
