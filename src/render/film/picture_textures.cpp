#include "render/film/picture_textures.hpp"

#include "gl/bindings.hpp"

namespace cumulet::render {

void bind_sums(const gl::Functions& gl, const PictureTextures& picture) {
  const bool before = picture.sum_before != 0;
  gl.BindTextureUnit(core::CM_UNIT_SUM, picture.sum);
  gl.BindTextureUnit(core::CM_UNIT_COUNTS, picture.counts);
  gl.BindTextureUnit(core::CM_UNIT_BACKGROUND, picture.background);
  gl.BindTextureUnit(core::CM_UNIT_SUM_BEFORE, before ? picture.sum_before : picture.sum);
  gl.BindTextureUnit(core::CM_UNIT_COUNTS_BEFORE, before ? picture.counts_before : picture.counts);
  gl.BindTextureUnit(core::CM_UNIT_BACKGROUND_BEFORE, before ? picture.background_before : picture.background);
}

}  // namespace cumulet::render
