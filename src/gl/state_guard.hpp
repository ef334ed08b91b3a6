#pragma once

#include <array>

#include "gl/api.hpp"

namespace cumulet::gl {

/// Saves the GL state that a trace or a readback changes, restores it on destruction: the program, texture and sampler
/// bindings of units 0-14, storage bindings 0-1, uniform bindings 0-1, image bindings 0-1, the pack and unpack buffers
/// and parameters. Everything else goes through direct state access and is not touched.
class StateGuard {
 public:
  explicit StateGuard(const Functions& gl);
  ~StateGuard();
  StateGuard(const StateGuard&) = delete;
  StateGuard& operator=(const StateGuard&) = delete;

  static constexpr int units = 15;

 private:
  struct Indexed {
    GLint buffer = 0;
    GLint64 offset = 0;
    GLint64 size = 0;
  };
  struct Image {
    GLint name = 0, level = 0, layered = 0, layer = 0, access = 0, format = 0;
  };
  [[nodiscard]] Indexed indexed(GLenum binding, GLenum start, GLenum size, GLuint index) const;
  void restore(GLenum target, GLuint index, const Indexed& state) const;

  const Functions* gl_;
  GLint program_ = 0;
  GLint active_texture_ = 0;
  std::array<std::array<GLint, 3>, units> textures_{};  // buffer, 2D, 3D
  std::array<GLint, units> samplers_{};
  std::array<Indexed, 2> storage_{};
  std::array<Indexed, 2> uniform_{};
  GLint storage_generic_ = 0;
  GLint uniform_generic_ = 0;
  std::array<Image, 2> images_{};
  GLint pack_buffer_ = 0;
  GLint unpack_buffer_ = 0;
  std::array<GLint, 16> pixel_store_{};
};

}  // namespace cumulet::gl
