#include "render/grid/grid_passes.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/milliseconds.hpp"
#include "gl/bindings.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t group = 64;       // invocations per work group, of all kernels here
constexpr double max_in_flight_ms = 8.0;  // independent of the deadline, because the host draws, too

// Estimated time of a cheap item before any measurement. Drivers that run dispatches within the call run them on the
// CPU.
double cost_ms(const gl::Functions& gl) { return std::exp2(gl.dispatches_in_call ? -18.0 : -22.0); }

}  // namespace

void GridPasses::clear_in_flight() {
  in_flight_.clear();
  in_flight_ms_ = 0.0;
}

double GridPasses::aim_ms() const {
  constexpr double least = 0.5;
  constexpr double most = 2.0;
  return std::clamp(pacer_.left_ms(0.0), least, most);
}

bool GridPasses::has_room_in_flight() {
  if (in_flight_ms_ < max_in_flight_ms) return true;
  if (!fence_.passed()) return false;
  pace_->learn(in_flight_, milliseconds(std::chrono::steady_clock::now() - sent_), GridPace::Measured::at_most);
  clear_in_flight();
  return true;
}

std::optional<std::uint32_t> GridPasses::dispatch(const Pass& pass, std::uint32_t first, std::uint32_t end,
                                                  const Bind& bind) {
  if (!has_room_in_flight()) return std::nullopt;
  const gl::Program& program = programs_->ask(pass.key);
  if (!program.usable()) return std::nullopt;
  constexpr std::uint32_t max_groups = 65535;  // supported by every driver
  const double ms = pass.weight * pace_->ms(pass.key, pass.cost * cost_ms(*gl_));
  const double fit = std::clamp(aim_ms() / ms, double{group}, double{max_groups} * (pass.item_a_group ? 1.0 : group));
  const std::uint32_t items = std::min(static_cast<std::uint32_t>(fit), end - first);
  const gl::DebugGroup debug(*gl_, "cumulet: grid");
  gl_->ProgramUniform1ui(program.name(), 0, first);
  gl_->ProgramUniform1ui(program.name(), 1, first + items);
  if (pass.of_lattice) gl_->ProgramUniform1ui(program.name(), 2, log2_size_);
  bind(program.name());
  program.use(*gl_);
  const auto begun = std::chrono::steady_clock::now();
  gl_->DispatchCompute(pass.item_a_group ? items : (items + group - 1) / group, 1, 1);
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  const GridPace::Sent sent{pass.key, pass.cost * cost_ms(*gl_), static_cast<double>(items), pass.weight};
  if (gl_->dispatches_in_call) {
    pace_->learn({sent}, milliseconds(std::chrono::steady_clock::now() - begun), GridPace::Measured::exactly);
    return first + items;
  }
  if (in_flight_.empty()) sent_ = begun;
  in_flight_.push_back(sent);
  in_flight_ms_ += ms * items;
  if (in_flight_ms_ >= max_in_flight_ms) fence_ = gl::Fence(gl_);
  return first + items;
}

void GridPasses::plan(Upload& upload, const Pass& pass, std::uint32_t first, std::uint32_t end, const Bind& bind) {
  if (first == end) return;  // an empty pass would still cost a step
  upload.add_until([this, pass, next = first, end, bind]() mutable {
    while (next < end) {
      const std::optional<std::uint32_t> left = dispatch(pass, next, end, bind);
      if (!left) return false;
      next = *left;
      if (pacer_.is_over()) break;
    }
    return next >= end;
  });
}

}  // namespace cumulet::render
