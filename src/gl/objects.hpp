#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gl/api.hpp"

namespace cumulet::gl {

using FunctionsPtr = std::shared_ptr<const Functions>;

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

/// Names an object for debuggers and drivers' output (KHR_debug, core since 4.3): after the step that makes it
/// ("creating the sums": "cumulet: sums").
void label(const Functions& gl, Object::Kind kind, GLuint name, std::string_view what);

/// A pass, for the same: the commands between its beginning and its end are its. name: "cumulet: ..." by convention.
/// Where the host's own groups fill the driver's stack there is none: a push would fail, and its pop end a host's
/// group.
class DebugGroup {
 public:
  DebugGroup(const Functions& gl, std::string_view name);
  DebugGroup(const DebugGroup&) = delete;
  DebugGroup& operator=(const DebugGroup&) = delete;
  ~DebugGroup();

 private:
  const Functions& gl_;
  bool pushed_ = false;
};

/// A point in the stream of commands; deleted with the context current.
class Fence {
 public:
  Fence() = default;
  /// After all commands so far, which are sent off.
  explicit Fence(FunctionsPtr gl);
  Fence(Fence&& other) noexcept : gl_(std::move(other.gl_)), sync_(std::exchange(other.sync_, nullptr)) {}
  Fence& operator=(Fence&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(sync_, other.sync_);
    return *this;
  }
  Fence(const Fence&) = delete;
  Fence& operator=(const Fence&) = delete;
  ~Fence();
  /// Whether the commands before it are done; true where there is none. Never waits.
  [[nodiscard]] bool passed() const;
  /// Until they are.
  void wait() const;
  /// What the context does from now on comes after, though another context of the share group made it. Never waits.
  void order() const;

 private:
  FunctionsPtr gl_;
  GLsync sync_ = nullptr;
};

/// A buffer that the driver writes and we read, without asking for it, once a fence after the writing has passed.
class ReadBack {
 public:
  ReadBack() = default;
  /// Of zeros at first.
  ReadBack(const FunctionsPtr& gl, std::size_t bytes, const char* what);
  /// Of whatever is there: for large ones, of which only what was written is read.
  static ReadBack unfilled(const FunctionsPtr& gl, std::size_t bytes, const char* what);
  [[nodiscard]] GLuint name() const { return buffer_.name(); }
  [[nodiscard]] const std::byte* data() const { return data_; }
  explicit operator bool() const { return data_ != nullptr; }

 private:
  void map(const FunctionsPtr& gl, std::size_t bytes, const void* values, const char* what);

  Object buffer_;
  const std::byte* data_ = nullptr;
};

/// glMemoryBarrier, where it is needed: a driver whose dispatches are over when their call returns orders all that
/// follows, but its barrier (Mesa's llvmpipe) waits for whatever the host has queued.
void memory_barrier(const Functions& gl, GLbitfield barriers);

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
Object make_framebuffer(const FunctionsPtr& gl);
Object make_vertex_array(const FunctionsPtr& gl);
/// Nearest, no comparison: reads any complete texture as it is.
Object make_sampler(const FunctionsPtr& gl);

}  // namespace cumulet::gl
