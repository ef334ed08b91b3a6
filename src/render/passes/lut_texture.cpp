#include "render/passes/lut_texture.hpp"

namespace cumulet::render {

GLuint LutTexture::of(const DisplayLutPtr& lut) {
  if (lut_ == lut) return texture_.name();
  drop();
  const int size = lut->size;
  gl::Object texture = gl::make_texture_3d(gl_, GL_RGBA32F, size, size, size, "creating the display LUT");
  gl_->TextureSubImage3D(texture.name(), 0, 0, 0, 0, size, size, size, GL_RGB, GL_FLOAT, lut->points.data());
  texture_ = std::move(texture);
  lut_ = lut;
  return texture_.name();
}

}  // namespace cumulet::render
