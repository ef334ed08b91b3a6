#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"

namespace cumulet::render {

using Deadline = std::chrono::steady_clock::time_point;

/// A sequence of GL work steps of about a millisecond each. As many run per call as fit before a deadline. All calls
/// except those that plan need a current context and an active StateGuard.
class Upload {
 public:
  /// Maximum size of a copying step, except if one image row is longer.
  static constexpr std::size_t piece_bytes = std::size_t{2} << 20U;

  /// A part of a texture: in one level and, for an array texture, one layer.
  struct Rectangle {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    int level = 0;
    std::optional<int> layer;
  };

  /// what: prefix of GL error messages, such as "uploading the volume".
  Upload(gl::FunctionsPtr gl, const char* what) : gl_(std::move(gl)), what_(what) {}
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  // These plan steps. Data that the steps read must live until the last step is done.
  void add(std::function<void()> step) {
    add_until([step = std::move(step)] {
      step();
      return true;
    });
  }
  /// Adds a step that is called once per advance() until it returns true; later steps wait for it.
  void add_until(std::function<bool()> step) { steps_.push_back(std::move(step)); }
  /// Adds a step copy(first, count) per piece of piece_bytes, in multiples of `unit` bytes.
  void add_pieces(std::size_t bytes, const std::function<void(std::size_t, std::size_t)>& copy, std::size_t unit = 1);
  /// Adds steps that copy to a buffer with GL_DYNAMIC_STORAGE_BIT, from `offset` on. `to` is called by the steps, when
  /// the buffer exists.
  struct Location {
    GLuint buffer = 0;
    std::size_t offset = 0;
  };
  void add_bytes(std::function<Location()> to, const void* bytes, std::size_t size);
  /// Adds dispatches of a_step items each. They wait until the program is linked.
  using DispatchItems = std::function<void(const gl::Program& program, std::uint32_t first, std::uint32_t end)>;
  void add_dispatches(const gl::ProgramsPtr& programs, const gl::ProgramKey& key, std::uint32_t items,
                      std::uint32_t a_step, const DispatchItems& dispatch);
  /// Adds steps that copy to an 8-bit RGBA texture. The rows are tightly packed, from the top.
  void add_image(std::function<GLuint()> texture, const Rectangle& to, const std::uint8_t* rgba);

  /// Works until the deadline, but at least one step, or until a step has to wait. Returns whether all steps are done.
  /// Throws the errors of steps, and Error(out_of_memory, gl); the upload cannot be continued then.
  bool advance(Deadline deadline);
  [[nodiscard]] bool done() const { return next_ == steps_.size(); }
  [[nodiscard]] double progress() const { return steps_.empty() ? 1.0 : double(next_) / double(steps_.size()); }

 private:
  gl::FunctionsPtr gl_;
  const char* what_;
  std::vector<std::function<bool()>> steps_;
  std::size_t next_ = 0;
};

}  // namespace cumulet::render
