#include "render/progressive.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "base/error.hpp"
#include "base/milliseconds.hpp"

namespace cumulet::render {

namespace {

constexpr std::uint32_t coarsest_divisor = 16;
// Of a coarse picture.
constexpr std::uint32_t preview_samples = 16;
// The last few of a coarse picture's samples are those of the longest paths: nobody waits for them.
constexpr double nearly_all = 0.9;
// For the surface pass at full resolution: eight layers at 1080p.
constexpr double most_layer_bytes = 256e6;
// Frames that the first answer to a change may take.
constexpr double answer_frames = 2.0;
// What has not changed for so long rests; what a hand holds may be held still.
constexpr double rest_ms = 100.0;
constexpr double held_rest_ms = 300.0;
using Clock = std::chrono::steady_clock;

const surface::Scene* scene_met(const Surfaces& surfaces) {
  const SurfaceData* met = surfaces.met();
  return met != nullptr ? met->scene() : nullptr;
}

}  // namespace

std::uint32_t Progressive::enough(std::uint32_t divisor) const {
  const std::uint32_t wanted = wish_.content.view == View::shaded ? wish_.samples : 1;
  if (divisor <= finest_) return wanted;
  // A quarter of the samples of one a pixel at full resolution.
  const std::uint32_t affordable = divisor / finest_ * (divisor / finest_) / 4;
  return std::clamp(std::min(affordable, preview_samples), 1U, wanted);
}

glm::uvec2 Progressive::size_of(std::uint32_t divisor) const {
  return (wish_.content.parameters.view.size + divisor - 1U) / divisor;
}

bool Progressive::is_enough() const {
  const glm::u64vec2 size(working_->size());
  const auto wanted = static_cast<double>(size.x * size.y * working_->target_samples());
  return working_->done() || (working_->complete() && static_cast<double>(working_->samples()) >= nearly_all * wanted);
}

std::uint32_t Progressive::coarsest(double budget_ms) const {
  if (!wish_.content.preview) return 1;
  const double pixels = double(wish_.content.parameters.view.size.x) * wish_.content.parameters.view.size.y;
  std::uint32_t divisor = finest_;
  while (divisor < coarsest_divisor && pixels / (double(divisor) * divisor) > answer_frames * answer_rate_ * budget_ms)
    divisor *= 2;
  return divisor;
}

Picture& Progressive::acquire(glm::uvec2 size) {
  const auto is_free = [this](const auto& picture) { return picture.get() != shown_ && picture.get() != before(); };
  // working_ itself, if it is not shown: it is to be given up.
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

PictureSettings Progressive::settings(std::uint32_t divisor, const Surfaces& surfaces, double budget_ms) const {
  const glm::uvec2 size = wish_.content.parameters.view.size;
  PictureSettings settings;
  if (surfaces.raster != nullptr && divisor > finest_) {
    settings = quick_layers(tracer_, size, budget_ms, !answering_ || rests());
  } else if (surfaces.raster != nullptr && !surfaces.traced) {
    settings.layered = Layered::within;
    settings.layer_size = size;
    const double layer_bytes = (surfaces.raster->blends() ? 24.0 : 12.0) * size.x * size.y;
    settings.layers = static_cast<unsigned>(std::clamp(most_layer_bytes / layer_bytes, 1.0, 8.0));
  }
  settings.view = wish_.content.view;
  settings.hasty = wish_.content.preview;
  settings.volume_alone = wish_.content.volume_alone && divisor == finest_;
  return settings;
}

bool Progressive::rests() const {
  return let_go_ || milliseconds(Clock::now() - changed_) >= (wish_.held ? held_rest_ms : rest_ms);
}

bool Progressive::blurs() const {
  return working_->layered() == Layered::beneath && working_->layers().size != wish_.content.parameters.view.size;
}

void Progressive::start(std::uint32_t divisor, const MarchData& data, const Surfaces& surfaces, double budget_ms) {
  PictureParameters parameters = wish_.content.parameters;
  parameters.view.size = size_of(divisor);
  Picture& picture = acquire(parameters.view.size);
  working_ = nullptr;
  try {
    tracer_.begin(picture, data, parameters, enough(divisor), surfaces, settings(divisor, surfaces, budget_ms));
  } catch (const Error& error) {
    const bool memory = error.code() == ErrorCode::out_of_memory && wish_.content.preview && divisor < coarsest_divisor;
    if (memory) {
      finest_ = divisor * 2;
      stale_ = true;
    } else {
      failed_ = true;
    }
    throw;
  }
  working_ = &picture;
  working_generation_ = wish_.content.generation;
  scene_ = scene_met(surfaces);
  divisor_ = divisor;
  stale_ = false;
  answer_seconds_ = 0.0;
  if (divisor == finest_) trace_seconds_ = 0.0;
}

bool Progressive::needs_depth() const {
  return wish_.depth && shown_ != nullptr && shown_->volume_z() == 0 && shown_generation_ == wish_.content.generation;
}

void Progressive::take(const PictureWish& wish, const Surfaces& surfaces) {
  const bool resized = wish.content.parameters.view.size != wish_.content.parameters.view.size;
  const bool changed = !wished_ || wish.content != wish_.content;
  let_go_ = !wish.held && (wish_.held || (let_go_ && !changed));
  if (changed) {
    changed_ = Clock::now();
    stale_ = true;
    failed_ = false;
    if (resized || wish.content.generation != wish_.content.generation) finest_ = 1;
    // Paths of the old data lead nowhere in the new.
    // So do paths on another scene's triangles.
    if (wish.content.generation != wish_.content.generation || resized ||
        wish.content.preview != wish_.content.preview || scene_met(surfaces) != scene_) {
      working_ = nullptr;
    }
  } else if (working_ != nullptr && divisor_ == finest_) {
    if (!wish.content.preview && wish.samples < working_->target_samples()) {
      stale_ = true;
    } else {
      working_->extend(wish.samples);
    }
  }
  wish_ = wish;
  wished_ = true;
}

void Progressive::advance(const PictureWish& wish, const MarchData& data, const Surfaces& surfaces, Deadline deadline,
                          double budget_ms) {
  take(wish, surfaces);
  if (failed_) return;
  try {
    do {
      // The first answer to a change is finished, whatever changes meanwhile: else nothing would ever be shown.
      const bool answering = wish_.content.preview && answering_ && working_ != nullptr && !working_->complete();
      if (working_ == nullptr || (stale_ && !answering) || (blurs() && rests())) {
        answering_ = true;
        first_divisor_ = coarsest(budget_ms);
        start(first_divisor_, data, surfaces, budget_ms);
      } else if (!stale_ && divisor_ > finest_ && is_enough()) {
        answering_ = false;
        start(divisor_ / 2, data, surfaces, budget_ms);
      }
      const auto begun = Clock::now();
      const bool was_complete = working_->complete();
      const bool done = tracer_.trace(*working_, data, surfaces, deadline, divisor_ > finest_);
      const double seconds = std::chrono::duration<double>(Clock::now() - begun).count();
      trace_seconds_ += seconds;
      if (!was_complete) answer_seconds_ += seconds;
      if (working_->complete()) {
        if (!was_complete && wish_.content.view == View::shaded) {
          const glm::dvec2 size(working_->size());
          answer_rate_ += 0.3 * (size.x * size.y / std::max(1e-5, 1e3 * answer_seconds_) - answer_rate_);
        }
        if (shown_ != working_) before_ = shown_;
        shown_ = working_;
        shown_generation_ = working_generation_;
        if (needs_depth()) tracer_.trace_depth(*shown_, data, surfaces, deadline);
      }
      if (done && !stale_ && divisor_ == finest_) break;
    } while (Clock::now() < deadline);
  } catch (const Error& error) {
    working_ = nullptr;
    if (finest_ == 1 || error.code() != ErrorCode::out_of_memory) failed_ = true;
    throw;
  }
}

void Progressive::reset() {
  shown_ = before_ = working_ = nullptr;
  pictures_.clear();
  wished_ = false;
  stale_ = failed_ = false;
  finest_ = 1;
}

bool Progressive::more() const {
  if (!wished_ || failed_) return false;
  return working_ == nullptr || stale_ || !working_->done() || divisor_ > finest_ || needs_depth();
}

bool Progressive::converged() const { return wished_ && !failed_ && !more() && divisor_ == 1; }

double Progressive::progress() const {
  if (!wished_ || working_ == nullptr || stale_) return 0.0;
  double all = 0.0;
  double done = 0.0;
  for (std::uint32_t divisor = std::max(first_divisor_, divisor_); divisor >= finest_; divisor /= 2) {
    const glm::dvec2 size(size_of(divisor));
    const double work = size.x * size.y * enough(divisor);
    all += work;
    if (divisor > divisor_) done += work;
    if (divisor == divisor_) done += work * std::min(1.0, working_->progress());
  }
  return all > 0.0 ? done / all : 0.0;
}

void Progressive::settle() {
  if (working_ != nullptr) tracer_.settle(*working_);
}

std::uint64_t Progressive::bytes() const {
  std::uint64_t bytes = tracer_.bytes();
  for (const auto& picture : pictures_) bytes += picture->bytes();
  return bytes;
}

}  // namespace cumulet::render
