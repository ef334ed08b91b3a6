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

/// A get_proc that stands between the library and a context: it counts calls and objects, can refuse the n-th
/// allocation, and can lose the context at the n-th call.
///
/// GL functions have no user pointer, so their wrappers find the fake that is current on their thread (the one made
/// current last, or asked last for a function). A GL call on a thread without one is counted in strays() and does
/// nothing: no such call is allowed.
class FakeGl {
 public:
  using GetProc = void* (*)(void* user, const char* name);

  FakeGl(GetProc real_get_proc, void* user);
  FakeGl(const FakeGl&) = delete;
  FakeGl& operator=(const FakeGl&) = delete;
  ~FakeGl();

  void make_current();

  /// Fits cumulet_get_proc_fn; user is the FakeGl.
  static void* get_proc(void* user, const char* name);

  /// The functions themselves, uncounted, for the host's own use.
  [[nodiscard]] const GladGLContext& real() const { return real_; }

  [[nodiscard]] std::uint64_t calls() const { return calls_; }
  [[nodiscard]] std::uint64_t calls(const std::string& name) const;
  /// Calls that ask for state: glGet* and glIs*, but for errors, the reset status and whether a context is one of ours.
  [[nodiscard]] std::uint64_t questions() const;
  /// Dispatches and draws with a program that was not used before: drivers may compile in them.
  [[nodiscard]] std::uint64_t first_uses() const { return used_.size(); }
  [[nodiscard]] std::uint64_t allocations() const { return allocations_; }
  /// Bytes that were copied to buffers and textures (of four bytes a texel) from main memory.
  [[nodiscard]] std::uint64_t uploaded() const { return uploaded_; }
  /// The allocation that was refused last, "" if none was.
  [[nodiscard]] const std::string& refused() const { return refused_; }
  /// Objects made and not deleted, by kind: "Buffers", "Textures", "Shader", "Sync", ...
  [[nodiscard]] std::map<std::string, std::size_t> alive() const;
  /// Deletions of names that were not alive.
  [[nodiscard]] std::uint64_t wrong_deletes() const { return wrong_deletes_; }
  static std::uint64_t strays();

  /// The n-th allocation from now (0 is the next) fails: nothing is made, and glGetError says GL_OUT_OF_MEMORY, or the
  /// shader does not compile or link. Negative: none.
  void fail_allocation(std::int64_t n) { fail_at_ = n < 0 ? -1 : static_cast<std::int64_t>(allocations_) + n; }
  /// From now on every allocation of storage for a buffer or texture fails, and nothing else.
  void fail_storage(bool fail) { fail_storage_ = fail; }
  /// Likewise no program links.
  void fail_linking(bool fail) { fail_linking_ = fail; }
  /// The n-th call from now (0 is the next) finds the context lost. Negative: never. From then on calls do nothing.
  void lose_context(std::int64_t n) { lose_at_ = n < 0 ? -1 : static_cast<std::int64_t>(calls_) + n; }
  [[nodiscard]] bool lost() const { return lost_; }

  /// Says that the driver compiles in parallel, and is never done before finish_compiling(true).
  void compile_in_parallel() { parallel_ = true; }
  void finish_compiling(bool finish) { compiled_ = finish; }
  /// From now on compute shaders with any of these lines in their source are compiled without what they do: for tests
  /// of which programs are built, in scenes that use others.
  void hollow_kernels(std::vector<std::string> lines) { hollow_ = std::move(lines); }
  /// Questions about programs and shaders that a driver could not have answered while it was compiling.
  [[nodiscard]] std::uint64_t waits() const { return waits_; }

 private:
  // One for each function: fake_gl.cpp.
  struct Wrappers;

  void made(const std::string& kind, std::uintptr_t name);
  void made(const std::string& kind, GLsizei n, const GLuint* names);
  void made(const std::string& kind, GLenum target, GLsizei n, const GLuint* names);
  void deleted(const std::string& kind, std::uintptr_t name);
  void deleted(const std::string& kind, GLsizei n, const GLuint* names);
  void use(GLuint program);
  // GL_COMPLETION_STATUS_KHR; all other questions wait for the driver.
  bool answer(GLuint name, GLenum what, GLint* value);
  const GLubyte* extension(GLenum what, GLuint index) const;
  bool hollow(GLuint shader, GLsizei count, const GLchar* const* sources, const GLint* lengths) const;

  GetProc get_proc_;
  void* user_;
  GladGLContext real_{};
  std::uint64_t calls_ = 0;
  std::vector<std::uint64_t> calls_of_;  // by function
  std::uint64_t allocations_ = 0;
  std::uint64_t uploaded_ = 0;
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
