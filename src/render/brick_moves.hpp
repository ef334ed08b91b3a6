#pragma once

// Bricks that steps of an upload copy from the memories that they are in.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <list>
#include <span>
#include <vector>

#include "render/brick_kernels.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"

namespace cumulet::render {

/// Plans copies. It has to live until the last step is made.
class BrickMoves {
 public:
  BrickMoves(gl::FunctionsPtr gl, gl::ProgramsPtr programs, DeviceMemoriesPtr memories)
      : gl_(std::move(gl)), programs_(std::move(programs)), memories_(std::move(memories)) {}
  BrickMoves(const BrickMoves&) = delete;
  BrickMoves& operator=(const BrickMoves&) = delete;
  /// Of a field's bricks these, to where copies says. Throws Error(unsupported) where the memories have them not.
  void plan(Upload& upload, const volume::DeviceBricks& bricks, std::span<const MovedBrick> moved, BrickCopies copies);
  /// Those of fields side by side, some at a time. use: called for each part of these places, of which the first is
  /// told and how many they are, to plan what is done with them. Throws as plan() does.
  using Use = std::function<void(std::size_t first, std::uint32_t count)>;
  void plan_together(Upload& upload, std::span<const volume::DeviceBricksPtr> fields,
                     std::span<const glm::ivec3> origins, const Use& use);
  /// While those are used: of voxel v of brick b field f has number (512 b + v) * fields + f; 0 where it has no brick.
  [[nodiscard]] const gl::Object& together() const { return together_; }
  /// Once all steps that were planned are made.
  void drop() { lists_.clear(); }

 private:
  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  std::list<gl::Object> lists_;
  gl::Object together_;
};

}  // namespace cumulet::render
