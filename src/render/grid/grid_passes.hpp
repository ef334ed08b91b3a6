#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "gl/objects.hpp"
#include "gl/programs.hpp"
#include "render/pacing/dispatch_pacer.hpp"
#include "render/pacing/grid_pace.hpp"
#include "render/pacing/upload.hpp"

namespace cumulet::render {

/// Runs the compute passes of a grid build. Passes are split into dispatches of about a millisecond, by the measured
/// times of their kernels. A fence bounds the work in flight. All calls need a current context and an active
/// StateGuard.
class GridPasses {
 public:
  /// A pass of one kernel. cost: estimated time per item, relative to a cheap one.
  struct Pass {
    gl::ProgramKey key;
    std::uint32_t cost = 1;
    bool item_a_group = false;  // one work group of 64 invocations per item, else one invocation
    bool of_lattice = true;     // the kernel includes glsl/grid/lattice_lookup.glsl
    double weight = 1.0;        // per item, if the items of a kernel differ
  };
  using Bind = std::function<void(GLuint program)>;

  /// log2_size: of the lattice's cube.
  GridPasses(gl::FunctionsPtr gl, gl::ProgramsPtr programs, GridPacePtr pace, int log2_size)
      : gl_(std::move(gl)),
        programs_(std::move(programs)),
        pace_(std::move(pace)),
        log2_size_(static_cast<GLuint>(log2_size)) {}
  GridPasses(const GridPasses&) = delete;
  GridPasses& operator=(const GridPasses&) = delete;

  /// Sets the deadline of the following steps.
  void begin_call(Deadline deadline) { pacer_ = DispatchPacer(deadline); }
  /// Plans a pass over items [first, end), in dispatches of bounded time. bind: binds buffers, and sets uniforms beyond
  /// the first three.
  void plan(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  /// Forgets the dispatches in flight. The caller waits for a fence after them.
  void clear_in_flight();

 private:
  // Sends one dispatch with the first of the items. Returns the end of its items; nullopt if it has to wait.
  std::optional<std::uint32_t> dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind);
  [[nodiscard]] double aim_ms() const;
  // Returns whether little enough work is in flight.
  bool has_room_in_flight();

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  GridPacePtr pace_;
  GLuint log2_size_;
  DispatchPacer pacer_{Deadline{}};  // of the current call
  gl::Fence fence_;
  std::vector<GridPace::Sent> in_flight_;       // since the previous ones were seen to be finished
  double in_flight_ms_ = 0.0;                   // estimated time of these
  std::chrono::steady_clock::time_point sent_;  // when the first of them was sent
};

}  // namespace cumulet::render
