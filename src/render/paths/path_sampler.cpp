#include "render/paths/path_sampler.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "gl/bindings.hpp"
#include "render/pacing/dispatch_pacer.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t block_lanes = PathKernels::block_lanes;
// Maximum number of lanes. The megakernel has somewhat more than the largest GPU runs at once: with fewer lanes, more
// of them fetch another pixel when theirs is done. Wavefront stages have more, because each kernel processes only some
// of them. Drivers that run dispatches on the CPU have few enough for its caches.
constexpr std::uint32_t lanes_at_once = 128 * block_lanes;
constexpr std::uint32_t lanes_of_stages = PathKernels::max_lanes;
constexpr std::uint32_t lanes_in_call = Accumulation::min_lanes;
static_assert(CM_MAX_SQUARES <= InFlightDispatches::max_words, "the squares must fit into one read-back");
// Such a picture takes a device less than a second. On a processor a host may stop earlier, so pixels must have similar
// numbers of samples.
constexpr std::uint32_t short_picture_samples = 64;
// llvmpipe silently ends a shader's loops after 65,535 iterations in total. This constant bounds the iterations of a
// dispatch: a round takes some hundred.
constexpr std::uint32_t max_rounds = 256;

// Returns a stride through n items that visits each once and jumps far from the last: near n times the golden ratio,
// coprime to n.
std::size_t far_step(std::size_t n) {
  auto step = std::max<std::size_t>(1, static_cast<std::size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(step, n) != 1) ++step;
  return step;
}

}  // namespace

std::uint32_t PathSampler::short_picture() const { return gl_->dispatches_in_call ? 0 : short_picture_samples; }

std::uint32_t PathSampler::max_lanes(const PathFeatures& features) const {
  if (gl_->dispatches_in_call) return lanes_in_call;
  return features.has_stages() ? lanes_of_stages : lanes_at_once;
}

void PathSampler::reserve(const PathFeatures& features, const Accumulation& accumulation) {
  if (!kernels_.reserve(accumulation.lanes(), accumulation.slots(), features.has_stages(), features.grid.several,
                        features.extended_bsdf > 0, features.light_groups))
    paths_of_.reset();
}

StagePrograms PathSampler::stage_programs(const PathFeatures& features) {
  StageKeys keys = stage_keys(features);
  StagePrograms programs;
  programs.begin = programs_.get(std::move(keys.begin)).object;
  programs.travel = programs_.get(std::move(keys.travel)).object;
  programs.intersect = programs_.get(std::move(keys.intersect)).object;
  programs.shade = programs_.get(std::move(keys.shade)).object;
  programs.camera = programs_.get(std::move(keys.camera)).object;
  return programs;
}

void PathSampler::find_programs(const PathFeatures& features, bool measures) {
  if (features.has_stages()) {
    stage_programs(features);
  } else {
    programs_.get(trace_key(features));
  }
  if (measures) programs_.get(noise_key());
}

bool PathSampler::trace(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline,
                        bool until_complete) {
  const std::vector<FilmLayer> layers = picture.accumulated_layers();
  const auto work = [&](Film&, Deadline until) {
    return accumulate(picture, data, trace_inputs, until, until_complete);
  };
  return run(gl_, picture.film(), {"cumulet: samples", layers, layers, work}, deadline);
}

bool PathSampler::accumulate(Picture& picture, const MarchData& data, const TraceInputs& trace_inputs,
                             Deadline deadline, bool until_complete) {
  const PathFeatures& features = picture.features();
  Accumulation& accumulation = picture.accumulation();
  const InFlightDispatches& in_flight = dispatches_.in_flight();
  Kernels kernels{programs_.get(trace_key(features)), std::nullopt};
  dispatches_.order();
  dispatches_.use(*kernels.program.object, data, trace_inputs);
  if (features.layered != Layered::no) {
    gl_->BindTextureUnit(core::CM_UNIT_LAYER_COLOR, picture.layers().color.name());
    gl_->BindTextureUnit(core::CM_UNIT_LAYER_Z, picture.layers().z.name());
  }
  kernels_.bind();
  bind_samples(*gl_, picture);
  if (features.has_stages()) kernels.stages = stage_programs(features);
  until_complete = until_complete && !accumulation.complete();
  // Blocks whose paths were overwritten by another picture's start again.
  const auto begun = [](const Block& block) { return !block.begins; };
  if (paths_of_.lock() != accumulation.blocks() && std::ranges::any_of(*accumulation.blocks(), begun))
    accumulation.begin_tile();
  DispatchPacer pacer(deadline);
  while (!accumulation.done() && !(until_complete && accumulation.complete())) {
    const double aim = std::clamp(pacer.left_ms(in_flight.expected_ms()), 0.0, pacer.max_ms());
    if (send(picture, trace_inputs, kernels, aim, pacer.must_send(in_flight))) {
      pacer.note_sent();
    } else if (!pacer.wait(in_flight)) {
      break;
    }
    dispatches_.collect();
    if (const auto lanes = kernels.program.cost->resident_lanes()) accumulation.limit_lanes(*lanes);
    accumulation.end_tile();
  }
  return accumulation.done();
}

bool PathSampler::send(Picture& picture, const TraceInputs& trace_inputs, const Kernels& kernels, double aim_ms,
                       bool at_least) {
  const Accumulation& accumulation = picture.accumulation();
  const InFlightDispatches& in_flight = dispatches_.in_flight();
  if (in_flight.full()) return false;
  if (accumulation.awaits_error()) {
    measure(picture, trace_inputs);
    (kernels.stages ? kernels.stages->travel : kernels.program.object)->use(*gl_);
    return true;
  }
  const Blocks& blocks = *accumulation.blocks();
  const std::shared_ptr<RoundCost>& cost = kernels.program.cost;
  const std::uint32_t rounds = kernels.stages ? PathKernels::max_rounds() : max_rounds;
  auto what = choose(blocks, accumulation.next_block(), cost, aim_ms, rounds);
  if (!what && at_least) what = choose_minimum(blocks, accumulation.next_block(), cost, rounds);
  if (!what) return false;
  dispatch(picture, trace_inputs, kernels, std::move(*what));
  return true;
}

void PathSampler::measure(Picture& picture, const TraceInputs& trace_inputs) {
  Accumulation& accumulation = picture.accumulation();
  core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
  parameters.dispatch.tile_corner = accumulation.tile_corner();
  parameters.dispatch.tile_size = accumulation.tile_extent();
  dispatches_.set(parameters);
  programs_.get(noise_key()).object->use(*gl_);
  if (!errors_)
    errors_ = gl::make_buffer(gl_, InFlightDispatches::max_words * sizeof(glm::vec4), nullptr, 0,
                              "creating the errors of adaptive-sampling blocks");
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_ERRORS, errors_.name());
  Dispatched what;
  what.errors = accumulation.expect_error();
  const glm::uvec2 squares = accumulation.tile_squares();
  dispatches_.in_flight().begin(InFlightDispatches::Kind::dispatch);
  gl_->DispatchCompute(squares.x, squares.y, 1);
  dispatches_.in_flight().end(std::move(what), errors_.name(), std::size_t{squares.x} * squares.y);
  kernels_.bind();
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  gl::check(*gl_, "measuring the noise");
}

void PathSampler::dispatch(Picture& picture, const TraceInputs& trace_inputs, const Kernels& kernels, Dispatched what) {
  Accumulation& accumulation = picture.accumulation();
  const std::shared_ptr<Blocks>& blocks = accumulation.blocks();
  core::CmParameters parameters = with_current_inputs(picture.parameters(), trace_inputs);
  parameters.surfaces.extended_bsdf = picture.features().extended_bsdf;  // as there is memory for in the paths
  parameters.dispatch.tile_corner = accumulation.tile_corner();
  parameters.dispatch.tile_size = accumulation.tile_extent();
  parameters.dispatch.rounds = what.rounds;
  parameters.dispatch.samples = accumulation.pass_target();
  parameters.dispatch.lanes = accumulation.lanes();
  parameters.dispatch.slots = static_cast<std::uint32_t>(CM_SQUARE_PIXELS * accumulation.squares().size());
  // Blocks are permuted with a large stride. If a driver gives each core a run of work groups, each core gets a
  // fraction of the expensive ones.
  const std::size_t count = what.blocks.size();
  accumulation.set_next_block((what.blocks.back() + 1) % blocks->size());
  std::vector<std::uint32_t> dealt(count);
  const std::size_t step = far_step(count);
  for (std::size_t i = 0; i < count; ++i) dealt[i] = what.blocks[i * step % count];
  what.blocks = std::move(dealt);
  std::uint32_t lanes_a_block = 0;
  constexpr std::size_t header = PathKernels::header_words;
  std::vector<glm::uvec4> words(header + blocks->size(), glm::uvec4(0U));
  for (std::size_t i = 0; i < count; ++i) {
    Block& block = (*blocks)[what.blocks[i]];
    words[header + i].x = what.blocks[i] | block.list << CM_LIST_BIT | (block.begins ? PathKernels::begins_tile : 0U);
    lanes_a_block = std::max(lanes_a_block, block.begins ? block_lanes : block.unfinished);
    block.begins = false;
    block.list = (block.list + 1) % CM_LISTS;
    ++block.under_way;
  }
  picture.set_revision(dispatches_.next_revision());
  what.tile = blocks;
  what.samples = accumulation.count();
  what.rows = picture.row_revisions();
  what.first_row = accumulation.tile_corner().y;
  what.revision = picture.revision();
  what.rows->expect();
  dispatches_.set(parameters);
  kernels_.set_counters(words);
  if (paths_of_.lock() != blocks) {
    kernels_.set_squares(accumulation.squares(), accumulation.lanes());
    paths_of_ = blocks;
  }
  dispatches_.in_flight().begin(InFlightDispatches::Kind::dispatch);
  if (kernels.stages) {
    kernels_.run_stages(*kernels.stages, accumulation.lanes(), count, what.rounds);
  } else {
    kernels_.run_one(std::min(accumulation.lanes(), lanes_a_block), count);
  }
  dispatches_.in_flight().end(std::move(what), kernels_.counters(), words.size());
  gl::memory_barrier(*gl_, GL_SHADER_STORAGE_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                               GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                               GL_TEXTURE_FETCH_BARRIER_BIT);
  gl::check(*gl_, "tracing");
}

}  // namespace cumulet::render
