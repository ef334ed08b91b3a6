#include "render/paths/trace_dispatches.hpp"

#include <algorithm>
#include <bit>

#include "gl/bindings.hpp"
#include "render/pacing/row_dispatches.hpp"
#include "render/paths/path_kernels.hpp"

namespace cumulet::render {

namespace {

// In shorter dispatches some work groups may end before others begin.
constexpr std::uint32_t telling_rounds = 16;

}  // namespace

void TraceDispatches::allocate() {
  if (!parameters_)
    parameters_ =
        gl::make_buffer(gl_, sizeof(core::CmParameters), nullptr, GL_DYNAMIC_STORAGE_BIT, "creating uniforms");
}

void TraceDispatches::use(const gl::Program& program, const MarchData& data, const TraceInputs& trace_inputs) {
  allocate();
  program.use(*gl_);
  data.bind(*gl_);
  bind_inputs(*gl_, trace_inputs);
  gl_->BindBufferBase(GL_UNIFORM_BUFFER, core::CM_UNIFORM_PARAMETERS, parameters_.name());
}

void TraceDispatches::set(const core::CmParameters& parameters) const {
  gl_->NamedBufferSubData(parameters_.name(), 0, sizeof(parameters), &parameters);
}

void TraceDispatches::collect() {
  while (const auto completed = in_flight_.take_completed()) {
    (completed->words.empty() ? seconds_.inspect : seconds_.trace) += 1e-3 * completed->ms.value_or(0.0);
    if (completed->words.empty()) {
      learn_rows(*completed);
    } else if (completed->what.errors) {
      for (const glm::uvec4& square : completed->words) {
        const auto error = std::bit_cast<glm::vec4>(square);
        completed->what.errors->push_back({{error.x, error.y}, error.z, error.w});
      }
    } else {
      collect_samples(*completed);
    }
  }
  while (const auto completed = draws_.take_completed()) {
    seconds_.surfaces += 1e-3 * completed->ms.value_or(0.0);
    const double rate = completed->what.lanes / std::max(1e-3, completed->ms.value_or(completed->at_most_ms));
    if (completed->ms || rate > raster_rate_) raster_rate_ += 0.3 * (rate - raster_rate_);
  }
}

void TraceDispatches::collect_samples(const InFlightDispatches::Completed& completed) {
  const Dispatched& what = completed.what;
  learn(what, completed.ms, completed.at_most_ms, completed.words[0].x);
  if (!gl_->dispatches_in_call && what.rounds >= telling_rounds)
    what.cost->learn_groups(completed.words[1].z, completed.words[1].y);
  what.rows->change(what.first_row, completed.words[0].y, completed.words[0].z, what.revision);
  for (const std::uint32_t block : what.blocks)
    what.samples->finished += completed.words[PathKernels::header_words + block].w;
  what.samples->not_finite += completed.words[0].w;
  if (log_ != nullptr) {
    const double ms = completed.ms.value_or(completed.at_most_ms);
    const auto lanes = static_cast<std::uint32_t>(what.blocks.size()) * PathKernels::block_lanes;
    log_->push_back({what.aim_ms, ms, lanes, static_cast<std::uint32_t>(what.lanes), what.rounds, what.max_ms > 0.0});
  }
  for (const std::uint32_t index : what.blocks) {
    Block& block = (*what.tile)[index];
    const glm::uvec4& counts = completed.words[PathKernels::header_words + index];
    block.unfinished = counts.y;
    block.empty = counts.z;
    --block.under_way;
  }
}

bool TraceDispatches::run_rows(const PixelBox& box, core::CmParameters parameters,
                               const std::shared_ptr<RoundCost>& cost, std::uint32_t& row, Deadline deadline) {
  const glm::uvec2 size = box.size;
  parameters.dispatch.tile_corner = box.first;
  parameters.dispatch.tile_size = size;
  const auto send = [&](glm::uvec2 rows) {
    parameters.dispatch.rows = rows;
    set(parameters);
    gl_->DispatchCompute((size.x + 7) / 8, (rows.y - rows.x + 7) / 8, 1);
  };
  send_rows(in_flight_, cost, size, row, deadline, send, [&] { collect(); });
  gl::memory_barrier(*gl_, GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                               GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  gl::check(*gl_, "checking the pixels");
  return row >= size.y;
}

}  // namespace cumulet::render
