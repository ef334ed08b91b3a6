#pragma once

#include <array>
#include <utility>

#include "gl/api.hpp"
#include "gl/bindings.hpp"
#include "gl/compatibility_state.hpp"

namespace cumulet::gl {

/// Sets the GL state that cumulet.h lists to known values for the library's passes, and restores the host's values on
/// destruction. This is lazy: the functions of gl::Functions notify the guard of the state they are about to set or
/// depend on. Only that state is queried, set and restored, once per call, and no state can be forgotten.
///
/// The known values are GL's defaults, except that dither is off and only draw buffer 0 can be written. They apply to
/// every draw, clear, blit and pixel transfer. A texture is read without a sampler object until one is bound. All other
/// bindings are the host's until a pass sets its own.
///
/// State that the library never sets is not saved: the values (not the enables) of blend color, sample coverage and
/// mask, stencil, polygon offset, logic op and restart index. Only the first viewport, scissor and depth range is
/// saved: use the indexed calls.
///
/// In a compatibility context, CompatibilityState does this for the state that core contexts lack.
///
/// Produces no GL error. GL cannot rebind an object that the host has deleted while it was bound, or a program that no
/// longer links. If the library used such a binding, it ends as 0.
class StateGuard {
 public:
  /// restore: false (CUMULET_GL_STATE_HOST_RESETS) queries nothing and restores nothing. Guards that restore may be
  /// nested.
  explicit StateGuard(const Functions& gl, bool restore = true);
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

  /// Sets the known values again, for a pass that follows one that changed them.
  void set_known();

  // Number of units and bindings that the library may use.
  static constexpr GLuint units = core::CM_UNITS;
  static constexpr GLuint ranges = core::CM_BUFFERS;
  static constexpr GLuint images = core::CM_IMAGES;
  static constexpr GLuint blended_buffers = 2;

 private:
  friend struct Functions;  // it reports the state that is about to be used

  static constexpr std::size_t targets = 11;
  static constexpr std::size_t max_draw_buffers = 16;  // drivers have 8
  static constexpr std::size_t capabilities = 28;
  static constexpr std::size_t pixel_parameters = 12;

  /// A value that is queried at its first use.
  template <class T>
  struct Saved {
    T value{};
    bool used = false;
    /// Returns true at the first use.
    bool use() { return !std::exchange(used, true); }
  };
  struct BufferRange {
    GLint buffer = 0;
    GLint64 offset = 0;
    GLint64 size = 0;
  };
  struct ImageUnit {
    GLint name = 0, level = 0, layered = 0, layer = 0, access = 0, format = 0;
  };
  struct Blend {
    std::array<GLint, 4> function{};  // source and destination of color, then of alpha
    std::array<GLint, 2> equation{};
  };
  struct Depth {
    GLboolean mask = GL_FALSE;
    GLint function = 0;
    std::array<GLdouble, 2> range{};
  };
  struct Cull {
    GLint mode = 0, front = 0;
  };
  struct Pixels {
    GLint buffer = 0;
    std::array<GLint, pixel_parameters> parameters{};
    GLint read_clamp = 0;  // only used for pack
  };
  struct Raster {
    std::array<bool, capabilities> enabled{};
    std::array<std::array<GLboolean, 4>, max_draw_buffers> masks{};
    bool scissor = false;
    std::array<GLint, 2> polygon_mode{};  // front and back; core contexts have only one value
    GLint clip_origin = 0, clip_depth = 0;
  };

  // Each of these announces that the state is about to be used.
  void program();
  void pipeline();
  void vertex_array();
  void draw_framebuffer();
  void read_framebuffer();
  void active_texture();
  void texture(GLuint unit, std::size_t target);
  void textures(GLuint unit, GLuint name);
  void bound_texture(GLenum target);
  void sampler(GLuint unit);
  void buffer(GLenum target);
  void range(GLenum target, GLuint index);
  void image(GLuint unit);
  void pixels(bool pack);
  void raster();
  void capability(GLenum name, bool on);
  void blend_enable(GLuint buffer);
  void blend(GLuint buffer);
  void depth();
  void cull();
  void viewport();
  void scissor_box();

  [[nodiscard]] const GladGLContext& plain() const { return *gl_; }
  [[nodiscard]] GLint get(GLenum name) const;
  void enable(GLenum capability, bool on) const;
  void set_pixels(bool pack) const;
  void set_raster();
  void set_blend(GLuint buffer) const;
  void set_depth() const;
  void set_cull() const;

  void restore_bindings() const;
  void restore_textures() const;
  void restore_ranges(GLenum target) const;
  void restore_dispatch_indirect() const;
  void restore_images() const;
  void restore_pixels() const;
  void restore_raster() const;

  const Functions* gl_;
  bool restore_;
  StateGuard* outer_;

  Saved<GLint> program_, pipeline_, vertex_array_, draw_framebuffer_, read_framebuffer_;
  Saved<GLint> active_texture_;
  GLuint active_unit_ = 0;  // the current active unit, once active_texture_ was used
  std::array<std::array<Saved<GLint>, targets>, units> textures_{};
  std::array<Saved<GLint>, units> samplers_{};
  std::array<Saved<BufferRange>, ranges> storage_{}, uniform_{};
  Saved<GLint> storage_generic_, uniform_generic_, dispatch_indirect_;
  std::array<Saved<ImageUnit>, images> images_{};
  Saved<Pixels> pack_, unpack_;
  Saved<Raster> raster_;
  std::array<bool, capabilities> enabled_{};  // the current values, once raster_ was used
  std::array<Saved<bool>, max_draw_buffers> blend_enables_{};
  std::array<Saved<Blend>, blended_buffers> blends_{};
  Saved<Depth> depth_;
  Saved<Cull> cull_;
  Saved<std::array<GLfloat, 4>> viewport_;
  Saved<std::array<GLint, 4>> scissor_box_;
  CompatibilityState compatibility_;
};

}  // namespace cumulet::gl
