#pragma once

#include <glad/gl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <unordered_map>
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

  FakeGl(GetProc real_get_proc, void* user) : get_proc_(real_get_proc), user_(user) {
    std::pair<GetProc, void*> real(real_get_proc, user);
    const auto load = [](void* loader, const char* name) {
      const auto& [function, its_user] = *static_cast<std::pair<GetProc, void*>*>(loader);
      return reinterpret_cast<GLADapiproc>(function(its_user, name));
    };
    gladLoadGLContextUserPtr(&real_, load, &real);
    make_current();
  }
  FakeGl(const FakeGl&) = delete;
  FakeGl& operator=(const FakeGl&) = delete;
  ~FakeGl() {
    if (current() == this) current() = nullptr;
  }

  void make_current() { current() = this; }

  /// Fits cumulet_get_proc_fn; user is the FakeGl.
  static void* get_proc(void* user, const char* name) {
    auto* fake = static_cast<FakeGl*>(user);
    fake->make_current();
    void* real = fake->get_proc_(fake->user_, name);
    const auto found = wrappers().find(name);
    return real == nullptr || found == wrappers().end() ? real : found->second;
  }

  /// The functions themselves, uncounted, for the host's own use.
  [[nodiscard]] const GladGLContext& real() const { return real_; }

  [[nodiscard]] std::uint64_t calls() const { return calls_; }
  [[nodiscard]] std::uint64_t calls(const std::string& name) const {
    const auto found = std::find(fn_names.begin(), fn_names.end(), name);
    return found == fn_names.end() ? 0 : calls_of_[static_cast<std::size_t>(found - fn_names.begin())];
  }
  /// Calls that ask for state: glGet* and glIs*, but for errors, the reset status and whether a context is one of ours.
  [[nodiscard]] std::uint64_t questions() const {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < fn_names.size(); ++i) {
      const std::string_view name = fn_names[i];
      const bool asks = starts(name, "Is") || starts(name, "GetInteger") || starts(name, "GetBoolean") ||
                        starts(name, "GetFloat") || starts(name, "GetDouble") || starts(name, "GetTextureParameter");
      if (asks && name != "IsBuffer") count += calls_of_[i];
    }
    return count;
  }
  /// Dispatches and draws with a program that was not used before: drivers may compile in them.
  [[nodiscard]] std::uint64_t first_uses() const { return used_.size(); }
  [[nodiscard]] std::uint64_t allocations() const { return allocations_; }
  /// Bytes that were copied to buffers and textures (of four bytes a texel) from main memory.
  [[nodiscard]] std::uint64_t uploaded() const { return uploaded_; }
  /// The allocation that was refused last, "" if none was.
  [[nodiscard]] const std::string& refused() const { return refused_; }
  /// Objects made and not deleted, by kind: "Buffers", "Textures", "Shader", "Sync", ...
  [[nodiscard]] std::map<std::string, std::size_t> alive() const {
    std::map<std::string, std::size_t> counts;
    for (const auto& [kind, names] : alive_)
      if (!names.empty()) counts[kind] = names.size();
    return counts;
  }
  /// Deletions of names that were not alive.
  [[nodiscard]] std::uint64_t wrong_deletes() const { return wrong_deletes_; }
  static std::uint64_t strays() { return stray_counter(); }

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
  static FakeGl*& current() {
    static thread_local FakeGl* fake = nullptr;
    return fake;
  }
  static std::atomic<std::uint64_t>& stray_counter() {
    static std::atomic<std::uint64_t> count = 0;
    return count;
  }

  static constexpr bool starts(std::string_view name, std::string_view with) {
    return name.substr(0, with.size()) == with;
  }
  static constexpr bool contains(std::string_view name, std::string_view part) {
    return name.find(part) != std::string_view::npos;
  }
  static constexpr bool makes(std::string_view name) {
    return starts(name, "Create") || name == "FenceSync" || (starts(name, "Gen") && !starts(name, "Generate"));
  }
  static constexpr bool allocates(std::string_view name) {
    return makes(name) || contains(name, "Storage") || name == "NamedBufferData" || name == "BufferData" ||
           starts(name, "TexImage") || starts(name, "CopyTexImage") || starts(name, "MapBuffer") ||
           starts(name, "MapNamedBuffer") || name == "CompileShader" || name == "LinkProgram";
  }
  static std::string kind_of(std::string_view name) {
    if (name == "FenceSync") return "Sync";
    if (name == "CreateShaderProgramv") return "Program";
    return std::string(name.substr(starts(name, "Gen") ? 3 : 6));
  }

  void made(const std::string& kind, std::uintptr_t name) {
    if (name != 0) alive_[kind].insert(name);
  }
  void made(const std::string& kind, GLsizei n, const GLuint* names) {
    for (GLsizei i = 0; i < n; ++i) made(kind, names[i]);
  }
  void made(const std::string& kind, GLenum, GLsizei n, const GLuint* names) { made(kind, n, names); }
  void deleted(const std::string& kind, std::uintptr_t name) {
    if (name != 0 && alive_[kind].erase(name) == 0) ++wrong_deletes_;
  }
  void deleted(const std::string& kind, GLsizei n, const GLuint* names) {
    for (GLsizei i = 0; i < n; ++i) deleted(kind, names[i]);
  }

  template <class Result>
  static std::uintptr_t id(Result result) {
    if constexpr (std::is_pointer_v<Result>) {
      return reinterpret_cast<std::uintptr_t>(result);
    } else {
      return result;
    }
  }

  enum class Fn : std::uint16_t {
#define FAKE_GL(name) name,
#include "fake_gl_functions.inc"
#undef FAKE_GL
    count
  };
  static constexpr std::array<std::string_view, static_cast<std::size_t>(Fn::count)> fn_names{
#define FAKE_GL(name) #name,
#include "fake_gl_functions.inc"
#undef FAKE_GL
  };

  template <auto Member, Fn F>
  struct Wrapper;
  template <class Result, class... Args, Result (*GladGLContext::*Member)(Args...), Fn F>
  struct Wrapper<Member, F> {
    static constexpr std::string_view name = fn_names[static_cast<std::size_t>(F)];

    static Result call(Args... args) {
      FakeGl* fake = current();
      if (fake == nullptr) {
        ++stray_counter();
        return Result();
      }
      if (static_cast<std::int64_t>(fake->calls_) == fake->lose_at_) fake->lost_ = true;
      ++fake->calls_;
      ++fake->calls_of_[static_cast<std::size_t>(F)];
      if (fake->lost_) return lost(args...);
      if constexpr (F == Fn::GetError) {
        if (fake->error_ != GL_NO_ERROR) return std::exchange(fake->error_, GLenum{GL_NO_ERROR});
      }
      if constexpr (allocates(name)) {
        const auto n = static_cast<std::int64_t>(fake->allocations_++);
        if (n == fake->fail_at_ || (fake->fail_storage_ && contains(name, "Storage")) ||
            (fake->fail_linking_ && F == Fn::LinkProgram)) {
          fake->refused_ = name;
          if constexpr (F != Fn::CompileShader && F != Fn::LinkProgram) fake->error_ = GL_OUT_OF_MEMORY;
          return Result();
        }
      }
      fake->uploaded_ += bytes_of(args...);
      if constexpr (F == Fn::UseProgram) fake->use(args...);
      if constexpr (starts(name, "DispatchCompute") || starts(name, "DrawArrays") || starts(name, "DrawElements")) {
        fake->used_.insert(fake->program_);
      }
      if constexpr (F == Fn::GetProgramiv || F == Fn::GetShaderiv) {
        if (fake->answer(args...)) return Result();
      }
      if constexpr (F == Fn::ShaderSource) {
        if (fake->hollow(args...)) return Result();
      }
      if constexpr (F == Fn::GetStringi) {
        if (const GLubyte* extension = fake->extension(args...)) return extension;
      }
      if constexpr (starts(name, "Delete")) fake->deleted(kind_of(name), convert(args)...);
      if constexpr (std::is_void_v<Result>) {
        (fake->real_.*Member)(args...);
        if constexpr (makes(name)) fake->made(kind_of(name), args...);
      } else {
        const Result result = (fake->real_.*Member)(args...);
        if constexpr (makes(name)) fake->made(kind_of(name), id(result));
        return result;
      }
    }

   private:
    static std::uint64_t bytes_of([[maybe_unused]] Args... args) {
      [[maybe_unused]] const std::tuple<Args...> all(args...);
      [[maybe_unused]] const auto product = [](auto... sizes) { return (std::uint64_t{4} * ... * sizes); };
      if constexpr (F == Fn::NamedBufferSubData) {
        return std::get<2>(all);
      } else if constexpr (F == Fn::NamedBufferStorage) {
        return std::get<2>(all) != nullptr ? std::get<1>(all) : 0;
      } else if constexpr (F == Fn::TextureSubImage2D) {
        return product(std::get<4>(all), std::get<5>(all));
      } else if constexpr (F == Fn::TextureSubImage3D) {
        return product(std::get<5>(all), std::get<6>(all), std::get<7>(all));
      } else {
        return 0;
      }
    }
    template <class Value>
    static auto convert(Value value) {
      if constexpr (std::is_same_v<Value, GLsync>) {
        return reinterpret_cast<std::uintptr_t>(value);
      } else {
        return value;
      }
    }
    /// As OpenGL 4.5, section 2.3.2: a lost context's calls do nothing, and what a host might poll says it is done.
    static Result lost([[maybe_unused]] Args... args) {
      if constexpr (F == Fn::GetGraphicsResetStatus) return GL_GUILTY_CONTEXT_RESET;
      if constexpr (F == Fn::GetError) return GL_CONTEXT_LOST;
      if constexpr (F == Fn::GetSynciv) poll_done(args..., GL_SIGNALED);
      if constexpr (F == Fn::GetQueryObjectuiv || F == Fn::GetQueryObjectiv) poll_done(args..., GL_TRUE);
      return Result();
    }
    static void poll_done(GLsync, GLenum, GLsizei size, GLsizei*, GLint* values, GLint done) {
      if (size > 0) *values = done;
    }
    template <class Value>
    static void poll_done(GLuint, GLenum parameter, Value* value, GLint done) {
      if (parameter == GL_QUERY_RESULT_AVAILABLE) *value = static_cast<Value>(done);
    }
  };

  static const std::unordered_map<std::string, void*>& wrappers() {
    static const std::unordered_map<std::string, void*> map{
#define FAKE_GL(name) {"gl" #name, reinterpret_cast<void*>(&Wrapper<&GladGLContext::name, Fn::name>::call)},
#include "fake_gl_functions.inc"
#undef FAKE_GL
    };
    return map;
  }

  void use(GLuint program) {
    program_ = program;
    if (parallel_ && !compiled_ && program != 0 && used_.count(program) == 0) ++waits_;
  }
  // GL_COMPLETION_STATUS_KHR; all other questions wait for the driver.
  bool answer(GLuint /*name*/, GLenum what, GLint* value) {
    if (parallel_ && what == 0x91B1) {
      *value = compiled_ ? 1 : 0;
      return true;
    }
    if (parallel_ && !compiled_) ++waits_;
    return false;
  }
  const GLubyte* extension(GLenum what, GLuint index) const {
    const auto bytes = [](const char* text) { return reinterpret_cast<const GLubyte*>(text); };
    if (parallel_ && what == GL_EXTENSIONS && index == 0) return bytes("GL_KHR_parallel_shader_compile");
    // Where the driver itself compiles beside its calls, only a test that wants that may see it.
    const auto* real = reinterpret_cast<const char*>(real_.GetStringi(what, index));
    return real != nullptr && contains(real, "parallel_shader_compile") ? bytes("") : nullptr;
  }

  bool hollow(GLuint shader, GLsizei count, const GLchar* const* sources, const GLint* lengths) const {
    if (hollow_.empty() || count != 1 || lengths != nullptr) return false;
    const std::string_view source = sources[0];
    if (!contains(source, "local_size_x")) return false;
    const auto has = [&](const std::string& line) { return contains(source, line + '\n'); };
    if (std::none_of(hollow_.begin(), hollow_.end(), has)) return false;
    const char* nothing = "#version 450\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
    real_.ShaderSource(shader, 1, &nothing, nullptr);
    return true;
  }

  GetProc get_proc_;
  void* user_;
  GladGLContext real_{};
  std::uint64_t calls_ = 0;
  std::array<std::uint64_t, static_cast<std::size_t>(Fn::count)> calls_of_{};
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
