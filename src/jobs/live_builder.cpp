#include "jobs/live_builder.hpp"

#include <algorithm>
#include <utility>

#include "jobs/shared_grids.hpp"
#include "jobs/stopwatch.hpp"

namespace cumulet::viewer {

namespace {

constexpr const char* what = "building a dynamic volume";

}  // namespace

void LiveBuilder::follow(std::shared_ptr<Live> live, std::optional<BuildSettings> settings) {
  if (job_log() != nullptr) job_log()->follow_states(player(), live, settings);
  std::optional<Ready> old;  // destroyed after the lock is released, because its contents may be large
  const std::scoped_lock lock(mutex_);
  worker_.drop();
  job_.reset();
  begun_.reset();
  old = std::exchange(ready_, std::nullopt);
  std::swap(live_, live);
  huge_is_said_ = false;
  request_.reset();
  settings_ = std::move(settings);
  begin();
}

void LiveBuilder::configure(std::optional<BuildSettings> settings) {
  if (job_log() != nullptr) job_log()->configure_states(player(), settings);
  const std::scoped_lock lock(mutex_);
  settings_ = std::move(settings);
  begin();
}

void LiveBuilder::look() noexcept {
  try {
    const std::scoped_lock lock(mutex_);
    begin();
  } catch (...) {
    log_.warning(caught(what).what());  // the host's submission has succeeded; the next look() tries again
  }
}

void LiveBuilder::rebuild() {
  log_call("states", "rebuild");
  const std::scoped_lock lock(mutex_);
  begun_.reset();
  begin();
}

void LiveBuilder::cancel() {
  log_call("states", "cancel");
  const std::scoped_lock lock(mutex_);
  worker_.cancel();
  job_.reset();
  // Marks the newest state as built, so that only another state or other settings start a build.
  if (is_due()) begun_ = Begun{live_->newest(), *settings_};
}

std::optional<LiveBuilder::Ready> LiveBuilder::take() {
  const std::scoped_lock lock(mutex_);
  auto ready = std::exchange(ready_, std::nullopt);
  if (ready) begin();
  return ready;
}

bool LiveBuilder::busy() const {
  const std::scoped_lock lock(mutex_);
  return job_ || ready_ || is_due();
}

bool LiveBuilder::is_due() const {
  if (!live_ || !settings_ || live_->newest() == 0) return false;
  return !begun_ || begun_->number < live_->newest() || !suits(begun_->settings, *settings_);
}

void LiveBuilder::begin() {
  if (job_ || ready_ || !is_due()) return;
  const std::uint64_t job = ++last_job_;
  worker_.post({what, Progress::Stage::loading, [this, job](Progress& progress) {
                  while (!build(job, progress)) {
                  }
                }});
  job_ = job;  // not set if posting the job failed
}

void LiveBuilder::request(Live& live, const std::optional<scene::Emission>& wanted) {
  {
    const std::scoped_lock lock(mutex_);
    if (wanted && request_ && *request_ == *wanted) return;
  }
  // Listeners are called without the lock.
  Live::Request request = wanted ? live.want(*wanted) : nullptr;
  const std::scoped_lock lock(mutex_);
  if (live_.get() == &live) std::swap(request_, request);
}

std::optional<BuildSettings> LiveBuilder::settings_for(Live& live, const VolumeAsset& state,
                                                       const BuildSettings& settings) {
  const scene::StateInGlPtr& in_gl = state.in_gl();
  const scene::Emission wanted = state.emission_by(settings.emission);
  const bool made_there = in_gl && !needs_values(state, settings);
  // A later state may have fire.
  request(live, made_there && (wanted.burns() || wanted.is_hot()) ? std::optional(wanted) : std::nullopt);
  if (!made_there || in_gl->gone() || in_gl->has_wanted({wanted})) return settings;
  const scene::Emission* found = in_gl->some_emission();
  if (found == nullptr || !in_gl->has_wanted({})) return std::nullopt;
  BuildSettings instead = settings;
  instead.emission = *found;
  return instead;
}

void LiveBuilder::warn_of_huge(const VolumeAsset& state) {
  std::uint64_t voxels = 0;
  for (const volume::ScalarVolume* field : state.frame().fields()) voxels += field->huge_voxels;
  if (voxels == 0) return;
  {
    const std::scoped_lock lock(mutex_);
    if (std::exchange(huge_is_said_, true)) return;
  }
  log_.warning(state.name() + ": " + std::to_string(voxels) +
               " voxels above 1e30 (fill values) are read as 0; this is not logged again for later states");
}

bool LiveBuilder::build(std::uint64_t job, Progress& progress) {
  std::shared_ptr<Live> live;
  Begun begun;
  {
    const std::scoped_lock lock(mutex_);
    progress.check();
    // Volume or settings may have been removed meanwhile; then the next request starts a new job.
    if (job_ != job || !live_ || !settings_) {
      if (job_ == job) job_.reset();
      return true;
    }
    live = live_;
    begun = {live->newest(), *settings_};
    begun_ = begun;
  }
  Ready ready;
  std::optional<Error> failure;
  try {
    // Limits apply to each state separately: with a thread limit, other jobs run between two states.
    resource_limits_->run([&] {
      Stopwatch watch;
      const Live::State state = live->read(progress);
      const double load_seconds = watch.lap();
      if (!state.volume) return;
      warn_of_huge(*state.volume);
      const std::optional<BuildSettings> settings = settings_for(*live, *state.volume, begun.settings);
      if (!settings) return;
      // Without a result the build needs voxels, which another state will bring.
      ready = {shared_grid(log_, state.volume, *settings, progress, *resource_limits_), state.number};
      ready.built.seconds.load = load_seconds;
    });
    progress.check();
  } catch (...) {
    failure = caught(what);
  }
  const bool cancelled = failure && failure->code() == ErrorCode::cancelled;
  if (failure && !cancelled) log_.warning(std::string(failure->what()) + ": the previous state is kept");
  const std::scoped_lock lock(mutex_);
  if (job_ != job || cancelled) {
    if (job_ == job) job_.reset();
    if (failure) throw Error(*failure);
    return true;
  }
  const bool made = !failure && ready.built.source != nullptr;
  if (made) {
    // The state that was read may be newer than the one for which the build was started.
    if (begun_) begun_->number = std::max(begun_->number, ready.number);
    ready_ = std::move(ready);
  }
  // A failure, or a state refused elsewhere, does not matter if there is a newer state.
  if (!made && is_due()) return false;
  job_.reset();
  if (failure) throw Error(*failure);
  return true;
}

}  // namespace cumulet::viewer
