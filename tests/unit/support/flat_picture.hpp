#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "gl/objects.hpp"
#include "render/film/picture_textures.hpp"

namespace cumulet::test {

/// An image of one sample per pixel over black.
struct FlatPicture {
  glm::ivec2 size{0};
  gl::Object sum, background, counts, z;

  /// pixels: premultiplied radiance and alpha, top row first; missing pixels are 0. The volume is at view depth 2.
  FlatPicture(const gl::FunctionsPtr& gl, glm::ivec2 of_size, std::vector<glm::vec4> pixels) : size(of_size) {
    const auto count = static_cast<std::size_t>(size.x * size.y);
    sum = gl::make_texture_2d(gl, GL_RGBA32F, size.x, size.y, "sum");
    background = gl::make_texture_2d(gl, GL_RGBA32F, size.x, size.y, "background");
    counts = gl::make_texture_2d(gl, GL_RG32UI, size.x, size.y, "counts");
    z = gl::make_texture_2d(gl, GL_R32F, size.x, size.y, "z");
    const glm::uvec2 one(1U, 0U);
    const float two = 2.0F;
    gl->ClearTexImage(background.name(), 0, GL_RGBA, GL_FLOAT, nullptr);
    gl->ClearTexImage(counts.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, &one);
    gl->ClearTexImage(z.name(), 0, GL_RED, GL_FLOAT, &two);
    pixels.resize(count, glm::vec4(0.0F));
    set(*gl, pixels);
  }
  void set(const gl::Functions& gl, const std::vector<glm::vec4>& pixels) const {
    gl.TextureSubImage2D(sum.name(), 0, 0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, pixels.data());
  }
  [[nodiscard]] render::PictureTextures textures() const {
    render::PictureTextures textures;
    textures.sum = sum.name();
    textures.background = background.name();
    textures.counts = counts.name();
    textures.size = glm::uvec2(size);
    textures.volume_z = z.name();
    textures.picture = 1;
    return textures;
  }
};

}  // namespace cumulet::test
