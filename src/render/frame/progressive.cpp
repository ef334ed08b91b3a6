#include "render/frame/progressive.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "base/error.hpp"
#include "base/milliseconds.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t coarsest_divisor = 16;
// Maximum samples per pixel of a coarse picture.
constexpr std::uint32_t preview_samples = 16;
// The last few samples of a coarse picture have the longest paths. The next picture does not wait for them.
constexpr double nearly_all = 0.9;
// Memory for the surface pass at full resolution: eight layers at 1080p.
constexpr double max_layer_bytes = 256e6;
// Frames that the first picture after a change may take.
constexpr double answer_frames = 2.0;
// Feature rays per pixel that the denoiser starts with. More would take longer than samples of equal benefit.
constexpr std::uint32_t first_guide_rays = 4;
using State = Schedule::State;
using Clock = std::chrono::steady_clock;

// Returns a seed per view: the denoiser's history helps only if its samples are independent of the current ones.
std::uint32_t seed_of(const PictureParameters& parameters) {
  const core::CmView& view = parameters.view;
  std::uint32_t hash = parameters.integrator.seed;
  for (const glm::vec3& vector : {view.eye, view.forward, view.right, view.up}) {
    for (int i = 0; i < 3; ++i) {
      hash = (hash ^ std::bit_cast<std::uint32_t>(vector[i])) * 0x9E3779B1U;
      hash ^= hash >> 15U;
    }
  }
  return hash;
}

std::shared_ptr<const void> traced_scene(const TraceInputs& trace_inputs) {
  const ModelInstances* models = trace_inputs.traced_models();
  return models != nullptr ? models->numbering() : nullptr;
}

}  // namespace

bool PictureRequest::Content::shows_same(const Content& other) const {
  Content seen = other;
  seen.viewpoint = viewpoint;
  seen.previous = previous;
  seen.view_ends = view_ends;
  seen.host_depth = host_depth;
  seen.programs = programs;
  seen.size = size;
  seen.options = options;
  seen.options.view = other.options.view;
  seen.stops_by_noise = stops_by_noise;
  return seen == *this;
}

std::uint32_t Progressive::enough(std::uint32_t divisor) const {
  const std::uint32_t wanted = request_.content.options.view == View::shaded ? request_.samples : 1;
  if (divisor <= finest_) return wanted;
  // A quarter of the work of one sample per pixel at full resolution.
  const std::uint32_t affordable = divisor / finest_ * (divisor / finest_) / 4;
  return std::clamp(std::min(affordable, preview_samples), 1U, wanted);
}

glm::uvec2 Progressive::size_of(std::uint32_t divisor) const {
  return (request_.content.size + divisor - 1U) / divisor;
}

double Progressive::pixels_of(std::uint32_t divisor) const {
  return static_cast<double>(request_.content.options.region.pixels(size_of(divisor), margin_of(divisor)).area());
}

unsigned Progressive::margin_of(std::uint32_t divisor) const {
  return divisor > 1 && !request_.content.options.region.is_whole() ? 1 : 0;
}

bool Progressive::is_enough() const {
  const Picture& picture = *working_->picture;
  const auto wanted = static_cast<double>(picture.box().area() * picture.target_samples());
  return picture.done() || (picture.complete() && static_cast<double>(picture.samples()) >= nearly_all * wanted);
}

std::uint32_t Progressive::coarsest(double budget_ms) const {
  if (!request_.content.options.preview) return 1;
  const double pixels = pixels_of(1);
  std::uint32_t divisor = finest_;
  while (divisor < coarsest_divisor && pixels / (double(divisor) * divisor) > answer_frames * answer_rate_ * budget_ms)
    divisor *= 2;
  return divisor;
}

Picture& Progressive::acquire(glm::uvec2 size) {
  const auto is_free = [this](const auto& picture) { return picture.get() != shown() && picture.get() != before(); };
  // This includes the picture being rendered if it is not shown, because it is replaced.
  for (const auto& picture : pictures_) {
    if (is_free(picture) && picture->size() == size) return *picture;
  }
  for (const auto& picture : pictures_) {
    if (is_free(picture) && pictures_.size() >= 3) return *picture;
  }
  return *pictures_.emplace_back(std::make_unique<Picture>());
}

PictureSettings Progressive::quick_layers(const Tracer& tracer, glm::uvec2 size, double budget_ms, bool rests) {
  PictureSettings settings;
  const double affordable = tracer.raster_rate() * budget_ms;
  const double pixels = double(size.x) * size.y;
  settings.layered = Layered::beneath;
  settings.layer_size = rests || pixels <= affordable ? size : (size + 1U) / 2U;
  settings.layers = 4.0 * pixels <= affordable ? 4 : 1;
  return settings;
}

PictureSettings Progressive::settings(std::uint32_t divisor, const TraceInputs& trace_inputs, double budget_ms,
                                      bool still) const {
  const glm::uvec2 size = request_.content.size;
  PictureSettings settings;
  if (trace_inputs.raster != nullptr && divisor > finest_) {
    settings = quick_layers(tracer_, size, budget_ms, still);
  } else if (trace_inputs.raster != nullptr && !trace_inputs.traced) {
    settings.layered = Layered::within;
    settings.layer_size = size;
    const double layer_bytes = (trace_inputs.raster->blends() ? 24.0 : 12.0) * size.x * size.y;
    settings.layers = static_cast<unsigned>(std::clamp(max_layer_bytes / layer_bytes, 1.0, 8.0));
  }
  settings.options = request_.content.options;
  settings.margin = margin_of(divisor);
  if (divisor == finest_) {
    settings.noise_target = request_.noise_target;
  } else {
    settings.options.separate_volume_aov = false;
    settings.options.light_groups = 0;
  }
  return settings;
}

bool Progressive::blurs() const {
  return working_ && working_->picture->layered() == Layered::beneath &&
         working_->picture->layers().size != request_.content.size;
}

bool Progressive::able(const MarchData& data, const TraceInputs& trace_inputs, const PictureSettings& settings) {
  return tracer_.able(data, request_.parameters, trace_inputs, settings);
}

void Progressive::start(std::uint32_t divisor, const MarchData& data, const TraceInputs& trace_inputs,
                        const PictureSettings& settings) {
  PictureParameters parameters = request_.parameters;
  parameters.view.size = size_of(divisor);
  // Without previews the read-back result must depend only on the settings.
  if (request_.guides && request_.content.options.preview) parameters.integrator.seed = seed_of(parameters);
  Picture& picture = acquire(parameters.view.size);
  working_.reset();
  try {
    tracer_.begin(picture, data, parameters, enough(divisor), trace_inputs, settings);
  } catch (const Error& error) {
    const bool memory =
        error.code() == ErrorCode::out_of_memory && request_.content.options.preview && divisor < coarsest_divisor;
    if (memory) {
      finest_ = divisor * 2;
    } else {
      schedule_.fail();
    }
    throw;
  }
  working_ = Work{&picture,
                  request_.content.data,
                  request_.content.instances,
                  divisor,
                  traced_scene(trace_inputs),
                  request_.content.environment,
                  request_.frames,
                  requests_,
                  scenes_};
  answer_seconds_ = 0.0;
  if (divisor == finest_) trace_seconds_ = 0.0;
}

bool Progressive::needs_depth() const {
  return request_.depth && shown_ && !shown_->picture->film().has(film_layers::depth) &&
         shown_->data == request_.content.data && shown_->instances == request_.content.instances;
}

std::uint32_t Progressive::guide_rays(const Work& work) const {
  const Picture& picture = *work.picture;
  // The factor keeps the time for feature rays below that for samples.
  const bool rough = work.divisor > finest_ || !picture.has_features();
  const std::uint64_t more = rough ? 0 : 2 * picture.samples_per_pixel();
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(first_guide_rays + more, max_feature_rays));
}

bool Progressive::needs_guides(const Work& work) const {
  return request_.guides && request_.content.options.view == View::shaded && work.data == request_.content.data &&
         work.instances == request_.content.instances && no_guides_for_ != work.picture->size() &&
         (!work.picture->has_features() || work.picture->rays_of_features() < guide_rays(work));
}

void Progressive::find_guides(const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline) {
  if (!needs_guides(*working_)) return;
  try {
    if (!tracer_.feature_pass().able(*working_->picture, data, trace_inputs)) return;
    tracer_.feature_pass().find(*working_->picture, data, trace_inputs, deadline, guide_rays(*working_));
  } catch (const Error& error) {
    // Pictures are also shown without guides if the driver does not build their program.
    if (error.code() != ErrorCode::out_of_memory && error.code() != ErrorCode::gl) throw;
    no_guides_for_ = working_->picture->size();
    no_guides_ = error;
  }
}

void Progressive::take(const PictureRequest& request, const TraceInputs& trace_inputs) {
  const PictureRequest::Content& last = request_.content;
  const bool resized = request.content.size != last.size;
  const bool changed = state() == State::idle || request.content != last;
  stillness_.see(changed, request.held, Clock::now());
  if (changed) {
    ++requests_;
    if (!request.content.shows_same(last)) ++scenes_;
    const bool other_data = resized || request.content.data != last.data;
    if (other_data) finest_ = 1;
    // In-flight paths are invalid for other data or for another scene's triangles. The program in use may read an
    // environment that does not exist any more.
    const bool other_scene = working_ && (traced_scene(trace_inputs) != working_->scene ||
                                          request.content.environment != working_->environment);
    if (other_data || request.content.options.preview != last.options.preview || other_scene) {
      working_.reset();
    }
    schedule_.change(working_ && request.content.options.preview);
  } else if (working_ && working_->divisor == finest_) {
    const std::optional<double> stops_at = working_->picture->noise_target();
    const bool fewer = request.samples < working_->picture->target_samples() ||
                       (stops_at && request.noise_target && *request.noise_target > *stops_at) ||
                       (working_->picture->is_adaptive() && request.noise_target != stops_at);
    if (!request.content.options.preview && fewer) {
      schedule_.drop();
    } else {
      working_->picture->extend(request.samples, request.noise_target);
      if (!working_->picture->done()) schedule_.extend();
    }
  }
  request_ = request;
}

void Progressive::advance(const PictureRequest& request, const MarchData& data, const TraceInputs& trace_inputs,
                          Deadline deadline, double budget_ms) {
  take(request, trace_inputs);
  if (state() == State::failed) return;
  try {
    do {
      const bool rests = stillness_.rests(Clock::now());
      if (blurs() && rests) schedule_.drop();
      if (state() == State::due) {
        first_divisor_ = coarsest(budget_ms);
        const PictureSettings first = settings(first_divisor_, trace_inputs, budget_ms, rests);
        const bool ready = able(data, trace_inputs, first);
        // The driver can compile the programs of the final picture meanwhile.
        if (first_divisor_ > finest_) able(data, trace_inputs, settings(finest_, trace_inputs, budget_ms, true));
        if (!ready) return;
        start(first_divisor_, data, trace_inputs, first);
        schedule_.begin();
      } else if (state() == State::refining && working_->divisor > finest_ && is_enough()) {
        const std::uint32_t divisor = working_->divisor / 2;
        const PictureSettings finer = settings(divisor, trace_inputs, budget_ms, true);
        if (!able(data, trace_inputs, finer)) return;
        start(divisor, data, trace_inputs, finer);
      }
      work(data, trace_inputs, deadline);
      // In state `due`, the loop ends so that the previous request's picture is shown first. The next one is started
      // for the newest request.
    } while (state() != State::done && state() != State::due && Clock::now() < deadline);
  } catch (const Error& error) {
    working_.reset();
    if (finest_ == 1 || error.code() != ErrorCode::out_of_memory) {
      schedule_.fail();
    } else {
      schedule_.drop();
    }
    // The coarser pictures tried after it for the same request do not report it again.
    if (error.code() == ErrorCode::out_of_memory && std::exchange(out_of_memory_for_, requests_) == requests_) return;
    throw;
  }
  if (const auto failure = std::exchange(no_guides_, std::nullopt)) throw Error(*failure);
}

void Progressive::work(const MarchData& data, const TraceInputs& trace_inputs, Deadline deadline) {
  Picture& picture = *working_->picture;
  const auto begun = Clock::now();
  const bool was_complete = picture.complete();
  find_guides(data, trace_inputs, deadline);
  tracer_.trace(picture, data, trace_inputs, deadline, working_->divisor > finest_);
  const double seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  trace_seconds_ += seconds;
  if (!was_complete) answer_seconds_ += seconds;
  if (picture.complete()) {
    if (!was_complete && request_.content.options.view == View::shaded) {
      const auto pixels = static_cast<double>(picture.box().area());
      answer_rate_ += 0.3 * (pixels / std::max(1e-5, 1e3 * answer_seconds_) - answer_rate_);
    }
    if (shown() != &picture) before_ = shown_ ? shown_->picture : nullptr;
    shown_ = working_;
    if (needs_depth()) tracer_.inspector().trace_depth(picture, data, trace_inputs, deadline);
  }
  follow();
}

void Progressive::follow() {
  if (!working_) return;
  if (working_->picture->complete()) schedule_.complete();
  if (working_->picture->done() && working_->divisor == finest_) schedule_.finish();
}

void Progressive::reset() {
  shown_.reset();
  working_.reset();
  before_ = nullptr;
  pictures_.clear();
  schedule_.reset();
  finest_ = 1;
}

bool Progressive::more() const {
  switch (state()) {
    case State::idle:
    case State::failed:
      return false;
    case State::done:
      return needs_depth() || needs_guides(*working_);
    default:
      return true;
  }
}

bool Progressive::has_pending_picture() const {
  return state() == State::due || state() == State::answering || state() == State::overtaken;
}

bool Progressive::converged() const { return state() == State::done && !more() && working_->divisor == 1; }

double Progressive::progress() const {
  if (state() != State::answering && state() != State::refining && state() != State::done) return 0.0;
  double all = 0.0;
  double done = 0.0;
  for (std::uint32_t divisor = std::max(first_divisor_, working_->divisor); divisor >= finest_; divisor /= 2) {
    const double work = pixels_of(divisor) * enough(divisor);
    all += work;
    if (divisor > working_->divisor) done += work;
    if (divisor == working_->divisor) done += work * std::min(1.0, working_->picture->progress());
  }
  return all > 0.0 ? done / all : 0.0;
}

void Progressive::settle() {
  if (working_) tracer_.settle(*working_->picture);
  follow();
}

Picture& Progressive::accumulating() {
  if (!working_ || request_.content.options.preview || working_->divisor != 1 ||
      working_->picture->view() != View::shaded) {
    throw Error(ErrorCode::invalid_argument,
                "no shaded render without previews is in progress: set CUMULET_PREVIEW_OFF and call cumulet_render");
  }
  return *working_->picture;
}

void Progressive::restore(std::span<const std::byte> saved) {
  Picture& picture = accumulating();
  tracer_.restore(picture, saved);
  follow();
}

std::uint64_t Progressive::bytes() const {
  std::uint64_t bytes = tracer_.bytes();
  for (const auto& picture : pictures_) bytes += picture->bytes();
  return bytes;
}

}  // namespace cumulet::render
