#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/revision.hpp"
#include "gl/objects.hpp"
#include "gl/program_files.hpp"
#include "gl/shader_folder.hpp"
#include "gl/share_group.hpp"

namespace cumulet::gl {

/// Identifies a program: a file of glsl/ and one of the variants that the file declares (cmake/embed_glsl.py).
struct ProgramKey {
  std::string name;                  ///< a compute or a fragment shader
  std::vector<std::string> defines;  ///< each "NAME VALUE"
  std::string vertex{};              ///< the vertex shader to link with a fragment shader
  bool operator<(const ProgramKey& other) const {
    return std::tie(name, vertex, defines) < std::tie(other.name, other.vertex, other.defines);
  }
};

/// A program of Programs. Its uniforms must be set before each use, because viewers share it.
class Program {
 public:
  enum class State {
    absent,     // not requested yet
    compiling,  // the driver is compiling it
    linked,     // usable; the driver may compile more at the first use
    ready,      // has been used
    failed,     // failed to compile or link
  };
  Program() = default;
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  Program(Program&&) = delete;
  Program& operator=(Program&&) = delete;
  ~Program() = default;

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool usable() const { return state_ == State::linked || state_ == State::ready; }
  /// Only valid if usable.
  [[nodiscard]] GLuint name() const { return object_.name(); }
  /// Makes the program current for the following dispatches or draws. Only valid if usable.
  void use(const Functions& gl) const {
    gl.UseProgram(object_.name());
    state_ = State::ready;
  }

 private:
  friend class Programs;
  Object object_;
  std::vector<Object> shaders_;   // only while compiling
  std::optional<Error> failure_;  // the driver's build error
  mutable State state_ = State::absent;
};

/// All shader programs of one share group by key. Each is built at the first request and kept. Calls need a context of
/// the group current, and a Turn in scope.
class Programs {
 public:
  /// Uses the share group of the current context. files: disk cache for binaries; null: none. shaders: folder whose
  /// sources replace the embedded ones; null: the embedded sources. Throws on a GL error.
  Programs(const Functions& gl, std::shared_ptr<ProgramFiles> files, std::shared_ptr<ShaderFolder> shaders = nullptr);
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;
  Programs(Programs&&) = delete;
  Programs& operator=(Programs&&) = delete;
  /// If no context of the group is current, its programs are not deleted.
  ~Programs();

  /// Exclusive access by one viewer; other threads wait. Messages go to the log of this viewer.
  class Turn {
   public:
    Turn(std::shared_ptr<Programs> programs, const Log& log) : programs_(std::move(programs)), lock_(programs_->turn_) {
      programs_->log_ = &log;
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    Turn(Turn&&) = delete;
    Turn& operator=(Turn&&) = delete;
    ~Turn() { programs_->log_ = nullptr; }

   private:
    std::shared_ptr<Programs> programs_;
    std::scoped_lock<std::mutex> lock_;
  };

  /// Returns the program, and starts to build it if needed. If the driver compiles in parallel the program may still be
  /// compiling on return; otherwise it is linked. Throws Error(gl) with the driver's log if the build fails, and
  /// repeats that error without another build until try_again(). Throws Error(internal) for macros that the shader's
  /// source does not declare as a variant: the declared variants are validated, and their GPU cost is measured
  /// (tests/gpu_cost).
  const Program& ask(const ProgramKey& key);
  /// Like ask(), but waits until the program is linked, and retries a failed build.
  const Program& get(const ProgramKey& key);
  /// Failed programs are built again at their next request.
  void try_again();
  /// Returns the state without a driver call.
  [[nodiscard]] Program::State state(const ProgramKey& key) const;
  /// Rebuilds programs whose sources in the folder have changed. If a build fails, one line is logged and the program
  /// stays unchanged.
  void refresh();
  /// Revision number; changes when refresh() replaced a program, or when a failed program may be built again.
  [[nodiscard]] const Revision<Programs>& revision() const { return revision_; }
  /// `asked`: programs requested. `usable`: of these, the linked ones. `ready`: of these, the ones that were used, for
  /// which the driver has nothing more to compile. `failed`: programs that do not build.
  struct Counts {
    std::size_t asked = 0;
    std::size_t usable = 0;
    std::size_t ready = 0;
    std::size_t failed = 0;
  };
  [[nodiscard]] Counts counts() const;
  /// Whether the driver compiles in the background (KHR_parallel_shader_compile).
  [[nodiscard]] bool parallel() const { return parallel_; }
  /// Whether a context of the group is current on the calling thread.
  [[nodiscard]] bool is_current() const { return group_.is_current(); }
  /// Marks the contexts as lost, and the programs with them.
  void abandon() const { gl_->abandoned = true; }

 private:
  void begin(const ProgramKey& key, Program& program);
  // Logs that a shader is read from the folder, once per shader.
  void log_shader(const std::string& name);
  // Loads the binary of an earlier run. Returns false if there is none or the driver rejects it.
  bool load(const ProgramKey& key, Program& program);
  [[nodiscard]] bool complete(const Program& program) const;
  // Waits for the driver and fetches the result. Throws if the build failed.
  void finish(const ProgramKey& key, Program& program);
  [[nodiscard]] std::string failure(const ProgramKey& key, const Program& program) const;
  // Stores the binary for the next run.
  void keep(const ProgramKey& key, const Program& program);

  FunctionsPtr gl_;  // its own copy: viewers are destroyed earlier
  ShareGroup group_;
  bool parallel_ = false;
  std::shared_ptr<ProgramFiles> files_;
  std::shared_ptr<ShaderFolder> shaders_;
  std::set<std::string> logged_shaders_;
  Revision<Programs> revision_;
  std::string driver_;  // identifies the driver in the keys of binaries
  std::map<ProgramKey, std::unique_ptr<Program>> programs_;
  std::mutex turn_;
  const Log* log_ = nullptr;  // of the viewer that holds the Turn
};

using ProgramsPtr = std::shared_ptr<Programs>;

/// Returns every variant in the table except rarely used ones: light groups, holdouts, clips, motion blur, wide grids.
/// For macros with a range of numbers, only the first number.
std::vector<ProgramKey> all_programs();

/// Determines Functions::dispatches_in_call with a small dispatch. Needs a StateGuard in scope. Throws on a GL error.
void find_out_dispatches(const FunctionsPtr& gl, Programs& programs);

/// Shader programs of viewers that share them: one Programs per share group that such a viewer is attached to. Safe
/// from any thread.
class ProgramPool {
 public:
  explicit ProgramPool(std::shared_ptr<ProgramFiles> files = nullptr, std::shared_ptr<ShaderFolder> shaders = nullptr)
      : files_(std::move(files)), shaders_(std::move(shaders)) {}
  /// Returns the programs of the current context's share group. Throws on a GL error.
  ProgramsPtr of_current(const Functions& gl);

 private:
  std::mutex mutex_;
  std::shared_ptr<ProgramFiles> files_;
  std::shared_ptr<ShaderFolder> shaders_;
  std::vector<std::weak_ptr<Programs>> groups_;
};

}  // namespace cumulet::gl
