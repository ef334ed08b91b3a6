#include "render/dynamic/brick_moves.hpp"

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace cumulet::render {

void BrickMoves::plan(Upload& upload, const volume::DeviceBricks& bricks, std::span<const MovedBrick> moved,
                      BrickCopies copies) {
  std::vector<std::vector<MovedBrick>> moves = moves_of(bricks, moved);
  const std::uint32_t a_step = gl_->dispatches_in_call ? 512 : 4096;
  for (std::size_t m = 0; m < moves.size(); ++m) {
    if (moves[m].empty()) continue;
    const volume::DeviceMemory& memory = *bricks.memories[m];
    copies.from = memories_ ? memories_->find(memory) : nullptr;
    if (copies.from == nullptr)
      throw Error(ErrorCode::unsupported, "the volume's voxels belong to another OpenGL context");
    copies.from_halves = memory.halves;
    const auto count = static_cast<std::uint32_t>(moves[m].size());
    gl::Object& list = lists_.emplace_back();
    copies.moved = &list;
    upload.add([this, &list, words = std::move(moves[m])] {
      list = gl::make_buffer(gl_, words.size() * sizeof(MovedBrick), words.data(), 0,
                             "creating the brick list of a volume");
    });
    upload.add_dispatches(programs_, copies.program(), count, a_step,
                          [this, copies](const gl::Program& program, std::uint32_t first, std::uint32_t end) {
                            copies.dispatch(*gl_, program, first, end);
                          });
  }
}

void BrickMoves::plan_together(Upload& upload, std::span<const volume::DeviceBricksPtr> fields,
                               std::span<const glm::ivec3> origins, const Use& use) {
  constexpr std::size_t at_a_time = 1024;
  const std::size_t bytes = std::min(origins.size(), at_a_time) * volume::brick_voxels * fields.size() * sizeof(float);
  if (bytes == 0) return;
  upload.add([this, bytes] { together_ = gl::make_buffer(gl_, bytes, nullptr, 0, "creating the bricks of fields"); });
  for (std::size_t first = 0; first < origins.size(); first += at_a_time) {
    const auto part = origins.subspan(first, std::min(at_a_time, origins.size() - first));
    std::vector<std::vector<MovedBrick>> moved(fields.size());
    for (std::size_t f = 0; f < fields.size(); ++f) {
      for (std::uint32_t i = 0; fields[f] && i < part.size(); ++i) {
        if (const auto brick = fields[f]->find(part[i])) moved[f].emplace_back(*brick, i);
      }
    }
    if (!std::ranges::all_of(moved, [&](const auto& bricks) { return bricks.size() == part.size(); })) {
      upload.add([this, bytes] {
        gl_->ClearNamedBufferSubData(together_.name(), GL_R32UI, 0, static_cast<GLsizeiptr>(bytes), GL_RED_INTEGER,
                                     GL_UNSIGNED_INT, nullptr);
      });
    }
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (!fields[f]) continue;
      plan(upload, *fields[f], moved[f],
           {.to = &together_, .numbers = {static_cast<std::uint32_t>(fields.size()), static_cast<std::uint32_t>(f)}});
    }
    upload.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT); });
    use(first, static_cast<std::uint32_t>(part.size()));
    upload.add([this] { gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT); });
  }
  upload.add([this] { together_ = {}; });
}

}  // namespace cumulet::render
