#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gl/api.hpp"

namespace cumulet::gl {

/// A GL name with its deleter; movable, deleted with the context current. Framebuffers and vertex arrays belong to the
/// one context they were made in, the other kinds to its share group.
class Object {
 public:
  enum class Kind { buffer, texture, sampler, shader, program, framebuffer, vertex_array };
  Object() = default;
  Object(std::shared_ptr<const Functions> gl, Kind kind, GLuint name) : gl_(std::move(gl)), kind_(kind), name_(name) {}
  Object(Object&& other) noexcept { swap(other); }
  Object& operator=(Object&& other) noexcept {
    Object moved(std::move(other));
    swap(moved);
    return *this;
  }
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  ~Object();

  [[nodiscard]] GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  void swap(Object& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(kind_, other.kind_);
    std::swap(name_, other.name_);
  }
  std::shared_ptr<const Functions> gl_;
  Kind kind_ = Kind::buffer;
  GLuint name_ = 0;
};

using FunctionsPtr = std::shared_ptr<const Functions>;

/// An immutable buffer; data may be null. flags as for glNamedBufferStorage. Throws on a GL error.
Object make_buffer(const FunctionsPtr& gl, std::size_t bytes, const void* data, GLbitfield flags, const char* what);
/// A texture buffer over the whole of a buffer.
Object make_texture_buffer(const FunctionsPtr& gl, GLenum format, const Object& buffer, const char* what);
Object make_texture_2d(const FunctionsPtr& gl, GLenum format, int width, int height, const char* what);
Object make_texture_2d_array(const FunctionsPtr& gl, GLenum format, int width, int height, int layers,
                             const char* what);
Object make_texture_2d_multisample(const FunctionsPtr& gl, GLenum format, int samples, int width, int height,
                                   const char* what);
Object make_texture_3d(const FunctionsPtr& gl, GLenum format, int x, int y, int z, const char* what);
/// Compiles glsl/NAME with the given "NAME VALUE" macros. Throws Error(gl) with the driver's log.
Object make_compute_program(const FunctionsPtr& gl, const std::string& name, std::span<const std::string> defines);
/// Likewise of a vertex and a fragment shader.
Object make_graphics_program(const FunctionsPtr& gl, const std::string& vertex, const std::string& fragment,
                             std::span<const std::string> defines);
Object make_framebuffer(const FunctionsPtr& gl);
Object make_vertex_array(const FunctionsPtr& gl);
/// Nearest, no comparison: reads any complete texture as it is.
Object make_sampler(const FunctionsPtr& gl);

}  // namespace cumulet::gl
