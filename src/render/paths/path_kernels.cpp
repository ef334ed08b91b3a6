#include "render/paths/path_kernels.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "gl/bindings.hpp"
#include "render/pacing/pace.hpp"
#include "render/scene/parameters.hpp"

namespace cumulet::core {
#include "path/path_queue.glsl"
#include "path/path_state.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

namespace {

// visits: state of paths among several volumes. within: the transmissive materials that contain the ray, stored behind
// the visits in any case. groups: of lights; stored behind both.
constexpr std::size_t lane_bytes(bool visits, bool within, std::uint32_t groups) {
  const bool both = groups > 0;
  return std::size_t{16} * (CM_PATH_QUADS + (visits || within || both ? CM_VISIT_QUADS : 0) +
                            (within || both ? CM_WITHIN_QUADS : 0) + groups);
}

// A head holds the arguments of glDispatchComputeIndirect and the number of waiting paths.
constexpr std::size_t head_bytes = sizeof(glm::uvec4);
constexpr std::size_t heads_bytes = std::size_t{CM_QUEUES} * (CM_MAX_ROUNDS + 1) * head_bytes;
constexpr std::size_t queue_bytes = (std::size_t{CM_QUEUES} + 1) * sizeof(std::uint32_t);  // per lane

// Offsets of cm_next_slot and the fields after it, behind the header and cm_blocks.
constexpr std::size_t next_slot_at = (CM_HEADER_WORDS + CM_MAX_BLOCKS) * sizeof(glm::uvec4);
constexpr std::size_t squares_at = next_slot_at + sizeof(std::uint32_t);
constexpr std::size_t rank_counts_at = squares_at + CM_MAX_SQUARES * sizeof(std::uint32_t);
constexpr std::size_t rank_counts_bytes = std::size_t{CM_LISTS} * CM_MAX_BLOCKS * sizeof(std::uint32_t);
constexpr std::size_t blocks_bytes(std::size_t list_words) {
  return rank_counts_at + rank_counts_bytes + list_words * sizeof(std::uint32_t);
}

}  // namespace

bool PathKernels::reserve(std::size_t lanes, std::size_t slots, bool stages, bool visits, bool within,
                          std::uint32_t groups) {
  bool kept = true;
  const std::size_t list_words = slots + (stages ? 0 : CM_LISTS * lanes);  // stages use queues instead
  if (!blocks_ || list_words > list_words_) {
    kept = false;
    blocks_ = {};
    list_words_ = 0;
    blocks_ = gl::make_buffer(gl_, blocks_bytes(list_words), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the counters");
    list_words_ = list_words;
  }
  const std::size_t path_bytes = lanes * lane_bytes(visits, within, groups);
  if (path_bytes > path_bytes_) {
    kept = false;
    paths_ = {};
    path_bytes_ = 0;
    paths_ = gl::make_buffer(gl_, path_bytes, nullptr, 0, "creating the path buffer");
    path_bytes_ = path_bytes;
  }
  if (stages && lanes > queues_lanes_) {
    queues_ = {};
    queues_lanes_ = 0;
    queues_ = gl::make_buffer(gl_, heads_bytes + lanes * queue_bytes, nullptr, GL_DYNAMIC_STORAGE_BIT,
                              "creating the queues of paths");
    queues_lanes_ = lanes;
  }
  return kept;
}

void PathKernels::bind() const {
  if (paths_) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_PATHS, paths_.name());
  if (blocks_) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_BLOCKS, blocks_.name());
  if (queues_) gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_QUEUES, queues_.name());
}

void PathKernels::set_counters(std::span<const glm::uvec4> words) const {
  gl_->NamedBufferSubData(blocks_.name(), 0, static_cast<GLsizeiptr>(words.size_bytes()), words.data());
}

void PathKernels::set_squares(std::span<const std::uint32_t> squares, std::uint32_t lanes) const {
  gl_->NamedBufferSubData(blocks_.name(), next_slot_at, sizeof lanes, &lanes);
  gl_->NamedBufferSubData(blocks_.name(), squares_at, static_cast<GLsizeiptr>(squares.size_bytes()), squares.data());
  const std::size_t slots = CM_SQUARE_PIXELS * squares.size();
  gl_->ClearNamedBufferSubData(blocks_.name(), GL_R32UI, rank_counts_at,
                               static_cast<GLsizeiptr>(blocks_bytes(slots) - rank_counts_at), GL_RED_INTEGER,
                               GL_UNSIGNED_INT, nullptr);
}

void PathKernels::run_one(std::uint32_t lanes, std::size_t blocks) const {
  const std::uint32_t across = (std::min(lanes, block_lanes) + CM_SQUARE_PIXELS - 1) / CM_SQUARE_PIXELS;
  gl_->DispatchCompute(across, static_cast<GLuint>(blocks), 1);
}

void PathKernels::run_stages(const StagePrograms& programs, std::uint32_t lanes, std::size_t blocks,
                             std::uint32_t rounds) const {
  const std::vector<glm::uvec4> heads(std::size_t{CM_QUEUES} * (rounds + 1), glm::uvec4(0U, 1U, 1U, 0U));
  gl_->NamedBufferSubData(queues_.name(), 0, static_cast<GLsizeiptr>(heads.size() * head_bytes), heads.data());
  gl_->BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, queues_.name());
  const auto settle = [this] {
    gl::memory_barrier(*gl_,
                       GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
  };
  programs.begin->use(*gl_);
  run_one(lanes, blocks);
  settle();
  const std::array<const gl::Program*, CM_QUEUES> order{programs.travel, programs.intersect, programs.shade,
                                                        programs.camera};
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::uint32_t queue = 0; queue < CM_QUEUES; ++queue) {
      gl_->ProgramUniform1ui(order[queue]->name(), CM_ROUND_LOCATION, round);
      order[queue]->use(*gl_);
      gl_->DispatchComputeIndirect(static_cast<GLintptr>((std::size_t{round} * CM_QUEUES + queue) * head_bytes));
      settle();
    }
  }
}

std::uint32_t PathKernels::max_rounds() { return CM_MAX_ROUNDS; }

std::uint64_t PathKernels::bytes() const {
  return path_bytes_ + (blocks_ ? blocks_bytes(list_words_) : 0) +
         (queues_ ? heads_bytes + queues_lanes_ * queue_bytes : 0);
}

}  // namespace cumulet::render
