#pragma once

#include <glad/gl.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cumulet::test {

/// A get_proc between the library and a context. It counts calls and objects, can make the n-th allocation fail, and
/// can lose the context at the n-th call.
///
/// GL functions have no user pointer. Their wrappers use the fake that is current on their thread: the last one made
/// current, or the last one asked for a function. A GL call on a thread without a current fake does nothing and is
/// counted in strays(); no such call is allowed.
class FakeGl {
 public:
  using GetProc = void* (*)(void* user, const char* name);

  FakeGl(GetProc real_get_proc, void* user);
  FakeGl(const FakeGl&) = delete;
  FakeGl& operator=(const FakeGl&) = delete;
  ~FakeGl();

  void make_current();

  /// Fits cumulet_get_proc_fn; `user` is the FakeGl.
  static void* get_proc(void* user, const char* name);

  /// The wrapped functions, uncounted, for the host's own use.
  [[nodiscard]] const GladGLContext& real() const { return real_; }

  [[nodiscard]] std::uint64_t calls() const { return calls_; }
  [[nodiscard]] std::uint64_t calls(const std::string& name) const;
  /// Number of calls that query state: glGet* and glIs*, except errors, the reset status and glIsBuffer.
  [[nodiscard]] std::uint64_t questions() const;
  /// Number of first dispatches or draws with a program. Drivers may compile in them.
  [[nodiscard]] std::uint64_t first_uses() const { return used_.size(); }
  [[nodiscard]] std::uint64_t allocations() const { return allocations_; }
  /// Bytes copied from main memory to buffers and textures (4 bytes per texel).
  [[nodiscard]] std::uint64_t uploaded() const { return uploaded_; }
  /// Size of all buffers that exist.
  [[nodiscard]] std::uint64_t buffer_bytes() const;
  /// Name of the last allocation that was made to fail, "" if none.
  [[nodiscard]] const std::string& refused() const { return refused_; }
  /// Objects made and not deleted, by kind: "Buffers", "Textures", "Shader", "Sync", ...
  [[nodiscard]] std::map<std::string, std::size_t> alive() const;
  /// Number of deletions of names that were not alive.
  [[nodiscard]] std::uint64_t wrong_deletes() const { return wrong_deletes_; }
  static std::uint64_t strays();

  /// Makes the n-th allocation after this call fail (0 is the next one; negative: none). Nothing is allocated, and
  /// glGetError returns GL_OUT_OF_MEMORY, or the shader does not compile or link.
  void fail_allocation(std::int64_t n) { fail_at_ = n < 0 ? -1 : static_cast<std::int64_t>(allocations_) + n; }
  /// If true, every allocation of storage for a buffer or texture fails; other calls work.
  void fail_storage(bool fail) { fail_storage_ = fail; }
  /// If true, no program links; other calls work.
  void fail_linking(bool fail) { fail_linking_ = fail; }
  /// Loses the context at the n-th call after this one (0 is the next one; negative: never). All later calls do
  /// nothing.
  void lose_context(std::int64_t n) { lose_at_ = n < 0 ? -1 : static_cast<std::int64_t>(calls_) + n; }
  [[nodiscard]] bool lost() const { return lost_; }

  /// Reports parallel compilation to the library. No compilation completes before finish_compiling(true).
  void compile_in_parallel() { parallel_ = true; }
  void finish_compiling(bool finish) { compiled_ = finish; }
  /// Compute shaders compiled after this call whose source has any of these lines get an empty body. For tests that
  /// only check which programs are built.
  void hollow_kernels(std::vector<std::string> lines) { hollow_ = std::move(lines); }
  /// Number of queries of programs and shaders that would have blocked on a compilation in progress.
  [[nodiscard]] std::uint64_t waits() const { return waits_; }

 private:
  // One wrapper per function; defined in fake_gl.cpp.
  struct Wrappers;

  void made(const std::string& kind, std::uintptr_t name);
  void made(const std::string& kind, GLsizei n, const GLuint* names);
  void made(const std::string& kind, GLenum target, GLsizei n, const GLuint* names);
  void deleted(const std::string& kind, std::uintptr_t name);
  void deleted(const std::string& kind, GLsizei n, const GLuint* names);
  void store(GLuint buffer, GLsizeiptr size, const void* data, GLbitfield flags);
  void use(GLuint program);
  // Answers GL_COMPLETION_STATUS_KHR. All other queries would wait for the driver.
  bool answer(GLuint name, GLenum what, GLint* value);
  const GLubyte* extension(GLenum what, GLuint index) const;
  bool hollow(GLuint shader, GLsizei count, const GLchar* const* sources, const GLint* lengths) const;

  GetProc get_proc_;
  void* user_;
  GladGLContext real_{};
  std::uint64_t calls_ = 0;
  std::vector<std::uint64_t> calls_of_;  // indexed by function
  std::uint64_t allocations_ = 0;
  std::uint64_t uploaded_ = 0;
  std::map<std::uintptr_t, std::uint64_t> buffers_;  // sizes by name
  std::int64_t fail_at_ = -1;
  bool fail_storage_ = false;
  bool fail_linking_ = false;
  std::int64_t lose_at_ = -1;
  bool lost_ = false;
  GLenum error_ = GL_NO_ERROR;
  std::string refused_;
  std::map<std::string, std::set<std::uintptr_t>> alive_;
  std::uint64_t wrong_deletes_ = 0;
  std::set<GLuint> used_;
  GLuint program_ = 0;
  bool parallel_ = false;
  bool compiled_ = false;
  std::uint64_t waits_ = 0;
  std::vector<std::string> hollow_;
};

}  // namespace cumulet::test
