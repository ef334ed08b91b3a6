#pragma once

#include <glad/gl.h>

#include "environment_view.hpp"

namespace cumulet::demo {

/// Texture of a thumbnail in the window's context, which must be current. It repeats horizontally.
class ThumbnailTexture {
 public:
  ThumbnailTexture(const GladGLContext& gl, const Thumbnail& thumbnail) : gl_(gl) {
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &name_);
    gl_.TextureParameteri(name_, GL_TEXTURE_WRAP_S, GL_REPEAT);
    gl_.TextureParameteri(name_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl_.TextureParameteri(name_, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TextureStorage2D(name_, 1, GL_RGBA8, Thumbnail::width, Thumbnail::height);
    gl_.TextureSubImage2D(name_, 0, 0, 0, Thumbnail::width, Thumbnail::height, GL_RGBA, GL_UNSIGNED_BYTE,
                          thumbnail.rgba.data());
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
