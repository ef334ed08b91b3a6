#pragma once

#include <memory>

#include "edited_shaders.hpp"
#include "nano_grid.hpp"

namespace cumulet::bench {

/// How looks for light find what passes through a NanoVDB grid.
enum class Look {
  delta,  ///< by delta tracking: all or nothing
  ratio,  ///< by ratio tracking
};

/// Programs whose dense march is one through a NanoVDB grid instead (march_hdda.glsl, flight_hdda.glsl). For as long as
/// programs are made. type: not fpn.
std::unique_ptr<EditedShaders> peer_shaders(NanoType type, Look look);

/// A grid's words where such programs look for them, from now on: as a host binds what is its own.
class BoundGrid {
 public:
  /// block_bytes: what a storage block is taken to hold; 0: what the driver says. Throws std::runtime_error that names
  /// the limit that does not suffice.
  BoundGrid(gl::FunctionsPtr gl, std::span<const std::uint32_t> words, std::uint64_t block_bytes = 0);
  /// Again, after another.
  void bind() const;

 private:
  gl::FunctionsPtr gl_;
  gl::Object buffer_;
};

}  // namespace cumulet::bench
