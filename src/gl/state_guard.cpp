#include "gl/state_guard.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "base/error.hpp"

namespace cumulet::gl {

namespace {

struct TextureTarget {
  GLenum target, binding;
};
constexpr std::array<TextureTarget, 11> texture_targets{
    {{GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D},
     {GL_TEXTURE_2D_ARRAY, GL_TEXTURE_BINDING_2D_ARRAY},
     {GL_TEXTURE_2D_MULTISAMPLE, GL_TEXTURE_BINDING_2D_MULTISAMPLE},
     {GL_TEXTURE_3D, GL_TEXTURE_BINDING_3D},
     {GL_TEXTURE_BUFFER, GL_TEXTURE_BINDING_BUFFER},
     {GL_TEXTURE_1D, GL_TEXTURE_BINDING_1D},
     {GL_TEXTURE_1D_ARRAY, GL_TEXTURE_BINDING_1D_ARRAY},
     {GL_TEXTURE_RECTANGLE, GL_TEXTURE_BINDING_RECTANGLE},
     {GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BINDING_CUBE_MAP},
     {GL_TEXTURE_CUBE_MAP_ARRAY, GL_TEXTURE_BINDING_CUBE_MAP_ARRAY},
     {GL_TEXTURE_2D_MULTISAMPLE_ARRAY, GL_TEXTURE_BINDING_2D_MULTISAMPLE_ARRAY}}};

/// Returns the index of a target in the table, or the table's size if there is none.
std::size_t index_of(GLenum target) {
  const auto* found = std::ranges::find(texture_targets, target, &TextureTarget::target);
  return static_cast<std::size_t>(found - texture_targets.begin());
}

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
  GLenum pack, unpack;
  GLint known = 0;
};
constexpr std::array<PixelParameter, 12> pixel_table{
    {{GL_PACK_SWAP_BYTES, GL_UNPACK_SWAP_BYTES},
     {GL_PACK_LSB_FIRST, GL_UNPACK_LSB_FIRST},
     {GL_PACK_ROW_LENGTH, GL_UNPACK_ROW_LENGTH},
     {GL_PACK_IMAGE_HEIGHT, GL_UNPACK_IMAGE_HEIGHT},
     {GL_PACK_SKIP_PIXELS, GL_UNPACK_SKIP_PIXELS},
     {GL_PACK_SKIP_ROWS, GL_UNPACK_SKIP_ROWS},
     {GL_PACK_SKIP_IMAGES, GL_UNPACK_SKIP_IMAGES},
     {GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT, 4},
     {GL_PACK_COMPRESSED_BLOCK_WIDTH, GL_UNPACK_COMPRESSED_BLOCK_WIDTH},
     {GL_PACK_COMPRESSED_BLOCK_HEIGHT, GL_UNPACK_COMPRESSED_BLOCK_HEIGHT},
     {GL_PACK_COMPRESSED_BLOCK_DEPTH, GL_UNPACK_COMPRESSED_BLOCK_DEPTH},
     {GL_PACK_COMPRESSED_BLOCK_SIZE, GL_UNPACK_COMPRESSED_BLOCK_SIZE}}};

constexpr std::array<GLenum, 4> blend_functions{GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB, GL_BLEND_SRC_ALPHA,
                                                GL_BLEND_DST_ALPHA};
constexpr std::array<GLenum, 2> blend_equations{GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA};

/// Converts a name or an enumerator from glGet.
GLuint name_of(GLint value) { return static_cast<GLuint>(value); }

GLboolean as_boolean(bool value) { return value ? GL_TRUE : GL_FALSE; }

/// Checks against the ranges that cumulet.h documents for a frame.
void require_within(GLuint index, GLuint count, const char* what) {
  if (index >= count) throw Error(ErrorCode::internal, std::string(what) + " is not among the saved ones");
}

}  // namespace

StateGuard::StateGuard(const Functions& gl, bool restore)
    : gl_(&gl), restore_(restore), outer_(std::exchange(gl.guard, this)), compatibility_(gl, restore) {
  static_assert(texture_targets.size() == targets && capability_table.size() == capabilities &&
                pixel_table.size() == pixel_parameters);
  if (outer_ == nullptr) gl.debug_group_room.reset();
}

StateGuard::~StateGuard() {
  gl_->guard = outer_;
  if (!restore_) return;
  restore_bindings();
  restore_textures();
  restore_ranges(GL_SHADER_STORAGE_BUFFER);
  restore_ranges(GL_UNIFORM_BUFFER);
  restore_dispatch_indirect();
  restore_images();
  restore_pixels();
  restore_raster();
  compatibility_.restore();
}

GLint StateGuard::get(GLenum name) const {
  GLint value = 0;
  if (restore_) gl_->GetIntegerv(name, &value);
  return value;
}

void StateGuard::enable(GLenum capability, bool on) const {
  if (on) {
    plain().Enable(capability);
  } else {
    plain().Disable(capability);
  }
}

// ---- bindings ----

void StateGuard::program() {
  if (program_.use()) program_.value = get(GL_CURRENT_PROGRAM);
}

void StateGuard::pipeline() {
  if (pipeline_.use()) pipeline_.value = get(GL_PROGRAM_PIPELINE_BINDING);
}

void StateGuard::vertex_array() {
  if (vertex_array_.use()) vertex_array_.value = get(GL_VERTEX_ARRAY_BINDING);
}

void StateGuard::draw_framebuffer() {
  if (draw_framebuffer_.use()) draw_framebuffer_.value = get(GL_DRAW_FRAMEBUFFER_BINDING);
}

void StateGuard::read_framebuffer() {
  if (read_framebuffer_.use()) read_framebuffer_.value = get(GL_READ_FRAMEBUFFER_BINDING);
}

void StateGuard::active_texture() {
  if (!active_texture_.use()) return;
  if (!restore_) {
    if (gl_->compatibility) plain().ActiveTexture(GL_TEXTURE0 + active_unit_);  // units have state besides bindings
    return;
  }
  active_texture_.value = get(GL_ACTIVE_TEXTURE);
  active_unit_ = name_of(active_texture_.value) - GL_TEXTURE0;
}

void StateGuard::texture(GLuint unit, std::size_t target) {
  require_within(unit, units, "a texture unit");
  sampler(unit);
  Saved<GLint>& saved = textures_[unit][target];
  if (!saved.use() || !restore_) return;
  active_texture();
  if (unit != active_unit_) plain().ActiveTexture(GL_TEXTURE0 + unit);
  saved.value = get(texture_targets[target].binding);
  if (unit != active_unit_) plain().ActiveTexture(GL_TEXTURE0 + active_unit_);
}

void StateGuard::textures(GLuint unit, GLuint name) {
  const std::size_t target = index_of(gl_->target_of(name));
  if (target < targets) {
    texture(unit, target);
    return;
  }
  // A texture of the host, or 0, which unbinds all targets.
  for (std::size_t t = 0; t < targets; ++t) texture(unit, t);
}

void StateGuard::bound_texture(GLenum target) {
  active_texture();
  texture(active_unit_, index_of(target));
}

void StateGuard::sampler(GLuint unit) {
  require_within(unit, units, "a sampler");
  if (!samplers_[unit].use()) return;
  if (restore_ || gl_->compatibility) {
    active_texture();
    if (unit != active_unit_) plain().ActiveTexture(GL_TEXTURE0 + unit);
    samplers_[unit].value = get(GL_SAMPLER_BINDING);
    compatibility_.prepare_unit(unit);
    if (unit != active_unit_) plain().ActiveTexture(GL_TEXTURE0 + active_unit_);
  }
  if (samplers_[unit].value != 0 || !restore_) plain().BindSampler(unit, 0);
}

void StateGuard::buffer(GLenum target) {
  switch (target) {
    case GL_SHADER_STORAGE_BUFFER:
      if (storage_generic_.use()) storage_generic_.value = get(GL_SHADER_STORAGE_BUFFER_BINDING);
      break;
    case GL_UNIFORM_BUFFER:
      if (uniform_generic_.use()) uniform_generic_.value = get(GL_UNIFORM_BUFFER_BINDING);
      break;
    case GL_DISPATCH_INDIRECT_BUFFER:
      if (dispatch_indirect_.use()) dispatch_indirect_.value = get(GL_DISPATCH_INDIRECT_BUFFER_BINDING);
      break;
    case GL_PIXEL_PACK_BUFFER:
      pixels(true);
      break;
    case GL_PIXEL_UNPACK_BUFFER:
      pixels(false);
      break;
    default:
      throw Error(ErrorCode::internal, "an unsaved buffer binding");
  }
}

void StateGuard::range(GLenum target, GLuint index) {
  require_within(index, ranges, "a buffer binding");
  buffer(target);
  const bool storage = target == GL_SHADER_STORAGE_BUFFER;
  Saved<BufferRange>& saved = (storage ? storage_ : uniform_)[index];
  if (!saved.use() || !restore_) return;
  gl_->GetIntegeri_v(storage ? GL_SHADER_STORAGE_BUFFER_BINDING : GL_UNIFORM_BUFFER_BINDING, index,
                     &saved.value.buffer);
  if (saved.value.buffer == 0) return;  // then it has no range
  gl_->GetInteger64i_v(storage ? GL_SHADER_STORAGE_BUFFER_START : GL_UNIFORM_BUFFER_START, index, &saved.value.offset);
  gl_->GetInteger64i_v(storage ? GL_SHADER_STORAGE_BUFFER_SIZE : GL_UNIFORM_BUFFER_SIZE, index, &saved.value.size);
}

void StateGuard::image(GLuint unit) {
  require_within(unit, images, "an image unit");
  if (!images_[unit].use() || !restore_) return;
  ImageUnit& saved = images_[unit].value;
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_NAME, unit, &saved.name);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LEVEL, unit, &saved.level);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LAYERED, unit, &saved.layered);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_LAYER, unit, &saved.layer);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_ACCESS, unit, &saved.access);
  gl_->GetIntegeri_v(GL_IMAGE_BINDING_FORMAT, unit, &saved.format);
}

// ---- pixels ----

void StateGuard::pixels(bool pack) {
  Saved<Pixels>& saved = pack ? pack_ : unpack_;
  if (!saved.use()) return;
  saved.value.buffer = get(pack ? GL_PIXEL_PACK_BUFFER_BINDING : GL_PIXEL_UNPACK_BUFFER_BINDING);
  for (std::size_t i = 0; i < pixel_parameters; ++i) {
    saved.value.parameters[i] = get(pack ? pixel_table[i].pack : pixel_table[i].unpack);
  }
  if (pack) saved.value.read_clamp = get(GL_CLAMP_READ_COLOR);
  set_pixels(pack);
  compatibility_.prepare_pixels();
}

void StateGuard::set_pixels(bool pack) const {
  plain().BindBuffer(pack ? GL_PIXEL_PACK_BUFFER : GL_PIXEL_UNPACK_BUFFER, 0);
  for (const PixelParameter& p : pixel_table) plain().PixelStorei(pack ? p.pack : p.unpack, p.known);
  if (pack) plain().ClampColor(GL_CLAMP_READ_COLOR, GL_FALSE);
}

// ---- raster ----

void StateGuard::raster() {
  if (!raster_.use()) return;
  if (restore_) {
    Raster& saved = raster_.value;
    for (std::size_t i = 0; i < capabilities; ++i) {
      saved.enabled[i] = gl_->IsEnabled(capability_table[i].name) != GL_FALSE;
    }
    for (GLuint i = 0; i < gl_->draw_buffers; ++i) {
      gl_->GetBooleani_v(GL_COLOR_WRITEMASK, i, saved.masks[i].data());
    }
    saved.scissor = gl_->IsEnabledi(GL_SCISSOR_TEST, 0) != GL_FALSE;
    gl_->GetIntegerv(GL_POLYGON_MODE, saved.polygon_mode.data());
    saved.clip_origin = get(GL_CLIP_ORIGIN);
    saved.clip_depth = get(GL_CLIP_DEPTH_MODE);
    enabled_ = saved.enabled;
  } else {
    for (std::size_t i = 0; i < capabilities; ++i) enabled_[i] = !capability_table[i].known;  // so that each is set
  }
  blend_enable(0);
  set_raster();
  compatibility_.prepare_fragments();
}

void StateGuard::set_raster() {
  for (std::size_t i = 0; i < capabilities; ++i) {
    if (std::exchange(enabled_[i], capability_table[i].known) != capability_table[i].known) {
      enable(capability_table[i].name, capability_table[i].known);
    }
  }
  for (GLuint i = 0; i < gl_->draw_buffers; ++i) {
    const GLboolean write = as_boolean(i == 0);
    plain().ColorMaski(i, write, write, write, write);
  }
  plain().Disablei(GL_SCISSOR_TEST, 0);
  plain().PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  plain().ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
}

void StateGuard::capability(GLenum name, bool on) {
  raster();
  const auto* found = std::ranges::find(capability_table, name, &Capability::name);
  if (found == capability_table.end()) throw Error(ErrorCode::internal, "an unsaved capability");
  enabled_[static_cast<std::size_t>(found - capability_table.begin())] = on;
  if (on && name == GL_DEPTH_TEST) depth();
  if (on && name == GL_CULL_FACE) cull();
}

void StateGuard::blend_enable(GLuint buffer) {
  require_within(buffer, max_draw_buffers, "a draw buffer");
  if (!blend_enables_[buffer].use()) return;
  if (restore_) blend_enables_[buffer].value = gl_->IsEnabledi(GL_BLEND, buffer) != GL_FALSE;
  if (blend_enables_[buffer].value || !restore_) plain().Disablei(GL_BLEND, buffer);
}

void StateGuard::blend(GLuint buffer) {
  require_within(buffer, blended_buffers, "a blended draw buffer");
  if (!blends_[buffer].use()) return;
  if (restore_) {
    Blend& saved = blends_[buffer].value;
    for (std::size_t i = 0; i < blend_functions.size(); ++i) {
      gl_->GetIntegeri_v(blend_functions[i], buffer, &saved.function[i]);
    }
    for (std::size_t i = 0; i < blend_equations.size(); ++i) {
      gl_->GetIntegeri_v(blend_equations[i], buffer, &saved.equation[i]);
    }
  }
  set_blend(buffer);
}

void StateGuard::set_blend(GLuint buffer) const {
  plain().BlendFuncSeparatei(buffer, GL_ONE, GL_ZERO, GL_ONE, GL_ZERO);
  plain().BlendEquationSeparatei(buffer, GL_FUNC_ADD, GL_FUNC_ADD);
}

void StateGuard::depth() {
  if (!depth_.use()) return;
  if (restore_) {
    gl_->GetBooleanv(GL_DEPTH_WRITEMASK, &depth_.value.mask);
    depth_.value.function = get(GL_DEPTH_FUNC);
    gl_->GetDoublei_v(GL_DEPTH_RANGE, 0, depth_.value.range.data());
  }
  set_depth();
}

void StateGuard::set_depth() const {
  plain().DepthMask(GL_TRUE);
  plain().DepthFunc(GL_LESS);
  plain().DepthRangeIndexed(0, 0.0, 1.0);
}

void StateGuard::cull() {
  if (!cull_.use()) return;
  cull_.value = {get(GL_CULL_FACE_MODE), get(GL_FRONT_FACE)};
  set_cull();
}

void StateGuard::set_cull() const {
  plain().CullFace(GL_BACK);
  plain().FrontFace(GL_CCW);
}

void StateGuard::viewport() {
  if (viewport_.use() && restore_) gl_->GetFloati_v(GL_VIEWPORT, 0, viewport_.value.data());
}

void StateGuard::scissor_box() {
  if (scissor_box_.use() && restore_) gl_->GetIntegeri_v(GL_SCISSOR_BOX, 0, scissor_box_.value.data());
}

void StateGuard::set_known() {
  for (GLuint unit = 0; unit < units; ++unit) {
    if (samplers_[unit].used) plain().BindSampler(unit, 0);
  }
  if (pack_.used) set_pixels(true);
  if (unpack_.used) set_pixels(false);
  if (raster_.used) set_raster();
  for (GLuint i = 0; i < max_draw_buffers; ++i) {
    if (blend_enables_[i].used) plain().Disablei(GL_BLEND, i);
  }
  for (GLuint i = 0; i < blended_buffers; ++i) {
    if (blends_[i].used) set_blend(i);
  }
  if (depth_.used) set_depth();
  if (cull_.used) set_cull();
}

// ---- restore ----

void StateGuard::restore_bindings() const {
  const auto& gl = plain();
  if (program_.used) {
    const GLuint program = name_of(program_.value);
    GLint linked = 0;
    if (program != 0 && gl.IsProgram(program) != GL_FALSE) gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
    gl.UseProgram(linked != 0 ? program : 0);
  }
  if (pipeline_.used) gl.BindProgramPipeline(name_of(pipeline_.value));
  if (vertex_array_.used) gl.BindVertexArray(name_of(vertex_array_.value));
  if (draw_framebuffer_.used) gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, name_of(draw_framebuffer_.value));
  if (read_framebuffer_.used) gl.BindFramebuffer(GL_READ_FRAMEBUFFER, name_of(read_framebuffer_.value));
}

void StateGuard::restore_textures() const {
  const auto& gl = plain();
  for (GLuint unit = 0; unit < units; ++unit) {
    for (std::size_t t = 0; t < targets; ++t) {
      if (!textures_[unit][t].used) continue;
      const GLuint texture = name_of(textures_[unit][t].value);
      // Unbind the library's texture first: `texture` may have another target by now.
      gl.ActiveTexture(GL_TEXTURE0 + unit);
      gl.BindTexture(texture_targets[t].target, 0);
      if (texture != 0 && gl.IsTexture(texture) != GL_FALSE) gl.BindTextureUnit(unit, texture);
    }
    if (samplers_[unit].used) {
      const GLuint sampler = name_of(samplers_[unit].value);
      gl.BindSampler(unit, sampler != 0 && gl.IsSampler(sampler) != GL_FALSE ? sampler : 0);
      compatibility_.restore_unit(unit);
    }
  }
  if (active_texture_.used) gl.ActiveTexture(name_of(active_texture_.value));
}

void StateGuard::restore_ranges(GLenum target) const {
  const auto& gl = plain();
  const bool storage = target == GL_SHADER_STORAGE_BUFFER;
  const auto& saved = storage ? storage_ : uniform_;
  const auto alive = [&gl](GLuint buffer) { return buffer != 0 && gl.IsBuffer(buffer) != GL_FALSE; };
  for (GLuint i = 0; i < ranges; ++i) {
    if (!saved[i].used) continue;
    const BufferRange& range = saved[i].value;
    const GLuint buffer = name_of(range.buffer);
    if (!alive(buffer)) {
      gl.BindBufferBase(target, i, 0);
    } else if (range.size == 0) {
      gl.BindBufferBase(target, i, buffer);
    } else {
      gl.BindBufferRange(target, i, buffer, static_cast<GLintptr>(range.offset), static_cast<GLsizeiptr>(range.size));
    }
  }
  const Saved<GLint>& generic = storage ? storage_generic_ : uniform_generic_;
  if (generic.used) gl.BindBuffer(target, alive(name_of(generic.value)) ? name_of(generic.value) : 0);
}

void StateGuard::restore_dispatch_indirect() const {
  if (!dispatch_indirect_.used) return;
  const GLuint buffer = name_of(dispatch_indirect_.value);
  plain().BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer != 0 && plain().IsBuffer(buffer) != GL_FALSE ? buffer : 0);
}

void StateGuard::restore_images() const {
  const auto& gl = plain();
  for (GLuint i = 0; i < images; ++i) {
    if (!images_[i].used) continue;
    const ImageUnit& saved = images_[i].value;
    const GLuint texture = name_of(saved.name);
    // Some drivers return no format for a unit that nothing was ever bound to.
    gl.BindImageTexture(i, texture != 0 && gl.IsTexture(texture) != GL_FALSE ? texture : 0, saved.level,
                        as_boolean(saved.layered != 0), saved.layer,
                        name_of(saved.access == 0 ? GL_READ_ONLY : saved.access),
                        name_of(saved.format == 0 ? GL_R8 : saved.format));
  }
}

void StateGuard::restore_pixels() const {
  const auto& gl = plain();
  for (const bool pack : {true, false}) {
    const Saved<Pixels>& saved = pack ? pack_ : unpack_;
    if (!saved.used) continue;
    const GLuint buffer = name_of(saved.value.buffer);
    gl.BindBuffer(pack ? GL_PIXEL_PACK_BUFFER : GL_PIXEL_UNPACK_BUFFER,
                  buffer != 0 && gl.IsBuffer(buffer) != GL_FALSE ? buffer : 0);
    for (std::size_t i = 0; i < pixel_parameters; ++i) {
      gl.PixelStorei(pack ? pixel_table[i].pack : pixel_table[i].unpack, saved.value.parameters[i]);
    }
    if (pack) gl.ClampColor(GL_CLAMP_READ_COLOR, name_of(saved.value.read_clamp));
  }
}

void StateGuard::restore_raster() const {
  const auto& gl = plain();
  if (raster_.used) {
    const Raster& saved = raster_.value;
    for (std::size_t i = 0; i < capabilities; ++i) {
      if (enabled_[i] != saved.enabled[i]) enable(capability_table[i].name, saved.enabled[i]);
    }
    for (GLuint i = 0; i < gl_->draw_buffers; ++i) {
      const auto& mask = saved.masks[i];
      gl.ColorMaski(i, mask[0], mask[1], mask[2], mask[3]);
    }
    if (saved.scissor) {
      gl.Enablei(GL_SCISSOR_TEST, 0);
    } else {
      gl.Disablei(GL_SCISSOR_TEST, 0);
    }
    const GLenum front = name_of(saved.polygon_mode[0]);
    const GLenum back = name_of(saved.polygon_mode[1]);
    if (back == 0 || back == front) {
      gl.PolygonMode(GL_FRONT_AND_BACK, front);
    } else {  // compatibility contexts only
      gl.PolygonMode(GL_FRONT, front);
      gl.PolygonMode(GL_BACK, back);
    }
    gl.ClipControl(name_of(saved.clip_origin), name_of(saved.clip_depth));
  }
  for (GLuint i = 0; i < max_draw_buffers; ++i) {
    if (!blend_enables_[i].used) continue;
    if (blend_enables_[i].value) {
      gl.Enablei(GL_BLEND, i);
    } else {
      gl.Disablei(GL_BLEND, i);
    }
  }
  for (GLuint i = 0; i < blended_buffers; ++i) {
    if (!blends_[i].used) continue;
    const auto& [function, equation] = blends_[i].value;
    gl.BlendFuncSeparatei(i, name_of(function[0]), name_of(function[1]), name_of(function[2]), name_of(function[3]));
    gl.BlendEquationSeparatei(i, name_of(equation[0]), name_of(equation[1]));
  }
  if (depth_.used) {
    gl.DepthMask(depth_.value.mask);
    gl.DepthFunc(name_of(depth_.value.function));
    gl.DepthRangeIndexed(0, depth_.value.range[0], depth_.value.range[1]);
  }
  if (cull_.used) {
    gl.CullFace(name_of(cull_.value.mode));
    gl.FrontFace(name_of(cull_.value.front));
  }
  if (viewport_.used) gl.ViewportIndexedfv(0, viewport_.value.data());
  if (scissor_box_.used) gl.ScissorIndexedv(0, scissor_box_.value.data());
}

// ---- functions that notify the guard ----

void Functions::UseProgram(GLuint program) const {
  if (guard != nullptr) guard->program();
  GladGLContext::UseProgram(program);
}

void Functions::BindProgramPipeline(GLuint pipeline) const {
  if (guard != nullptr) guard->pipeline();
  GladGLContext::BindProgramPipeline(pipeline);
}

void Functions::BindVertexArray(GLuint array) const {
  if (guard != nullptr) guard->vertex_array();
  GladGLContext::BindVertexArray(array);
}

void Functions::BindFramebuffer(GLenum target, GLuint framebuffer) const {
  if (guard != nullptr) {
    if (target != GL_READ_FRAMEBUFFER) guard->draw_framebuffer();
    if (target != GL_DRAW_FRAMEBUFFER) guard->read_framebuffer();
  }
  GladGLContext::BindFramebuffer(target, framebuffer);
}

void Functions::ActiveTexture(GLenum unit) const {
  if (guard != nullptr) {
    guard->active_texture();
    guard->active_unit_ = unit - GL_TEXTURE0;
  }
  GladGLContext::ActiveTexture(unit);
}

void Functions::BindTexture(GLenum target, GLuint texture) const {
  if (guard != nullptr) guard->bound_texture(target);
  GladGLContext::BindTexture(target, texture);
}

void Functions::BindTextureUnit(GLuint unit, GLuint texture) const {
  if (guard != nullptr) guard->textures(unit, texture);
  GladGLContext::BindTextureUnit(unit, texture);
}

void Functions::BindTextureUnit(GLuint unit, GLuint texture, GLenum target) const {
  if (guard != nullptr) guard->texture(unit, index_of(target));
  GladGLContext::BindTextureUnit(unit, texture);
}

void Functions::BindSampler(GLuint unit, GLuint sampler) const {
  if (guard != nullptr) guard->sampler(unit);
  GladGLContext::BindSampler(unit, sampler);
}

void Functions::BindBuffer(GLenum target, GLuint buffer) const {
  if (guard != nullptr) guard->buffer(target);
  GladGLContext::BindBuffer(target, buffer);
}

void Functions::BindBufferBase(GLenum target, GLuint index, GLuint buffer) const {
  if (guard != nullptr) guard->range(target, index);
  GladGLContext::BindBufferBase(target, index, buffer);
}

void Functions::BindBufferRange(GLenum target, GLuint index, GLuint buffer, GLintptr offset, GLsizeiptr size) const {
  if (guard != nullptr) guard->range(target, index);
  GladGLContext::BindBufferRange(target, index, buffer, offset, size);
}

void Functions::BindImageTexture(GLuint unit, GLuint texture, GLint level, GLboolean layered, GLint layer,
                                 GLenum access, GLenum format) const {
  if (guard != nullptr) guard->image(unit);
  GladGLContext::BindImageTexture(unit, texture, level, layered, layer, access, format);
}

void Functions::PixelStorei(GLenum name, GLint value) const {
  if (guard != nullptr) guard->pixels(std::ranges::find(pixel_table, name, &PixelParameter::pack) != pixel_table.end());
  GladGLContext::PixelStorei(name, value);
}

void Functions::ClearTexImage(GLuint texture, GLint level, GLenum format, GLenum type, const void* data) const {
  if (guard != nullptr) guard->pixels(false);
  GladGLContext::ClearTexImage(texture, level, format, type, data);
}

void Functions::ClearTexSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width, GLsizei height,
                                 GLsizei depth, GLenum format, GLenum type, const void* data) const {
  if (guard != nullptr) guard->pixels(false);
  GladGLContext::ClearTexSubImage(texture, level, x, y, z, width, height, depth, format, type, data);
}

void Functions::TextureSubImage2D(GLuint texture, GLint level, GLint x, GLint y, GLsizei width, GLsizei height,
                                  GLenum format, GLenum type, const void* pixels) const {
  if (guard != nullptr) guard->pixels(false);
  GladGLContext::TextureSubImage2D(texture, level, x, y, width, height, format, type, pixels);
}

void Functions::TextureSubImage3D(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width, GLsizei height,
                                  GLsizei depth, GLenum format, GLenum type, const void* pixels) const {
  if (guard != nullptr) guard->pixels(false);
  GladGLContext::TextureSubImage3D(texture, level, x, y, z, width, height, depth, format, type, pixels);
}

void Functions::GetTextureImage(GLuint texture, GLint level, GLenum format, GLenum type, GLsizei bytes,
                                void* pixels) const {
  if (guard != nullptr) guard->pixels(true);
  GladGLContext::GetTextureImage(texture, level, format, type, bytes, pixels);
}

void Functions::GetTextureSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width,
                                   GLsizei height, GLsizei depth, GLenum format, GLenum type, GLsizei bytes,
                                   void* pixels) const {
  if (guard != nullptr) guard->pixels(true);
  GladGLContext::GetTextureSubImage(texture, level, x, y, z, width, height, depth, format, type, bytes, pixels);
}

void Functions::Enable(GLenum capability) const {
  if (guard != nullptr) guard->capability(capability, true);
  GladGLContext::Enable(capability);
}

void Functions::Disable(GLenum capability) const {
  if (guard != nullptr) guard->capability(capability, false);
  GladGLContext::Disable(capability);
}

void Functions::Enablei(GLenum capability, GLuint index) const {
  if (guard != nullptr) {
    guard->raster();
    if (capability == GL_BLEND) {
      guard->blend_enable(index);
      if (index < StateGuard::blended_buffers) guard->blend(index);
    }
  }
  GladGLContext::Enablei(capability, index);
}

void Functions::Disablei(GLenum capability, GLuint index) const {
  if (guard != nullptr) {
    guard->raster();
    if (capability == GL_BLEND) guard->blend_enable(index);
  }
  GladGLContext::Disablei(capability, index);
}

void Functions::ColorMaski(GLuint buffer, GLboolean r, GLboolean g, GLboolean b, GLboolean a) const {
  if (guard != nullptr) {
    guard->raster();
    guard->blend_enable(buffer);
  }
  GladGLContext::ColorMaski(buffer, r, g, b, a);
}

void Functions::BlendFuncSeparatei(GLuint buffer, GLenum from, GLenum to, GLenum from_alpha, GLenum to_alpha) const {
  if (guard != nullptr) guard->blend(buffer);
  GladGLContext::BlendFuncSeparatei(buffer, from, to, from_alpha, to_alpha);
}

void Functions::BlendEquationSeparatei(GLuint buffer, GLenum color, GLenum alpha) const {
  if (guard != nullptr) guard->blend(buffer);
  GladGLContext::BlendEquationSeparatei(buffer, color, alpha);
}

void Functions::DepthMask(GLboolean write) const {
  if (guard != nullptr) guard->depth();
  GladGLContext::DepthMask(write);
}

void Functions::DepthFunc(GLenum function) const {
  if (guard != nullptr) guard->depth();
  GladGLContext::DepthFunc(function);
}

void Functions::DepthRangeIndexed(GLuint index, GLdouble near, GLdouble far) const {
  if (guard != nullptr) guard->depth();
  GladGLContext::DepthRangeIndexed(index, near, far);
}

void Functions::CullFace(GLenum mode) const {
  if (guard != nullptr) guard->cull();
  GladGLContext::CullFace(mode);
}

void Functions::FrontFace(GLenum mode) const {
  if (guard != nullptr) guard->cull();
  GladGLContext::FrontFace(mode);
}

void Functions::PolygonMode(GLenum face, GLenum mode) const {
  if (guard != nullptr) guard->raster();
  GladGLContext::PolygonMode(face, mode);
}

void Functions::ClipControl(GLenum origin, GLenum depth) const {
  if (guard != nullptr) guard->raster();
  GladGLContext::ClipControl(origin, depth);
}

void Functions::ViewportIndexedf(GLuint index, GLfloat x, GLfloat y, GLfloat width, GLfloat height) const {
  if (guard != nullptr) guard->viewport();
  GladGLContext::ViewportIndexedf(index, x, y, width, height);
}

void Functions::ScissorIndexed(GLuint index, GLint left, GLint bottom, GLsizei width, GLsizei height) const {
  if (guard != nullptr) guard->scissor_box();
  GladGLContext::ScissorIndexed(index, left, bottom, width, height);
}

void Functions::DrawArrays(GLenum mode, GLint first, GLsizei count) const {
  if (guard != nullptr) guard->raster();
  GladGLContext::DrawArrays(mode, first, count);
}

void Functions::DrawElementsInstancedBaseInstance(GLenum mode, GLsizei count, GLenum type, const void* indices,
                                                  GLsizei instances, GLuint first) const {
  if (guard != nullptr) guard->raster();
  GladGLContext::DrawElementsInstancedBaseInstance(mode, count, type, indices, instances, first);
}

void Functions::ClearNamedFramebufferfv(GLuint framebuffer, GLenum buffer, GLint index, const GLfloat* value) const {
  if (guard != nullptr) {
    guard->raster();
    if (buffer == GL_DEPTH) guard->depth();
  }
  GladGLContext::ClearNamedFramebufferfv(framebuffer, buffer, index, value);
}

void Functions::BlitNamedFramebuffer(GLuint from, GLuint to, GLint x0, GLint y0, GLint x1, GLint y1, GLint u0, GLint v0,
                                     GLint u1, GLint v1, GLbitfield mask, GLenum filter) const {
  if (guard != nullptr) guard->raster();
  GladGLContext::BlitNamedFramebuffer(from, to, x0, y0, x1, y1, u0, v0, u1, v1, mask, filter);
}

void Functions::CreateTextures(GLenum target, GLsizei count, GLuint* names) const {
  GladGLContext::CreateTextures(target, count, names);
  for (GLsizei i = 0; i < count; ++i) texture_targets_[names[i]] = target;
}

void Functions::DeleteTextures(GLsizei count, const GLuint* names) const {
  for (GLsizei i = 0; i < count; ++i) texture_targets_.erase(names[i]);
  GladGLContext::DeleteTextures(count, names);
}

GLenum Functions::target_of(GLuint texture) const {
  const auto found = texture_targets_.find(texture);
  return found == texture_targets_.end() ? 0 : found->second;
}

}  // namespace cumulet::gl
