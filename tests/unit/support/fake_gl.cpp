#include "support/fake_gl.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <unordered_map>

namespace cumulet::test {

namespace {

FakeGl*& current_fake() {
  static thread_local FakeGl* fake = nullptr;
  return fake;
}
std::atomic<std::uint64_t>& stray_counter() {
  static std::atomic<std::uint64_t> count = 0;
  return count;
}

constexpr bool starts(std::string_view name, std::string_view with) { return name.substr(0, with.size()) == with; }
constexpr bool contains(std::string_view name, std::string_view part) {
  return name.find(part) != std::string_view::npos;
}
constexpr bool makes(std::string_view name) {
  return starts(name, "Create") || name == "FenceSync" || (starts(name, "Gen") && !starts(name, "Generate"));
}
constexpr bool allocates(std::string_view name) {
  return makes(name) || contains(name, "Storage") || name == "NamedBufferData" || name == "BufferData" ||
         starts(name, "TexImage") || starts(name, "CopyTexImage") || starts(name, "MapBuffer") ||
         starts(name, "MapNamedBuffer") || name == "CompileShader" || name == "LinkProgram";
}
std::string kind_of(std::string_view name) {
  if (name == "FenceSync") return "Sync";
  if (name == "CreateShaderProgramv") return "Program";
  return std::string(name.substr(starts(name, "Gen") ? 3 : 6));
}

template <class Result>
std::uintptr_t id(Result result) {
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
constexpr std::array<std::string_view, static_cast<std::size_t>(Fn::count)> fn_names{
#define FAKE_GL(name) #name,
#include "fake_gl_functions.inc"
#undef FAKE_GL
};

}  // namespace

struct FakeGl::Wrappers {
  template <auto Member, Fn F>
  struct Wrapper;
  template <class Result, class... Args, Result (*GladGLContext::*Member)(Args...), Fn F>
  struct Wrapper<Member, F> {
    static constexpr std::string_view name = fn_names[static_cast<std::size_t>(F)];

    static Result call(Args... args) {
      FakeGl* fake = current_fake();
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
      if constexpr (F == Fn::NamedBufferStorage) fake->store(args...);
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
    /// OpenGL 4.5, section 2.3.2: calls in a lost context do nothing, and queries that a host may poll report
    /// completion.
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

  static const std::unordered_map<std::string, void*>& all() {
    static const std::unordered_map<std::string, void*> map{
#define FAKE_GL(name) {"gl" #name, reinterpret_cast<void*>(&Wrapper<&GladGLContext::name, Fn::name>::call)},
#include "fake_gl_functions.inc"
#undef FAKE_GL
    };
    return map;
  }
};

FakeGl::FakeGl(GetProc real_get_proc, void* user) : get_proc_(real_get_proc), user_(user), calls_of_(fn_names.size()) {
  std::pair<GetProc, void*> real(real_get_proc, user);
  const auto load = [](void* loader, const char* name) {
    const auto& [function, its_user] = *static_cast<std::pair<GetProc, void*>*>(loader);
    return reinterpret_cast<GLADapiproc>(function(its_user, name));
  };
  gladLoadGLContextUserPtr(&real_, load, &real);
  make_current();
}

FakeGl::~FakeGl() {
  if (current_fake() == this) current_fake() = nullptr;
}

void FakeGl::make_current() { current_fake() = this; }

std::uint64_t FakeGl::strays() { return stray_counter(); }

void* FakeGl::get_proc(void* user, const char* name) {
  auto* fake = static_cast<FakeGl*>(user);
  fake->make_current();
  void* real = fake->get_proc_(fake->user_, name);
  const auto found = Wrappers::all().find(name);
  return real == nullptr || found == Wrappers::all().end() ? real : found->second;
}

std::uint64_t FakeGl::calls(const std::string& name) const {
  const auto found = std::find(fn_names.begin(), fn_names.end(), name);
  return found == fn_names.end() ? 0 : calls_of_[static_cast<std::size_t>(found - fn_names.begin())];
}

std::uint64_t FakeGl::questions() const {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < fn_names.size(); ++i) {
    const std::string_view name = fn_names[i];
    const bool asks = starts(name, "Is") || starts(name, "GetInteger") || starts(name, "GetBoolean") ||
                      starts(name, "GetFloat") || starts(name, "GetDouble") || starts(name, "GetTextureParameter");
    if (asks && name != "IsBuffer") count += calls_of_[i];
  }
  return count;
}

std::map<std::string, std::size_t> FakeGl::alive() const {
  std::map<std::string, std::size_t> counts;
  for (const auto& [kind, names] : alive_)
    if (!names.empty()) counts[kind] = names.size();
  return counts;
}

void FakeGl::made(const std::string& kind, std::uintptr_t name) {
  if (name != 0) alive_[kind].insert(name);
}

void FakeGl::made(const std::string& kind, GLsizei n, const GLuint* names) {
  for (GLsizei i = 0; i < n; ++i) made(kind, names[i]);
}

void FakeGl::made(const std::string& kind, GLenum /*target*/, GLsizei n, const GLuint* names) { made(kind, n, names); }

void FakeGl::store(GLuint buffer, GLsizeiptr size, const void* /*data*/, GLbitfield /*flags*/) {
  buffers_[buffer] = static_cast<std::uint64_t>(size);
}

std::uint64_t FakeGl::buffer_bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [name, size] : buffers_) sum += size;
  return sum;
}

void FakeGl::deleted(const std::string& kind, std::uintptr_t name) {
  if (kind == "Buffers") buffers_.erase(name);
  if (name != 0 && alive_[kind].erase(name) == 0) ++wrong_deletes_;
}

void FakeGl::deleted(const std::string& kind, GLsizei n, const GLuint* names) {
  for (GLsizei i = 0; i < n; ++i) deleted(kind, names[i]);
}

void FakeGl::use(GLuint program) {
  program_ = program;
  if (parallel_ && !compiled_ && program != 0 && used_.count(program) == 0) ++waits_;
}

bool FakeGl::answer(GLuint /*name*/, GLenum what, GLint* value) {
  if (parallel_ && what == 0x91B1) {
    *value = compiled_ ? 1 : 0;
    return true;
  }
  if (parallel_ && !compiled_) ++waits_;
  return false;
}

const GLubyte* FakeGl::extension(GLenum what, GLuint index) const {
  const auto bytes = [](const char* text) { return reinterpret_cast<const GLubyte*>(text); };
  if (parallel_ && what == GL_EXTENSIONS && index == 0) return bytes("GL_KHR_parallel_shader_compile");
  // Hides the extensions for parallel shader compilation unless a test enables them.
  const auto* real = reinterpret_cast<const char*>(real_.GetStringi(what, index));
  return real != nullptr && contains(real, "parallel_shader_compile") ? bytes("") : nullptr;
}

bool FakeGl::hollow(GLuint shader, GLsizei count, const GLchar* const* sources, const GLint* lengths) const {
  if (hollow_.empty() || count != 1 || lengths != nullptr) return false;
  const std::string_view source = sources[0];
  if (!contains(source, "local_size_x")) return false;
  const auto has = [&](const std::string& line) { return contains(source, line + '\n'); };
  if (std::none_of(hollow_.begin(), hollow_.end(), has)) return false;
  const char* nothing = "#version 450\nlayout(local_size_x = 1) in;\nvoid main() {}\n";
  real_.ShaderSource(shader, 1, &nothing, nullptr);
  return true;
}

}  // namespace cumulet::test
