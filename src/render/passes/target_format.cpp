#include "render/passes/target_format.hpp"

#include <glm/glm.hpp>
#include <limits>
#include <string>

#include "base/error.hpp"

namespace cumulet::render {

namespace {

// An attachment of a framebuffer.
class Attachment {
 public:
  Attachment(const gl::Functions& gl, GLuint framebuffer, GLenum point)
      : gl_(gl), framebuffer_(framebuffer), point_(point), type_(get(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE)) {}

  [[nodiscard]] bool is_there() const { return type_ != GL_NONE; }
  // If there is no attachment, only its type may be queried: other queries are GL errors.
  [[nodiscard]] GLint get(GLenum name) const {
    GLint value = 0;
    gl_.GetNamedFramebufferAttachmentParameteriv(framebuffer_, point_, name, &value);
    return value;
  }
  [[nodiscard]] bool is_layered() const {
    return type_ == GL_TEXTURE && get(GL_FRAMEBUFFER_ATTACHMENT_LAYERED) != GL_FALSE;
  }
  // Returns width and height; the largest integers if GL does not report them, as for a window.
  [[nodiscard]] glm::ivec2 size() const {
    glm::ivec2 size(std::numeric_limits<GLint>::max());
    if (type_ != GL_TEXTURE && type_ != GL_RENDERBUFFER) return size;
    const auto name = static_cast<GLuint>(get(GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME));
    if (type_ == GL_TEXTURE) {
      const GLint level = get(GL_FRAMEBUFFER_ATTACHMENT_TEXTURE_LEVEL);
      gl_.GetTextureLevelParameteriv(name, level, GL_TEXTURE_WIDTH, &size.x);
      gl_.GetTextureLevelParameteriv(name, level, GL_TEXTURE_HEIGHT, &size.y);
    } else {
      gl_.GetNamedRenderbufferParameteriv(name, GL_RENDERBUFFER_WIDTH, &size.x);
      gl_.GetNamedRenderbufferParameteriv(name, GL_RENDERBUFFER_HEIGHT, &size.y);
    }
    return size;
  }

 private:
  const gl::Functions& gl_;
  GLuint framebuffer_;
  GLenum point_;
  GLint type_;
};

[[noreturn]] void refuse(const FrameTarget& target, const std::string& cause) {
  throw Error(ErrorCode::invalid_argument,
              "the target, framebuffer " + std::to_string(target.framebuffer) + ", " + cause);
}

// The default framebuffer's buffers have other names in queries than in glDrawBuffer.
GLenum attachment_of(GLuint framebuffer, GLenum draw_buffer) {
  if (framebuffer != 0) return draw_buffer;
  switch (draw_buffer) {
    case GL_BACK:
    case GL_LEFT:
    case GL_FRONT_AND_BACK:
      return GL_BACK_LEFT;
    case GL_FRONT:
      return GL_FRONT_LEFT;
    case GL_RIGHT:
      return GL_BACK_RIGHT;
    default:
      return draw_buffer;
  }
}

void check_size(const FrameTarget& target, const Attachment& attachment, const char* name) {
  const glm::ivec2 size = attachment.size();
  const glm::ivec2 wanted(target.size);
  if (size.x >= wanted.x && size.y >= wanted.y) return;
  const auto text = [](glm::ivec2 s) { return std::to_string(s.x) + " x " + std::to_string(s.y); };
  refuse(target, std::string("has a ") + name + " attachment of " + text(size) + " pixels, smaller than the frame of " +
                     text(wanted));
}

// Some drivers report a window as linear although GL_FRAMEBUFFER_SRGB encodes for it. Mesa reports the actual encoding.
bool tells_encoding(const gl::Functions& gl, const FrameTarget& target) {
  return target.framebuffer != 0 || gl::string_of(gl, GL_VERSION).find("Mesa") != std::string::npos;
}

void check_encoding(const gl::Functions& gl, const FrameTarget& target, const TargetFormat& format,
                    ColorEncoding encoding) {
  if (encoding == ColorEncoding::srgb_framebuffer && !format.is_srgb && tells_encoding(gl, target)) {
    refuse(target,
           "has no sRGB format, which CUMULET_COLOR_SRGB_FRAMEBUFFER needs: OpenGL would not encode the colors");
  }
  if (encoding == ColorEncoding::hdr && !format.is_float) {
    refuse(target, "has no float format, which CUMULET_COLOR_HDR needs: colors would be clamped");
  }
}

TargetFormat check_color(const gl::Functions& gl, const FrameTarget& target, ColorEncoding encoding) {
  GLint draw_buffer = GL_NONE;
  gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer);
  gl.GetIntegerv(GL_DRAW_BUFFER0, &draw_buffer);
  if (draw_buffer == GL_NONE) refuse(target, "has GL_NONE as its draw buffer 0: no color would be written");
  const Attachment color(gl, target.framebuffer, attachment_of(target.framebuffer, static_cast<GLenum>(draw_buffer)));
  if (!color.is_there()) {
    if (target.framebuffer == 0) return {};
    refuse(target, "has no color attachment at its draw buffer 0");
  }
  const auto type = static_cast<GLenum>(color.get(GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE));
  if (type == GL_INT || type == GL_UNSIGNED_INT) refuse(target, "has an integer color attachment");
  if (color.get(GL_FRAMEBUFFER_ATTACHMENT_GREEN_SIZE) == 0 || color.get(GL_FRAMEBUFFER_ATTACHMENT_BLUE_SIZE) == 0)
    refuse(target, "has a color attachment without green or blue");
  if (color.is_layered())
    refuse(target, "has a layered color attachment: attach a single layer (glFramebufferTextureLayer)");
  check_size(target, color, "color");
  const TargetFormat format{color.get(GL_FRAMEBUFFER_ATTACHMENT_RED_SIZE), type == GL_FLOAT,
                            color.get(GL_FRAMEBUFFER_ATTACHMENT_COLOR_ENCODING) == GL_SRGB};
  check_encoding(gl, target, format, encoding);
  return format;
}

}  // namespace

GLenum copy_format(const TargetFormat& format, ColorEncoding encoding) {
  if (encoding == ColorEncoding::srgb_framebuffer && format.is_srgb) return GL_SRGB8_ALPHA8;
  if (format.is_float) return format.bits > 16 ? GL_RGBA32F : GL_RGBA16F;
  return format.bits > 8 || format.bits == 0 ? GL_RGBA16 : GL_RGBA8;
}

std::uint64_t bytes_per_texel(GLenum format) {
  if (format == GL_RGBA32F) return 16;
  return format == GL_RGBA16F || format == GL_RGBA16 ? 8 : 4;
}

TargetFormat check_target(const gl::Functions& gl, const FrameTarget& target, ColorEncoding encoding) {
  const GLuint framebuffer = target.framebuffer;
  if (framebuffer != 0 && gl.IsFramebuffer(framebuffer) == GL_FALSE) {
    throw Error(ErrorCode::invalid_argument,
                "the target, " + std::to_string(framebuffer) + ", is not a framebuffer of the current context");
  }
  if (gl.CheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    refuse(target, "is not complete");
  const TargetFormat format = check_color(gl, target, encoding);
  const Attachment depth(gl, framebuffer, framebuffer == 0 ? GL_DEPTH : GL_DEPTH_ATTACHMENT);
  if (depth.is_there()) {
    check_size(target, depth, "depth");
  } else if (target.needs_depth) {
    refuse(target, "has no depth attachment, which write_depth needs");
  }
  return format;
}

}  // namespace cumulet::render
