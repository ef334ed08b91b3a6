#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
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

/// Which program: a file of glsl/ and one of the variants that it names (cmake/embed_glsl.py).
struct ProgramKey {
  std::string name;                  ///< a compute or a fragment shader
  std::vector<std::string> defines;  ///< "NAME VALUE", each
  std::string vertex{};              ///< the vertex shader that goes before a fragment shader
  bool operator<(const ProgramKey& other) const {
    return std::tie(name, vertex, defines) < std::tie(other.name, other.vertex, other.defines);
  }
};

/// A program of Programs. Its uniforms are set anew before each use: viewers share it.
class Program {
 public:
  enum class State {
    absent,     // nobody has asked for it
    compiling,  // the driver is at it
    linked,     // it can be used; the driver may compile more in the first use
    ready,      // it was used
    failed,     // it does not build
  };
  Program() = default;
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  Program(Program&&) = delete;
  Program& operator=(Program&&) = delete;
  ~Program() = default;

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool usable() const { return state_ == State::linked || state_ == State::ready; }
  /// Only of one that is usable.
  [[nodiscard]] GLuint name() const { return object_.name(); }
  /// Makes it current for the dispatch or the draws that follow. Only of one that is usable.
  void use(const Functions& gl) const {
    gl.UseProgram(object_.name());
    state_ = State::ready;
  }

 private:
  friend class Programs;
  Object object_;
  std::vector<Object> shaders_;   // while it compiles
  std::optional<Error> failure_;  // why the driver does not build it
  mutable State state_ = State::absent;
};

/// All programs of one share group, by their keys: each is made when it is first asked for, and kept. Calls need a
/// context of the group current, and a Turn around them.
class Programs {
 public:
  /// Of the current context. files: where binaries are kept between runs; none: nowhere. Throws on a GL error.
  /// shaders: what their sources are instead of what is embedded; null: those.
  Programs(const Functions& gl, std::shared_ptr<ProgramFiles> files, std::shared_ptr<ShaderFolder> shaders = nullptr);
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;
  Programs(Programs&&) = delete;
  Programs& operator=(Programs&&) = delete;
  /// Without a context of the group its programs stay behind.
  ~Programs();

  /// One viewer's turn: those of other threads wait. What there is to log goes to its log.
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

  /// The program, begun if it is not there: where the driver compiles in parallel it may still be compiling, else it is
  /// linked on return. Throws Error(gl) with the driver's log if it does not build, again and again without asking the
  /// driver anew until try_again(), and Error(internal) for macros that are none of the variants that the shader's
  /// source names: those are validated, and their cost on GPUs is known (tests/gpu_cost).
  const Program& ask(const ProgramKey& key);
  /// The same, linked: waits for the driver, and tries again what did not build.
  const Program& get(const ProgramKey& key);
  /// What did not build is built anew where it is asked for next.
  void try_again();
  /// Without asking the driver.
  [[nodiscard]] Program::State state(const ProgramKey& key) const;
  /// Builds programs anew whose sources have changed. One that does not build is one line in the log, and stays what it
  /// was.
  void refresh();
  /// Another whenever that changed any, or one that did not build may do so now.
  [[nodiscard]] const Revision<Programs>& revision() const { return revision_; }
  /// Those that were asked for, and those of them that were used: the driver has no more to compile for these, nor for
  /// those that failed.
  struct Counts {
    std::size_t asked = 0;
    std::size_t usable = 0;
    std::size_t ready = 0;
    std::size_t failed = 0;
  };
  [[nodiscard]] Counts counts() const;
  /// Whether the driver compiles while the calling thread does other things (KHR_parallel_shader_compile).
  [[nodiscard]] bool parallel() const { return parallel_; }
  /// Whether a context of the group is current on the calling thread.
  [[nodiscard]] bool is_current() const { return group_.is_current(); }
  /// The contexts are gone, and with them the programs.
  void abandon() const { gl_->abandoned = true; }

 private:
  void begin(const ProgramKey& key, Program& program);
  // Whether the binary of an earlier run served.
  bool load(const ProgramKey& key, Program& program);
  [[nodiscard]] bool complete(const Program& program) const;
  // What the driver made of it. Throws if that is nothing.
  void finish(const ProgramKey& key, Program& program);
  [[nodiscard]] std::string failure(const ProgramKey& key, const Program& program) const;
  // For the next run.
  void keep(const ProgramKey& key, const Program& program);

  FunctionsPtr gl_;  // its own: viewers come and go
  ShareGroup group_;
  bool parallel_ = false;
  std::shared_ptr<ProgramFiles> files_;
  std::shared_ptr<ShaderFolder> shaders_;
  Revision<Programs> revision_;
  std::string driver_;  // what binaries are good for
  std::map<ProgramKey, std::unique_ptr<Program>> programs_;
  std::mutex turn_;
  const Log* log_ = nullptr;  // of the viewer whose turn it is
};

using ProgramsPtr = std::shared_ptr<Programs>;

/// Every variant in the table but those that few pictures need: groups of lights, holdouts, motion blur. Of macros with
/// a range of numbers the first.
std::vector<ProgramKey> all_programs();

/// Finds out Functions::dispatches_in_call, by a small dispatch. Needs a StateGuard around. Throws on a GL error.
void find_out_dispatches(const FunctionsPtr& gl, Programs& programs);

/// What viewers that share programs have in common: the Programs of each share group that one of them is attached to.
/// Safe from any thread.
class ProgramPool {
 public:
  explicit ProgramPool(std::shared_ptr<ProgramFiles> files = nullptr, std::shared_ptr<ShaderFolder> shaders = nullptr)
      : files_(std::move(files)), shaders_(std::move(shaders)) {}
  /// Those of the current context's group. Throws on a GL error.
  ProgramsPtr of_current(const Functions& gl);

 private:
  std::mutex mutex_;
  std::shared_ptr<ProgramFiles> files_;
  std::shared_ptr<ShaderFolder> shaders_;
  std::vector<std::weak_ptr<Programs>> groups_;
};

}  // namespace cumulet::gl
