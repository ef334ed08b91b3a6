#pragma once

#include <array>

#include "gl/api.hpp"

namespace cumulet::gl {

/// Sets the GL state that cumulet.h lists to values that every pass can start from, and puts the host's back on
/// destruction: the .cpp's tables are the list. The values are GL's defaults, except that dither is off and only draw
/// buffer 0 can be written. Of bindings only samplers and pixel buffers are set; all others stay until a pass sets
/// them.
///
/// State that the library never sets is not saved: the values (not the enables) of blend colour, sample coverage and
/// mask, stencil, polygon offset, logic op and restart index, and viewports, scissors and depth ranges but the first:
/// use the indexed calls. Never glBindTextureUnit(unit, 0): it unbinds targets that are not saved.
///
/// Produces no GL error. What the host has deleted while it was bound, or a program that no longer links, cannot be
/// bound again in GL: that binding ends as 0, if the library used it.
class StateGuard {
 public:
  /// restore false (CUMULET_GL_STATE_HOST_RESETS): sets the known values, saves and restores nothing.
  explicit StateGuard(const Functions& gl, bool restore = true);
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

  static constexpr int units = 16;
  static constexpr int ranges = 2;  // of storage and of uniform buffers
  static constexpr int images = 3;
  static constexpr int blended_buffers = 2;  // whose blend functions it keeps

 private:
  static constexpr std::size_t targets = 5;
  static constexpr std::size_t most_draw_buffers = 16;  // drivers have 8
  static constexpr std::size_t capabilities = 28;
  static constexpr std::size_t pixel_parameters = 24;

  struct BufferRange {
    GLint buffer = 0;
    GLint64 offset = 0;
    GLint64 size = 0;
    bool operator==(const BufferRange&) const = default;
  };
  struct ImageUnit {
    GLint name = 0, level = 0, layered = 0, layer = 0, access = 0, format = 0;
    bool operator==(const ImageUnit&) const = default;
  };
  struct DrawBuffer {
    std::array<GLboolean, 4> mask{};
    GLboolean blend = GL_FALSE;
  };
  struct Blend {
    std::array<GLint, 4> function{};  // source and destination of colour, then of alpha
    std::array<GLint, 2> equation{};
  };
  struct TextureUnit {
    std::array<GLint, targets> textures{};
    GLint sampler = 0;
  };
  [[nodiscard]] BufferRange range(GLenum binding, GLenum start, GLenum size, GLuint index) const;
  void restore_range(GLenum target, GLuint index, const BufferRange& saved, const BufferRange& now) const;
  [[nodiscard]] ImageUnit image(GLuint unit) const;
  [[nodiscard]] GLint get(GLenum name) const;
  void enable(GLenum capability, bool on) const;
  [[nodiscard]] GLuint draw_buffer_count() const;

  void save_objects();
  void save_raster();
  void set_known() const;
  void restore_objects() const;
  void restore_raster() const;

  const Functions* gl_;
  bool restore_;

  GLint program_ = 0;
  GLint pipeline_ = 0;
  GLint vertex_array_ = 0;
  GLint draw_framebuffer_ = 0;
  GLint read_framebuffer_ = 0;
  GLint active_texture_ = 0;
  std::array<TextureUnit, units> texture_units_{};
  std::array<BufferRange, ranges> storage_{};
  std::array<BufferRange, ranges> uniform_{};
  GLint storage_generic_ = 0;
  GLint uniform_generic_ = 0;
  std::array<ImageUnit, images> images_{};
  GLint pack_buffer_ = 0;
  GLint unpack_buffer_ = 0;
  std::array<GLint, pixel_parameters> pixel_store_{};

  std::array<GLboolean, capabilities> enabled_{};
  std::array<DrawBuffer, most_draw_buffers> draw_buffers_{};
  std::array<GLfloat, 4> viewport_{};
  std::array<GLint, 4> scissor_box_{};
  GLboolean scissor_test_ = GL_FALSE;
  std::array<GLdouble, 2> depth_range_{};
  GLboolean depth_mask_ = GL_FALSE;
  GLint depth_function_ = 0;
  std::array<Blend, blended_buffers> blends_{};
  GLint cull_face_ = 0;
  GLint front_face_ = 0;
  std::array<GLint, 2> polygon_mode_{};  // some drivers tell front and back, core ones have only one
  GLint clip_origin_ = 0;
  GLint clip_depth_ = 0;
};

}  // namespace cumulet::gl
