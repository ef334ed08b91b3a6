#include "render/raster/host_depth.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "base/error.hpp"
#include "gl/bindings.hpp"
#include "shader_macros.hpp"

namespace cumulet::render {

namespace {

constexpr int max_layers = 8;

[[noreturn]] void refuse(const HostDepthInput& input, const std::string& cause) {
  const char* kind = input.source == DepthSource::framebuffer ? "framebuffer " : "texture ";
  throw Error(ErrorCode::invalid_argument, "host depth, " + (kind + std::to_string(input.name)) + ", " + cause);
}

/// Returns the corner of the viewport in a depth image of that size.
glm::ivec2 origin_in(const HostDepthInput& input, glm::ivec2 size) {
  const glm::ivec2 corner(input.viewport.x, input.viewport.y);
  const glm::ivec2 extent(input.viewport.z, input.viewport.w);
  if (size == extent) return glm::ivec2(0);
  const glm::ivec2 end = corner + extent;
  if (std::min(corner.x, corner.y) < 0 || end.x > size.x || end.y > size.y) {
    const auto text = [](glm::ivec2 v) { return std::to_string(v.x) + "x" + std::to_string(v.y); };
    refuse(input, "is " + text(size) + " and does not contain the viewport, " + text(extent) + " at " +
                      std::to_string(corner.x) + "," + std::to_string(corner.y));
  }
  return corner;
}

struct DepthBits {
  GLint depth = 0;
  GLint stencil = 0;
  GLint type = GL_UNSIGNED_NORMALIZED;
};

/// Returns the format for a copy: depth blits need equal formats.
GLenum format_of(const DepthBits& bits) {
  const bool stencil = bits.stencil > 0;
  if (bits.type == GL_FLOAT) return stencil ? GL_DEPTH32F_STENCIL8 : GL_DEPTH_COMPONENT32F;
  if (bits.depth <= 16) return GL_DEPTH_COMPONENT16;
  if (bits.depth > 24) return GL_DEPTH_COMPONENT32;
  return stencil ? GL_DEPTH24_STENCIL8 : GL_DEPTH_COMPONENT24;
}

struct TextureLevel {
  glm::ivec2 size{0};
  DepthBits bits;
  GLint red_type = GL_NONE;
};

TextureLevel level_of(const gl::Functions& gl, GLuint texture, GLint level) {
  TextureLevel result;
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_WIDTH, &result.size.x);
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_HEIGHT, &result.size.y);
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_DEPTH_SIZE, &result.bits.depth);
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_STENCIL_SIZE, &result.bits.stencil);
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_DEPTH_TYPE, &result.bits.type);
  gl.GetTextureLevelParameteriv(texture, level, GL_TEXTURE_RED_TYPE, &result.red_type);
  return result;
}

/// Returns whether a fetch would return something other than the depth of level 0.
bool is_remapped(const gl::Functions& gl, GLuint texture) {
  GLint mode = 0;
  GLint swizzle = 0;
  GLint level = 0;
  gl.GetTextureParameteriv(texture, GL_DEPTH_STENCIL_TEXTURE_MODE, &mode);
  gl.GetTextureParameteriv(texture, GL_TEXTURE_SWIZZLE_R, &swizzle);
  gl.GetTextureParameteriv(texture, GL_TEXTURE_BASE_LEVEL, &level);
  return mode == GL_STENCIL_INDEX || swizzle != GL_RED || level != 0;
}

}  // namespace

HostDepth::Source HostDepth::copy(GLuint framebuffer, GLenum format, int samples, glm::ivec4 rectangle) {
  const glm::ivec2 size(rectangle.z, rectangle.w);
  if (!copy_ || size != copy_size_ || format != copy_format_ || samples != copy_samples_) {
    copy_ = {};
    constexpr const char* what = "creating a copy of the host's depth";
    copy_ = samples > 0 ? gl::make_texture_2d_multisample(gl_, format, samples, size.x, size.y, what)
                        : gl::make_texture_2d(gl_, format, size.x, size.y, what);
    copy_size_ = size;
    copy_format_ = format;
    copy_samples_ = samples;
  }
  const bool stencil = format == GL_DEPTH24_STENCIL8 || format == GL_DEPTH32F_STENCIL8;
  const gl::Object own = gl::make_framebuffer(gl_);
  gl_->NamedFramebufferTexture(own.name(), stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT, copy_.name(),
                               0);
  gl_->NamedFramebufferDrawBuffer(own.name(), GL_NONE);
  gl_->NamedFramebufferReadBuffer(own.name(), GL_NONE);
  const glm::ivec2 corner(rectangle.x, rectangle.y);
  const glm::ivec2 end = corner + size;
  gl_->BlitNamedFramebuffer(framebuffer, own.name(), corner.x, corner.y, end.x, end.y, 0, 0, size.x, size.y,
                            GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  gl::check(*gl_, "copying the host's depth");
  return {copy_.name(), samples, glm::ivec2(0)};
}

HostDepth::Source HostDepth::open_texture(const HostDepthInput& input) {
  const auto& gl = *gl_;
  const bool multisample = input.source == DepthSource::texture_multisample;
  // The target is checked by a binding because a query of GL_TEXTURE_TARGET is an error in Mesa's compatibility
  // contexts.
  GLint bound = 0;
  if (gl.IsTexture(input.name) != GL_FALSE) {
    gl.ActiveTexture(GL_TEXTURE0 + core::CM_UNIT_DEPTH_SOURCE);
    gl.BindTexture(multisample ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D, 0);
    gl.BindTextureUnit(core::CM_UNIT_DEPTH_SOURCE, input.name);
    gl.GetIntegerv(multisample ? GL_TEXTURE_BINDING_2D_MULTISAMPLE : GL_TEXTURE_BINDING_2D, &bound);
  }
  if (bound == 0) refuse(input, multisample ? "is not a GL_TEXTURE_2D_MULTISAMPLE" : "is not a GL_TEXTURE_2D");
  const TextureLevel level = level_of(gl, input.name, 0);
  const bool depth = level.bits.depth > 0;
  if (!depth && (multisample || level.red_type != GL_FLOAT)) {
    refuse(input, multisample ? "does not have a depth format" : "has neither a depth format nor GL_R32F");
  }
  Source source{input.name, 0, origin_in(input, level.size)};
  if (multisample) gl.GetTextureLevelParameteriv(input.name, 0, GL_TEXTURE_SAMPLES, &source.samples);
  if (!depth || !is_remapped(gl, input.name)) return source;
  const gl::Object around = gl::make_framebuffer(gl_);
  gl.NamedFramebufferTexture(around.name(), GL_DEPTH_ATTACHMENT, input.name, 0);
  gl.NamedFramebufferReadBuffer(around.name(), GL_NONE);
  gl.NamedFramebufferDrawBuffer(around.name(), GL_NONE);
  return copy(around.name(), format_of(level.bits), source.samples,
              {source.origin, input.viewport.z, input.viewport.w});
}

HostDepth::Source HostDepth::open_framebuffer(const HostDepthInput& input) {
  const auto& gl = *gl_;
  const GLuint framebuffer = input.name;
  if (framebuffer != 0 && gl.IsFramebuffer(framebuffer) == GL_FALSE)
    refuse(input, "does not exist in the current context");
  if (gl.CheckNamedFramebufferStatus(framebuffer, GL_READ_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    refuse(input, "is not complete");
  }
  const auto attachment = [&](GLenum point, GLenum what) {
    GLint value = 0;
    gl.GetNamedFramebufferAttachmentParameteriv(framebuffer, point, what, &value);
    return value;
  };
  const GLenum point = framebuffer == 0 ? GL_DEPTH : GL_DEPTH_ATTACHMENT;
  const GLint type = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE);
  DepthBits bits;
  glm::ivec2 size(input.target_size);
  if (type != GL_NONE) bits.depth = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE);
  if (bits.depth == 0) refuse(input, "has no depth buffer");
  if (type == GL_TEXTURE) {
    const auto texture = static_cast<GLuint>(attachment(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
    const TextureLevel level = level_of(gl, texture, attachment(point, GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL));
    size = level.size;
    bits = level.bits;
  } else {
    bits.type = attachment(point, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE);
    if (type == GL_RENDERBUFFER) {
      const auto buffer = static_cast<GLuint>(attachment(point, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
      gl.GetNamedRenderbufferParameteriv(buffer, GL_RENDERBUFFER_WIDTH, &size.x);
      gl.GetNamedRenderbufferParameteriv(buffer, GL_RENDERBUFFER_HEIGHT, &size.y);
      gl.GetNamedRenderbufferParameteriv(buffer, GL_RENDERBUFFER_STENCIL_SIZE, &bits.stencil);
    } else if (attachment(GL_STENCIL, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE) != GL_NONE) {
      bits.stencil = attachment(GL_STENCIL, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE);
    }
  }
  GLint samples = 0;
  gl.GetNamedFramebufferParameteriv(framebuffer, GL_SAMPLES, &samples);
  return copy(framebuffer, format_of(bits), samples, {origin_in(input, size), input.viewport.z, input.viewport.w});
}

bool HostDepth::answered() {
  bool changed = false;
  while (!asked_.empty() && asked_.front().fence.passed()) {
    std::uint32_t answer = 0;
    std::memcpy(&answer, answers_.data() + asked_.front().slot * sizeof(answer), sizeof(answer));
    changed = changed || answer != 0;
    asked_.pop_front();
  }
  return changed;
}

bool HostDepth::update(const HostDepthInput& input) {
  const glm::uvec2 size(std::max(input.viewport.z, 0), std::max(input.viewport.w, 0));
  if (input.source == DepthSource::none || size.x == 0 || size.y == 0) {
    const bool had = static_cast<bool>(z_);
    z_ = {};
    copy_ = {};
    size_ = glm::uvec2(0U);
    layers_ = 0;
    asked_.clear();
    waits_ = false;
    return had;
  }
  const gl::DebugGroup group(*gl_, "cumulet: host depth");
  const bool earlier = answered();
  if (input.unchanged && z_ && input.source == last_.source && input.viewport == last_.viewport &&
      input.target_size == last_.target_size && input.flip_y == last_.flip_y &&
      input.orthographic == last_.orthographic && input.depth_a == last_.depth_a && input.depth_b == last_.depth_b) {
    return earlier;
  }
  // If the device is far behind, the depth of a later frame is read instead.
  if (asked_.size() == max_asked) return earlier;
  const auto& gl = *gl_;
  const Source source = input.source == DepthSource::framebuffer ? open_framebuffer(input) : open_texture(input);
  const auto layers = static_cast<unsigned>(std::clamp(source.samples, 1, max_layers));
  const bool multisample = source.samples > 0;
  const gl::Program& program = programs_->ask({"host_depth.comp", {gl::macros::multisample(multisample)}});
  waits_ = !program.usable();
  if (waits_) return earlier;
  if (!sampler_) sampler_ = gl::make_sampler(gl_);
  if (!changed_) changed_ = gl::make_buffer(gl_, 4, nullptr, GL_DYNAMIC_STORAGE_BIT, "creating the depth flag");
  if (!answers_) answers_ = gl::ReadBack(gl_, max_asked * 4, "creating the depth flags");
  const bool fits = z_ && size == size_ && layers == layers_;
  gl::Object made;
  if (!fits) {
    made = gl::make_texture_2d_array(gl_, GL_R32F, static_cast<int>(size.x), static_cast<int>(size.y),
                                     static_cast<int>(layers), "creating the host's depth");
  }
  const std::uint32_t zero = 0;
  const auto a = static_cast<float>(input.depth_a);
  gl.NamedBufferSubData(changed_.name(), 0, 4, &zero);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_DEPTH_CHANGED, changed_.name());
  gl.BindTextureUnit(core::CM_UNIT_DEPTH_SOURCE, source.texture);
  gl.BindSampler(core::CM_UNIT_DEPTH_SOURCE, sampler_.name());
  gl.BindImageTexture(core::CM_IMAGE_HOST_DEPTH, fits ? z_.name() : made.name(), 0, GL_TRUE, 0, GL_READ_WRITE, GL_R32F);
  gl.ProgramUniform2i(program.name(), 0, source.origin.x, source.origin.y);
  gl.ProgramUniform1i(program.name(), 1, input.flip_y ? 1 : 0);
  gl.ProgramUniform1i(program.name(), 2, input.orthographic ? 1 : 0);
  gl.ProgramUniform3f(program.name(), 3, a, static_cast<float>(input.depth_a - static_cast<double>(a)),
                      static_cast<float>(input.depth_b));
  program.use(gl);
  gl.DispatchCompute((size.x + 7) / 8, (size.y + 7) / 8, layers);
  gl::memory_barrier(gl, GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                             GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);
  const std::size_t slot = next_slot_++ % max_asked;
  gl.CopyNamedBufferSubData(changed_.name(), answers_.name(), 0, static_cast<GLintptr>(slot * 4), 4);
  asked_.push_back({slot, gl.dispatches_in_call ? gl::Fence() : gl::Fence(gl_)});
  gl.BindSampler(core::CM_UNIT_DEPTH_SOURCE, 0);
  gl::check(gl, "reading the host's depth");
  if (!fits) {
    z_ = std::move(made);
    size_ = size;
    layers_ = layers;
  }
  last_ = input;
  const bool now = answered();
  return !fits || earlier || now;
}

}  // namespace cumulet::render
