#include "gl/state_guard.hpp"

#include <algorithm>

namespace cumulet::gl {

namespace {

struct TextureTarget {
  GLenum target, binding;
};
constexpr std::array<TextureTarget, 5> texture_targets{{{GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D},
                                                        {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY},
                                                        {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE},
                                                        {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D},
                                                        {GL_TEXTURE_BUFFER, GL_TEXTURE_BINDING_BUFFER}}};

struct Capability {
  GLenum name;
  bool known = false;
};
constexpr std::array<Capability, 28> capability_table{{{GL_DEPTH_TEST},
                                                       {GL_DEPTH_CLAMP},
                                                       {GL_STENCIL_TEST},
                                                       {GL_CULL_FACE},
                                                       {GL_POLYGON_OFFSET_FILL},
                                                       {GL_POLYGON_OFFSET_LINE},
                                                       {GL_POLYGON_OFFSET_POINT},
                                                       {GL_POLYGON_SMOOTH},
                                                       {GL_RASTERIZER_DISCARD},
                                                       {GL_COLOR_LOGIC_OP},
                                                       {GL_MULTISAMPLE, true},
                                                       {GL_SAMPLE_SHADING},
                                                       {GL_SAMPLE_ALPHA_TO_COVERAGE},
                                                       {GL_SAMPLE_ALPHA_TO_ONE},
                                                       {GL_SAMPLE_COVERAGE},
                                                       {GL_SAMPLE_MASK},
                                                       {GL_PRIMITIVE_RESTART},
                                                       {GL_PRIMITIVE_RESTART_FIXED_INDEX},
                                                       {GL_CLIP_DISTANCE0},
                                                       {GL_CLIP_DISTANCE1},
                                                       {GL_CLIP_DISTANCE2},
                                                       {GL_CLIP_DISTANCE3},
                                                       {GL_CLIP_DISTANCE4},
                                                       {GL_CLIP_DISTANCE5},
                                                       {GL_CLIP_DISTANCE6},
                                                       {GL_CLIP_DISTANCE7},
                                                       {GL_DITHER},
                                                       {GL_FRAMEBUFFER_SRGB}}};

struct PixelParameter {
  GLenum name;
  GLint known = 0;
};
constexpr std::array<PixelParameter, 24> pixel_table{{{GL_PACK_SWAP_BYTES},
                                                      {GL_PACK_LSB_FIRST},
                                                      {GL_PACK_ROW_LENGTH},
                                                      {GL_PACK_IMAGE_HEIGHT},
                                                      {GL_PACK_SKIP_PIXELS},
                                                      {GL_PACK_SKIP_ROWS},
                                                      {GL_PACK_SKIP_IMAGES},
                                                      {GL_PACK_ALIGNMENT, 4},
                                                      {GL_PACK_COMPRESSED_BLOCK_WIDTH},
                                                      {GL_PACK_COMPRESSED_BLOCK_HEIGHT},
                                                      {GL_PACK_COMPRESSED_BLOCK_DEPTH},
                                                      {GL_PACK_COMPRESSED_BLOCK_SIZE},
                                                      {GL_UNPACK_SWAP_BYTES},
                                                      {GL_UNPACK_LSB_FIRST},
                                                      {GL_UNPACK_ROW_LENGTH},
                                                      {GL_UNPACK_IMAGE_HEIGHT},
                                                      {GL_UNPACK_SKIP_PIXELS},
                                                      {GL_UNPACK_SKIP_ROWS},
                                                      {GL_UNPACK_SKIP_IMAGES},
                                                      {GL_UNPACK_ALIGNMENT, 4},
                                                      {GL_UNPACK_COMPRESSED_BLOCK_WIDTH},
                                                      {GL_UNPACK_COMPRESSED_BLOCK_HEIGHT},
                                                      {GL_UNPACK_COMPRESSED_BLOCK_DEPTH},
                                                      {GL_UNPACK_COMPRESSED_BLOCK_SIZE}}};

constexpr std::array<GLenum, 4> blend_functions{GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB, GL_BLEND_SRC_ALPHA,
                                                GL_BLEND_DST_ALPHA};
constexpr std::array<GLenum, 2> blend_equations{GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA};

/// A name as glGet gives it.
GLuint name_of(GLint value) { return static_cast<GLuint>(value); }

}  // namespace

GLint StateGuard::get(GLenum name) const {
  GLint value = 0;
  gl_->GetIntegerv(name, &value);
  return value;
}

void StateGuard::enable(GLenum capability, bool on) const {
  if (on) {
    gl_->Enable(capability);
  } else {
    gl_->Disable(capability);
  }
}

GLuint StateGuard::draw_buffer_count() const {
  return std::min(name_of(get(GL_MAX_DRAW_BUFFERS)), static_cast<GLuint>(most_draw_buffers));
}

StateGuard::BufferRange StateGuard::range(GLenum binding, GLenum start, GLenum size, GLuint index) const {
  BufferRange result;
  gl_->GetIntegeri_v(binding, index, &result.buffer);
  gl_->GetInteger64i_v(start, index, &result.offset);
  gl_->GetInteger64i_v(size, index, &result.size);
  return result;
}

void StateGuard::restore_range(GLenum target, GLuint index, const BufferRange& saved, const BufferRange& now) const {
  if (saved == now) return;
  const GLuint buffer = name_of(saved.buffer);
  if (buffer == 0 || gl_->IsBuffer(buffer) == GL_FALSE) {
    gl_->BindBufferBase(target, index, 0);
  } else if (saved.size == 0) {
    gl_->BindBufferBase(target, index, buffer);
  } else {
    gl_->BindBufferRange(target, index, buffer, static_cast<GLintptr>(saved.offset),
                         static_cast<GLsizeiptr>(saved.size));
  }
}

StateGuard::ImageUnit StateGuard::image(GLuint unit) const {
  ImageUnit result;
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_NAME, unit, &result.name);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, unit, &result.level);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LAYERED, unit, &result.layered);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LAYER, unit, &result.layer);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, unit, &result.access);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_FORMAT, unit, &result.format);
  return result;
}

StateGuard::StateGuard(const Functions& gl, bool restore) : gl_(&gl), restore_(restore) {
  static_assert(texture_targets.size() == targets && capability_table.size() == capabilities &&
                pixel_table.size() == pixel_parameters);
  if (restore_) {
    save_objects();
    save_raster();
  }
  set_known();
}

StateGuard::~StateGuard() {
  if (!restore_) return;
  restore_objects();
  restore_raster();
}

void StateGuard::save_objects() {
  program_ = get(GL_CURRENT_PROGRAM);
  pipeline_ = get(GL_PROGRAM_PIPELINE_BINDING);
  vertex_array_ = get(GL_VERTEX_ARRAY_BINDING);
  draw_framebuffer_ = get(GL_DRAW_FRAMEBUFFER_BINDING);
  read_framebuffer_ = get(GL_READ_FRAMEBUFFER_BINDING);
  active_texture_ = get(GL_ACTIVE_TEXTURE);
  for (GLuint unit = 0; unit < units; ++unit) {
    gl_->ActiveTexture(GL_TEXTURE0 + unit);
    for (std::size_t t = 0; t < targets; ++t) texture_units_[unit].textures[t] = get(texture_targets[t].binding);
    texture_units_[unit].sampler = get(GL_SAMPLER_BINDING);
  }
  gl_->ActiveTexture(static_cast<GLenum>(active_texture_));
  for (GLuint i = 0; i < ranges; ++i) {
    storage_[i] =
        range(GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE, i);
    uniform_[i] = range(GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, i);
  }
  storage_generic_ = get(GL_SHADER_STORAGE_BUFFER_BINDING);
  uniform_generic_ = get(GL_UNIFORM_BUFFER_BINDING);
  for (GLuint i = 0; i < images; ++i) images_[i] = image(i);
  pack_buffer_ = get(GL_PIXEL_PACK_BUFFER_BINDING);
  unpack_buffer_ = get(GL_PIXEL_UNPACK_BUFFER_BINDING);
  for (std::size_t i = 0; i < pixel_parameters; ++i) pixel_store_[i] = get(pixel_table[i].name);
}

void StateGuard::save_raster() {
  for (std::size_t i = 0; i < capabilities; ++i) enabled_[i] = gl_->IsEnabled(capability_table[i].name);
  for (GLuint i = 0; i < draw_buffer_count(); ++i) {
    gl_->GetBooleani_v(GL_COLOR_WRITEMASK, i, draw_buffers_[i].mask.data());
    draw_buffers_[i].blend = gl_->IsEnabledi(GL_BLEND, i);
  }
  gl_->GetFloati_v(GL_VIEWPORT, 0, viewport_.data());
  gl_->GetIntegeri_v(GL_SCISSOR_BOX, 0, scissor_box_.data());
  scissor_test_ = gl_->IsEnabledi(GL_SCISSOR_TEST, 0);
  gl_->GetDoublei_v(GL_DEPTH_RANGE, 0, depth_range_.data());
  gl_->GetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
  depth_function_ = get(GL_DEPTH_FUNC);
  for (GLuint buffer = 0; buffer < blended_buffers; ++buffer) {
    Blend& saved = blends_[buffer];
    for (std::size_t i = 0; i < blend_functions.size(); ++i) {
      gl_->GetIntegeri_v(blend_functions[i], buffer, &saved.function[i]);
    }
    for (std::size_t i = 0; i < blend_equations.size(); ++i) {
      gl_->GetIntegeri_v(blend_equations[i], buffer, &saved.equation[i]);
    }
  }
  cull_face_ = get(GL_CULL_FACE_MODE);
  front_face_ = get(GL_FRONT_FACE);
  gl_->GetIntegerv(GL_POLYGON_MODE, polygon_mode_.data());
  clip_origin_ = get(GL_CLIP_ORIGIN);
  clip_depth_ = get(GL_CLIP_DEPTH_MODE);
}

void StateGuard::set_known() const {
  for (GLuint unit = 0; unit < units; ++unit) gl_->BindSampler(unit, 0);
  gl_->BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl_->BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (const PixelParameter& parameter : pixel_table) gl_->PixelStorei(parameter.name, parameter.known);
  for (const Capability& capability : capability_table) enable(capability.name, capability.known);
  for (GLuint i = 0; i < draw_buffer_count(); ++i) {
    const GLboolean write = i == 0 ? GL_TRUE : GL_FALSE;
    gl_->ColorMaski(i, write, write, write, write);
    gl_->Disablei(GL_BLEND, i);
  }
  gl_->Disablei(GL_SCISSOR_TEST, 0);
  gl_->DepthRangeIndexed(0, 0.0, 1.0);
  gl_->DepthMask(GL_TRUE);
  gl_->DepthFunc(GL_LESS);
  for (GLuint buffer = 0; buffer < blended_buffers; ++buffer) {
    gl_->BlendFuncSeparatei(buffer, GL_ONE, GL_ZERO, GL_ONE, GL_ZERO);
    gl_->BlendEquationSeparatei(buffer, GL_FUNC_ADD, GL_FUNC_ADD);
  }
  gl_->CullFace(GL_BACK);
  gl_->FrontFace(GL_CCW);
  gl_->PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  gl_->ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
}

// Bindings that nobody changed are left alone: binding again what was deleted elsewhere would be an error, and a loss.
void StateGuard::restore_objects() const {
  if (get(GL_CURRENT_PROGRAM) != program_) {
    GLint linked = 0;
    if (program_ != 0 && gl_->IsProgram(name_of(program_)) != GL_FALSE) {
      gl_->GetProgramiv(name_of(program_), GL_LINK_STATUS, &linked);
    }
    gl_->UseProgram(linked != 0 ? name_of(program_) : 0);
  }
  if (get(GL_PROGRAM_PIPELINE_BINDING) != pipeline_) gl_->BindProgramPipeline(name_of(pipeline_));
  if (get(GL_VERTEX_ARRAY_BINDING) != vertex_array_) gl_->BindVertexArray(name_of(vertex_array_));
  if (get(GL_DRAW_FRAMEBUFFER_BINDING) != draw_framebuffer_) {
    gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, name_of(draw_framebuffer_));
  }
  if (get(GL_READ_FRAMEBUFFER_BINDING) != read_framebuffer_) {
    gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, name_of(read_framebuffer_));
  }
  for (GLuint unit = 0; unit < units; ++unit) {
    const TextureUnit& saved = texture_units_[unit];
    gl_->ActiveTexture(GL_TEXTURE0 + unit);
    for (std::size_t t = 0; t < targets; ++t) {
      if (get(texture_targets[t].binding) == saved.textures[t]) continue;
      const GLuint texture = name_of(saved.textures[t]);
      if (texture != 0 && gl_->IsTexture(texture) != GL_FALSE) {
        gl_->BindTextureUnit(unit, texture);  // never an error, not even if the name is of another target by now
      } else {
        gl_->BindTexture(texture_targets[t].target, 0);
      }
    }
    if (get(GL_SAMPLER_BINDING) != saved.sampler) {
      const GLuint sampler = name_of(saved.sampler);
      gl_->BindSampler(unit, gl_->IsSampler(sampler) != GL_FALSE ? sampler : 0);
    }
  }
  gl_->ActiveTexture(static_cast<GLenum>(active_texture_));
  for (GLuint i = 0; i < ranges; ++i) {
    restore_range(
        GL_SHADER_STORAGE_BUFFER, i, storage_[i],
        range(GL_SHADER_STORAGE_BUFFER_BINDING, GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE, i));
    restore_range(GL_UNIFORM_BUFFER, i, uniform_[i],
                  range(GL_UNIFORM_BUFFER_BINDING, GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, i));
  }
  const auto restore_buffer = [this](GLenum target, GLenum binding, GLint saved) {
    if (get(binding) == saved) return;
    gl_->BindBuffer(target, gl_->IsBuffer(name_of(saved)) != GL_FALSE ? name_of(saved) : 0);
  };
  restore_buffer(GL_SHADER_STORAGE_BUFFER, GL_SHADER_STORAGE_BUFFER_BINDING, storage_generic_);
  restore_buffer(GL_UNIFORM_BUFFER, GL_UNIFORM_BUFFER_BINDING, uniform_generic_);
  restore_buffer(GL_PIXEL_PACK_BUFFER, GL_PIXEL_PACK_BUFFER_BINDING, pack_buffer_);
  restore_buffer(GL_PIXEL_UNPACK_BUFFER, GL_PIXEL_UNPACK_BUFFER_BINDING, unpack_buffer_);
  for (GLuint i = 0; i < images; ++i) {
    const ImageUnit& saved = images_[i];
    if (saved == image(i)) continue;
    const GLuint texture = name_of(saved.name);
    // Some drivers tell no format of a unit that nothing was ever bound to.
    gl_->BindImageTexture(i, gl_->IsTexture(texture) != GL_FALSE ? texture : 0, saved.level,
                          saved.layered != 0 ? GL_TRUE : GL_FALSE, saved.layer,
                          static_cast<GLenum>(saved.access == 0 ? GL_READ_ONLY : saved.access),
                          static_cast<GLenum>(saved.format == 0 ? GL_R8 : saved.format));
  }
  for (std::size_t i = 0; i < pixel_parameters; ++i) gl_->PixelStorei(pixel_table[i].name, pixel_store_[i]);
}

void StateGuard::restore_raster() const {
  for (std::size_t i = 0; i < capabilities; ++i) enable(capability_table[i].name, enabled_[i] != GL_FALSE);
  for (GLuint i = 0; i < draw_buffer_count(); ++i) {
    const DrawBuffer& saved = draw_buffers_[i];
    gl_->ColorMaski(i, saved.mask[0], saved.mask[1], saved.mask[2], saved.mask[3]);
    if (saved.blend != GL_FALSE) {
      gl_->Enablei(GL_BLEND, i);
    } else {
      gl_->Disablei(GL_BLEND, i);
    }
  }
  gl_->ViewportIndexedfv(0, viewport_.data());
  gl_->ScissorIndexedv(0, scissor_box_.data());
  if (scissor_test_ != GL_FALSE) {
    gl_->Enablei(GL_SCISSOR_TEST, 0);
  } else {
    gl_->Disablei(GL_SCISSOR_TEST, 0);
  }
  gl_->DepthRangeIndexed(0, depth_range_[0], depth_range_[1]);
  gl_->DepthMask(depth_mask_);
  gl_->DepthFunc(static_cast<GLenum>(depth_function_));
  for (GLuint buffer = 0; buffer < blended_buffers; ++buffer) {
    const auto& [function, equation] = blends_[buffer];
    gl_->BlendFuncSeparatei(buffer, static_cast<GLenum>(function[0]), static_cast<GLenum>(function[1]),
                            static_cast<GLenum>(function[2]), static_cast<GLenum>(function[3]));
    gl_->BlendEquationSeparatei(buffer, static_cast<GLenum>(equation[0]), static_cast<GLenum>(equation[1]));
  }
  gl_->CullFace(static_cast<GLenum>(cull_face_));
  gl_->FrontFace(static_cast<GLenum>(front_face_));
  const auto front = static_cast<GLenum>(polygon_mode_[0]);
  const auto back = static_cast<GLenum>(polygon_mode_[1]);
  if (back == 0 || back == front) {
    gl_->PolygonMode(GL_FRONT_AND_BACK, front);
  } else {  // a compatibility context's
    gl_->PolygonMode(GL_FRONT, front);
    gl_->PolygonMode(GL_BACK, back);
  }
  gl_->ClipControl(static_cast<GLenum>(clip_origin_), static_cast<GLenum>(clip_depth_));
}

}  // namespace cumulet::gl
