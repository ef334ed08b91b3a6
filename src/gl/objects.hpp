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

/// A GL name with its deleter. Movable; must be destroyed with the context current. Framebuffers and vertex arrays
/// belong to the context that created them, all other kinds to its share group.
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

/// Labels an object for debuggers and driver messages (KHR_debug, core since 4.3). The label is derived from the
/// creation step: "creating the sums" becomes "cumulet: sums".
void label(const Functions& gl, Object::Kind kind, GLuint name, std::string_view what);

/// A debug group: covers the commands issued during its lifetime. name: "cumulet: ..." by convention. If the host's own
/// groups fill the driver's stack, no group is pushed: the push would fail, and the pop would end a group of the host.
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

/// A fence in the command stream. Must be destroyed with the context current.
class Fence {
 public:
  Fence() = default;
  /// Inserted after all commands issued so far, which are flushed.
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
  /// Whether the commands before the fence are complete; true for an empty Fence. Never waits.
  [[nodiscard]] bool passed() const;
  /// Waits until they are complete.
  void wait() const;
  /// Makes later commands of the current context wait on the GPU for this fence, which may belong to another context of
  /// the share group. Does not block the CPU.
  void order() const;

 private:
  FunctionsPtr gl_;
  GLsync sync_ = nullptr;
};

/// A persistently mapped buffer that the GPU writes and the CPU reads without a further call, once a fence after the
/// write has passed.
class ReadBack {
 public:
  ReadBack() = default;
  /// Initially zero.
  ReadBack(const FunctionsPtr& gl, std::size_t bytes, const char* what);
  /// Uninitialized: for large buffers of which only the written part is read.
  static ReadBack unfilled(const FunctionsPtr& gl, std::size_t bytes, const char* what);
  [[nodiscard]] GLuint name() const { return buffer_.name(); }
  [[nodiscard]] const std::byte* data() const { return data_; }
  explicit operator bool() const { return data_ != nullptr; }

 private:
  void map(const FunctionsPtr& gl, std::size_t bytes, const void* values, const char* what);

  Object buffer_;
  const std::byte* data_ = nullptr;
};

/// Calls glMemoryBarrier if it is needed. A driver that completes dispatches within the call orders all that follows,
/// but its barrier (Mesa's llvmpipe) waits for everything the host has queued.
void memory_barrier(const Functions& gl, GLbitfield barriers);

/// Creates an immutable buffer; data may be null. flags: as for glNamedBufferStorage. Throws on a GL error.
Object make_buffer(const FunctionsPtr& gl, std::size_t bytes, const void* data, GLbitfield flags, const char* what);
/// Creates a texture buffer over a whole buffer.
Object make_texture_buffer(const FunctionsPtr& gl, GLenum format, const Object& buffer, const char* what);
Object make_texture_2d(const FunctionsPtr& gl, GLenum format, int width, int height, const char* what);
Object make_texture_2d_array(const FunctionsPtr& gl, GLenum format, int width, int height, int layers,
                             const char* what);
Object make_texture_2d_multisample(const FunctionsPtr& gl, GLenum format, int samples, int width, int height,
                                   const char* what);
Object make_texture_3d(const FunctionsPtr& gl, GLenum format, int x, int y, int z, const char* what);
Object make_framebuffer(const FunctionsPtr& gl);
Object make_vertex_array(const FunctionsPtr& gl);
/// Creates a sampler with nearest filtering and no comparison, so that any complete texture is read unchanged.
Object make_sampler(const FunctionsPtr& gl);

}  // namespace cumulet::gl
