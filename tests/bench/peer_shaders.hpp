#pragma once

#include <memory>

#include "edited_shaders.hpp"
#include "nano_grid.hpp"

namespace cumulet::bench {

/// How shadow rays estimate the transmittance of a NanoVDB grid.
enum class Look {
  delta,  ///< by delta tracking: 0 or 1
  ratio,  ///< by ratio tracking
};

/// Programs whose dense grid traversal is replaced by that of a NanoVDB grid (march_hdda.glsl, flight_hdda.glsl). The
/// object must live until all programs are compiled. type: not fpn.
std::unique_ptr<EditedShaders> peer_shaders(NanoType type, Look look);

/// Binds a grid's words where such programs read them, as a host binds its own objects.
class BoundGrid {
 public:
  /// block_bytes: assumed storage block size; 0: the driver's. Throws std::runtime_error that names the limit that does
  /// not suffice.
  BoundGrid(gl::FunctionsPtr gl, std::span<const std::uint32_t> words, std::uint64_t block_bytes = 0);
  /// Binds it again after another grid.
  void bind() const;

 private:
  gl::FunctionsPtr gl_;
  gl::Object buffer_;
};

}  // namespace cumulet::bench
