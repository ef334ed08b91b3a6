#pragma once

// Upload steps that copy bricks between buffers in GL.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <list>
#include <span>
#include <vector>

#include "render/dynamic/brick_kernels.hpp"
#include "render/dynamic/device_memories.hpp"
#include "render/pacing/upload.hpp"

namespace cumulet::render {

/// Plans copies of bricks as upload steps. The object must outlive the last step.
class BrickMoves {
 public:
  BrickMoves(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories)
      : gl_(std::move(gl)), programs_(std::move(programs)), memories_(std::move(memories)) {}
  BrickMoves(const BrickMoves&) = delete;
  BrickMoves& operator=(const BrickMoves&) = delete;
  /// Plans copies of the field's bricks `moved` to the destination that copies gives. Throws Error(unsupported) if a
  /// memory of the field is not in this share group.
  void plan(Upload& upload, const volume::DeviceBricks& bricks, std::span<const MovedBrick> moved, BrickCopies copies);
  /// Plans copies of several fields' bricks into one interleaved buffer, a batch of origins at a time. use is called
  /// once per batch, with the batch's first index in origins and its size, and plans the steps that read the batch.
  /// Throws as plan() does.
  using Use = std::function<void(std::size_t first, std::uint32_t count)>;
  void plan_together(Upload& upload, std::span<const volume::DeviceBricksPtr> fields,
                     std::span<const glm::ivec3> origins, const Use& use);
  /// The interleaved buffer; valid in the steps that `use` plans. Voxel v of brick b and field f has index (512 b + v)
  /// * fields + f. Missing bricks are 0.
  [[nodiscard]] const gl::Object& together() const { return together_; }
  /// Frees the lists of copies. Call it after the last planned step.
  void drop() { lists_.clear(); }

 private:
  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  std::list<gl::Object> lists_;
  gl::Object together_;
};

}  // namespace cumulet::render
