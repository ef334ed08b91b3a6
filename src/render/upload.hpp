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

/// The way of anything large to GL: steps of about a millisecond each, as many at a time as fit before a deadline.
/// All calls but those that plan need the context current and a StateGuard around.
class Upload {
 public:
  /// What a step copies at most, but for rows of images that are longer.
  static constexpr std::size_t piece_bytes = std::size_t{2} << 20U;

  /// A part of a texture: of one level and, if it is an array, of one layer.
  struct Rectangle {
    glm::uvec2 corner{0U};
    glm::uvec2 size{0U};
    int level = 0;
    std::optional<int> layer;
  };

  /// what: of errors of GL's, "uploading the volume".
  Upload(gl::FunctionsPtr gl, const char* what) : gl_(std::move(gl)), what_(what) {}
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  // To plan; what the steps look at has to live until the last was made.
  void add(std::function<void()> step) {
    add_until([step = std::move(step)] {
      step();
      return true;
    });
  }
  /// What is not done before it returns true, which it is asked once a call.
  void add_until(std::function<bool()> step) { steps_.push_back(std::move(step)); }
  /// A step for each piece of this many bytes: copy(first, count). Pieces are of whole units.
  void add_pieces(std::size_t bytes, const std::function<void(std::size_t, std::size_t)>& copy, std::size_t unit = 1);
  /// Into a buffer with GL_DYNAMIC_STORAGE_BIT, from `offset` on: asked for when it is there.
  struct Place {
    GLuint buffer = 0;
    std::size_t offset = 0;
  };
  void add_bytes(std::function<Place()> to, const void* bytes, std::size_t size);
  /// A step for each so many of these items, once the driver has the program.
  using DispatchItems = std::function<void(const gl::Program& program, std::uint32_t first, std::uint32_t end)>;
  void add_dispatches(const gl::ProgramsPtr& programs, const gl::ProgramKey& key, std::uint32_t items,
                      std::uint32_t a_step, const DispatchItems& dispatch);
  /// Into an 8-bit RGBA texture, of rows from the top without gaps.
  void add_image(std::function<GLuint()> texture, const Rectangle& to, const std::uint8_t* rgba);

  /// Works until the deadline, one step at least, or to one that has to wait. Returns whether all are done. Throws what
  /// a step throws, and Error(out_of_memory, gl); then there is nothing to go on with.
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
