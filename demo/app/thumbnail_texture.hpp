#pragma once

#include <glad/gl.h>

#include <cstdint>
#include <vector>

#include "environment_view.hpp"

namespace cumulet::demo {

/// Texture of a thumbnail in the window's context, which must be current. It repeats horizontally.
class ThumbnailTexture {
 public:
  ThumbnailTexture(const GladGLContext& gl, const Thumbnail& thumbnail)
      : ThumbnailTexture(gl, thumbnail.rgba, Thumbnail::width, Thumbnail::height) {}
  /// rgba: 4 bytes per pixel in sRGB, first pixel at the top left.
  ThumbnailTexture(const GladGLContext& gl, const std::vector<std::uint8_t>& rgba, std::uint32_t width,
                   std::uint32_t height)
      : gl_(gl) {
    const auto columns = static_cast<GLsizei>(width);
    const auto rows = static_cast<GLsizei>(height);
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &name_);
    gl_.TextureParameteri(name_, GL_TEXTURE_WRAP_S, GL_REPEAT);
    gl_.TextureParameteri(name_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl_.TextureParameteri(name_, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TextureStorage2D(name_, 1, GL_RGBA8, columns, rows);
    gl_.TextureSubImage2D(name_, 0, 0, 0, columns, rows, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  }
  ~ThumbnailTexture() { gl_.DeleteTextures(1, &name_); }
  ThumbnailTexture(const ThumbnailTexture&) = delete;
  ThumbnailTexture& operator=(const ThumbnailTexture&) = delete;

  [[nodiscard]] unsigned name() const { return name_; }

 private:
  const GladGLContext& gl_;
  unsigned name_ = 0;
};

}  // namespace cumulet::demo
