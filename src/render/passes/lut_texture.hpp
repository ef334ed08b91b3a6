#pragma once

#include <cstdint>
#include <utility>

#include "gl/objects.hpp"
#include "render/passes/display_lut.hpp"

namespace cumulet::render {

/// The display LUT that was drawn with last, as a texture.
class LutTexture {
 public:
  explicit LutTexture(gl::FunctionsPtr gl) : gl_(std::move(gl)) {}

  /// Returns the LUT's texture, which is uploaded if the LUT is another one than before. Throws
  /// Error(out_of_memory, gl).
  GLuint of(const DisplayLutPtr& lut);
  /// Frees the texture.
  void drop() {
    texture_ = {};
    lut_ = nullptr;
  }
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const { return lut_ ? std::uint64_t{16} * lut_->points.size() : 0; }

 private:
  gl::FunctionsPtr gl_;
  DisplayLutPtr lut_;
  gl::Object texture_;
};

}  // namespace cumulet::render
