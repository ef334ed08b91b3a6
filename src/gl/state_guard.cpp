#include "gl/state_guard.hpp"

namespace cumulet::gl {

namespace {

constexpr std::array<GLenum, 3> targets{GL_TEXTURE_BUFFER, GL_TEXTURE_2D, GL_TEXTURE_3D};
constexpr std::array<GLenum, 3> bindings{GL_TEXTURE_BINDING_BUFFER, GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_3D};
constexpr std::array<GLenum, 16> pixel_store{
    GL_PACK_SWAP_BYTES,    GL_PACK_LSB_FIRST,   GL_PACK_ROW_LENGTH,    GL_PACK_IMAGE_HEIGHT,
    GL_PACK_SKIP_PIXELS,   GL_PACK_SKIP_ROWS,   GL_PACK_SKIP_IMAGES,   GL_PACK_ALIGNMENT,
    GL_UNPACK_SWAP_BYTES,  GL_UNPACK_LSB_FIRST, GL_UNPACK_ROW_LENGTH,  GL_UNPACK_IMAGE_HEIGHT,
    GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_IMAGES, GL_UNPACK_ALIGNMENT};

}  // namespace

StateGuard::Indexed StateGuard::indexed(GLenum binding, GLenum start, GLenum size, GLuint index) const {
  Indexed state;
  gl_->GetIntegeri_v(binding, index, &state.buffer);
  gl_->GetInteger64i_v(start, index, &state.offset);
  gl_->GetInteger64i_v(size, index, &state.size);
  return state;
}

void StateGuard::restore(GLenum target, GLuint index, const Indexed& state) const {
  if (state.buffer != 0 && state.size != 0) {
    gl_->BindBufferRange(target, index, static_cast<GLuint>(state.buffer), static_cast<GLintptr>(state.offset),
                         static_cast<GLsizeiptr>(state.size));
  } else {
    gl_->BindBufferBase(target, index, static_cast<GLuint>(state.buffer));
  }
}

StateGuard::StateGuard(const Functions& gl) : gl_(&gl) {
  gl.GetIntegerv(GL_CURRENT_PROGRAM, &program_);
  gl.GetIntegerv(GL_ACTIVE_TEXTURE, &active_texture_);
  for (int unit = 0; unit < units; ++unit) {
    gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    for (std::size_t t = 0; t < targets.size(); ++t) gl.GetIntegerv(bindings[t], &textures_[unit][t]);
    gl.GetIntegerv(GL_SAMPLER_BINDING, &samplers_[unit]);
  }
  for (GLuint i = 0; i < 2; ++i) {
    storage_[i] =
        indexed(GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE, i);
    uniform_[i] = indexed(GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, i);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_NAME, i, &images_[i].name);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, i, &images_[i].level);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYERED, i, &images_[i].layered);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_LAYER, i, &images_[i].layer);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, i, &images_[i].access);
    gl.GetIntegeri_v(GL_IMAGE_BINDING_FORMAT, i, &images_[i].format);
  }
  gl.GetIntegerv(GL_SHADER_STORAGE_BUFFER_BINDING, &storage_generic_);
  gl.GetIntegerv(GL_UNIFORM_BUFFER_BINDING, &uniform_generic_);
  gl.GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &pack_buffer_);
  gl.GetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &unpack_buffer_);
  for (std::size_t i = 0; i < pixel_store.size(); ++i) {
    gl.GetIntegerv(pixel_store[i], &pixel_store_[i]);
    const bool alignment = pixel_store[i] == GL_PACK_ALIGNMENT || pixel_store[i] == GL_UNPACK_ALIGNMENT;
    gl.PixelStorei(pixel_store[i], alignment ? 4 : 0);
  }
  gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (GLuint unit = 0; unit < units; ++unit) gl.BindSampler(unit, 0);
}

StateGuard::~StateGuard() {
  gl_->UseProgram(static_cast<GLuint>(program_));
  for (int unit = 0; unit < units; ++unit) {
    gl_->ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    for (std::size_t t = 0; t < targets.size(); ++t) {
      gl_->BindTexture(targets[t], static_cast<GLuint>(textures_[unit][t]));
    }
    gl_->BindSampler(static_cast<GLuint>(unit), static_cast<GLuint>(samplers_[unit]));
  }
  gl_->ActiveTexture(static_cast<GLenum>(active_texture_));
  for (GLuint i = 0; i < 2; ++i) {
    restore(GL_SHADER_STORAGE_BUFFER, i, storage_[i]);
    restore(GL_UNIFORM_BUFFER, i, uniform_[i]);
    const Image& image = images_[i];
    // A unit that nothing was ever bound to has no valid format on some drivers.
    const auto format = static_cast<GLenum>(image.name == 0 ? GL_R8 : image.format);
    gl_->BindImageTexture(i, static_cast<GLuint>(image.name), image.level, image.layered != 0 ? GL_TRUE : GL_FALSE,
                          image.layer, static_cast<GLenum>(image.access), format);
  }
  gl_->BindBuffer(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(storage_generic_));
  gl_->BindBuffer(GL_UNIFORM_BUFFER, static_cast<GLuint>(uniform_generic_));
  gl_->BindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack_buffer_));
  gl_->BindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack_buffer_));
  for (std::size_t i = 0; i < pixel_store.size(); ++i) gl_->PixelStorei(pixel_store[i], pixel_store_[i]);
}

}  // namespace cumulet::gl
