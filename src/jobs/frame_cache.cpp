#include "jobs/frame_cache.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <system_error>

#include "jobs/build_grid.hpp"
#include "jobs/stopwatch.hpp"
#include "volume/between.hpp"

namespace cumulet::viewer {

namespace {

constexpr const char* what = "building a sequence's frames";

// Largest file first; missing files last.
std::vector<std::uint32_t> by_size(const FrameFiles& files) {
  std::vector<std::pair<std::uintmax_t, std::uint32_t>> sized;
  for (std::uint32_t frame = 0; frame < files.count(); ++frame) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(files.path(frame).absolute(), error);
    sized.emplace_back(error ? 0 : size, frame);
  }
  std::ranges::stable_sort(sized, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::uint32_t> frames;
  std::ranges::transform(sized, std::back_inserter(frames), [](const auto& one) { return one.second; });
  return frames;
}

}  // namespace

FrameCache::FrameCache(const JobContext& context)
    : JobSource(context),
      log_(context.log),
      notify_(context.notify),
      trace_(context.trace),
      resource_limits_(context.resource_limits),
      worker_([this] { notify(); }, context.trace) {}

void FrameCache::request(Request request) {
  if (job_log() != nullptr) job_log()->request(player(), request);
  std::vector<Entry> old;  // destroyed after the lock is released, because its contents may be large
  {
    const std::scoped_lock lock(mutex_);
    const bool other_files = !is_requested(request.files);
    const bool other_steps = other_files || request.steps != request_->steps;
    if (other_steps) {
      worker_.cancel();
      substitutes_.reserve(request.steps.count(request.files->count()));  // so that nothing throws after the request
                                                                          // has been replaced
    }
    if (other_files) {
      old = std::exchange(cache_, std::vector<Entry>(request.steps.count(request.files->count())));
      analysis_ = Analysis::due;
      analyzed_.reset();
      temperature_scale_.reset();
      said_.clear();
    } else if (other_steps) {
      old = take_other_steps(request.steps);
    }
    const bool suggested = request.takes_suggested && request.files->shown.suggested_density_scale;
    if (suggested && analyzed_ && analyzed_->density_scale && request.settings)
      request.settings->refine.density_scale = *analyzed_->density_scale;
    request_ = std::move(request);
    final_taken_ = false;
    if (other_steps) find_substitutes();
    cancelled_ = false;
    std::ranges::move(take_excess(), std::back_inserter(old));
    start();
  }
  changed_.notify_all();
}

void FrameCache::clear() {
  log_call("frames", "clear");
  std::vector<Entry> old;
  {
    const std::scoped_lock lock(mutex_);
    worker_.cancel();
    request_.reset();
    final_taken_ = false;
    analyzed_.reset();
    old = std::exchange(cache_, {});
  }
  changed_.notify_all();
}

void FrameCache::rebuild() {
  log_call("frames", "rebuild");
  std::vector<Entry> old;
  const std::scoped_lock lock(mutex_);
  if (!request_) return;
  for (Entry& entry : cache_) {
    if (entry.volume) old.emplace_back().volume = std::exchange(entry.volume, nullptr);
    entry.stale = true;
    entry.failure.reset();
  }
  find_substitutes();
  // The running job began before the call.
  worker_.cancel();
  if (analysis_ == Analysis::in_vain) analysis_ = Analysis::due;
  cancelled_ = false;
  start();
}

void FrameCache::cancel() {
  log_call("frames", "cancel");
  {
    const std::scoped_lock lock(mutex_);
    cancelled_ = true;
    worker_.cancel();
  }
  changed_.notify_all();
}

std::optional<FrameCache::AnalyzedFrame> FrameCache::take_analyzed() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(analyzed_, std::nullopt);
}

std::optional<FrameCache::Ready> FrameCache::nearest() const {
  const std::scoped_lock lock(mutex_);
  if (!request_) return std::nullopt;
  const auto wanted = first();
  const std::uint32_t target = wanted.value_or(request_->order.front());
  const auto steps_there = static_cast<std::uint32_t>(cache_.size());
  std::optional<std::uint32_t> found;
  // At equal distances the earlier step is preferred.
  for (std::uint32_t away = 0; !found && (away <= target || away < steps_there - target); ++away) {
    if (away <= target && cache_[target - away].built) {
      found = target - away;
    } else if (away < steps_there - target && cache_[target + away].built) {
      found = target + away;
    }
  }
  if (!found) return std::nullopt;
  const Steps& steps = request_->steps;
  Ready ready{steps.frame(*found), steps.part(*found), *cache_[*found].built,
              found == wanted && is_ready(cache_[*found])};
  ready.built.volume = cache_[*found].volume;
  return ready;
}

std::optional<FrameCache::Ready> FrameCache::take() {
  auto ready = nearest();
  if (ready) final_taken_ = ready->wanted;
  return ready;
}

FrameCache::Status FrameCache::frames() const {
  const std::scoped_lock lock(mutex_);
  Status status;
  for (std::uint32_t step = 0; step < cache_.size(); ++step) {
    const Entry& entry = cache_[step];
    if (!request_->steps.is_between(step))
      status.frames.push_back(entry.failure ? State::failed : is_ready(entry) ? State::ready : State::waiting);
    status.bytes += (entry.built ? entry.grid_bytes : 0) + (entry.volume ? entry.volume_bytes : 0);
  }
  return status;
}

std::optional<Error> FrameCache::failure_of(std::uint32_t frame) const {
  const std::scoped_lock lock(mutex_);
  return request_ && frame < request_->files->count() ? own(frame).failure : std::nullopt;
}

bool FrameCache::busy() const {
  const std::scoped_lock lock(mutex_);
  return !final_taken_ && waits();
}

Worker::Status FrameCache::status() const {
  const std::scoped_lock lock(mutex_);
  const Worker::Status work = worker_.status();
  Worker::Status status;
  if (waits()) status = work;
  status.failure.reset();
  if (!request_) return status;
  if (is_analyzed() && !first()) {
    status.failure = own(request_->steps.frame(request_->order.front())).failure;
  } else if (work.failure && work.failure->code() != ErrorCode::cancelled) {
    status.failure = work.failure;  // not caused by a file; building failed
  }
  return status;
}

bool FrameCache::wait(std::optional<std::chrono::steady_clock::time_point> until) const {
  std::unique_lock lock(mutex_);
  const auto ready = [this] { return !awaited_ || !waits(); };
  if (until) return changed_.wait_until(lock, *until, ready);
  changed_.wait(lock, ready);
  return true;
}

void FrameCache::set_awaited(bool awaited) {
  {
    const std::scoped_lock lock(mutex_);
    awaited_ = awaited;
  }
  changed_.notify_all();
}

void FrameCache::notify() {
  {
    const std::scoped_lock lock(mutex_);  // so that a waiting thread has either not checked its condition yet, or is
                                          // waiting
  }
  changed_.notify_all();
  notify_();
}

// ---- mutex_ is held ----

void FrameCache::start() {
  if (is_analyzed() && !next()) {
    worker_.forget_failure();
    return;
  }
  worker_.post(job());
}

bool FrameCache::is_ready(const Entry& entry) const {
  return entry.built && !entry.stale && request_->settings && entry.built->serves(*request_->settings);
}

bool FrameCache::is_possible(std::uint32_t step) const {
  const Steps& steps = request_->steps;
  const std::uint32_t frame = steps.frame(step);
  if (cache_[step].failure || own(frame).failure) return false;
  return !steps.is_between(step) || !own(frame + 1).failure;
}

void FrameCache::find_substitutes() {
  substitutes_.assign(cache_.size(), std::nullopt);
  std::uint32_t last = 0;
  while (last < cache_.size() && cache_[last].failure) last += request_->steps.a_frame;
  if (last >= cache_.size()) return;
  for (std::uint32_t step = 0; step < cache_.size(); ++step) {
    const bool possible = is_possible(step);
    if (possible && !request_->steps.is_between(step)) last = step;
    substitutes_[step] = possible ? step : last;
  }
}

std::vector<FrameCache::Entry> FrameCache::take_other_steps(const Steps& steps) {
  std::vector<Entry> other(steps.count(request_->files->count()));
  for (std::uint32_t frame = 0; frame < request_->files->count(); ++frame)
    std::swap(other[steps.own(frame)], own(frame));
  return std::exchange(cache_, std::move(other));
}

std::vector<std::uint32_t> FrameCache::kept() const {
  std::uint64_t known = 0;
  std::uint64_t known_bytes = 0;
  for (const Entry& entry : cache_) {
    known += entry.grid_bytes > 0 ? 1U : 0U;
    known_bytes += entry.grid_bytes;
  }
  const std::uint64_t likely = known > 0 ? known_bytes / known : 0;
  std::vector<std::uint32_t> frames;
  std::vector<bool> taken(cache_.size());
  std::uint64_t bytes = 0;
  for (const std::uint32_t requested : request_->order) {
    const auto frame = substitutes_[requested];
    if (!frame || taken[*frame]) continue;
    const std::uint64_t takes = cache_[*frame].grid_bytes > 0 ? cache_[*frame].grid_bytes : likely;
    if (!frames.empty() && bytes + takes > request_->memory_bytes) break;
    bytes += takes;
    taken[*frame] = true;
    frames.push_back(*frame);
  }
  return frames;
}

std::optional<std::uint32_t> FrameCache::next() const {
  if (!request_ || !request_->settings || cancelled_ || analysis_ != Analysis::done) return std::nullopt;
  for (const std::uint32_t frame : kept()) {
    if (!is_ready(cache_[frame])) return frame;
  }
  return std::nullopt;
}

bool FrameCache::waits() const {
  if (!request_ || cancelled_ || !worker_.busy()) return false;
  if (!is_analyzed()) return true;
  const auto wanted = first();
  return wanted && !is_ready(cache_[*wanted]);
}

std::vector<FrameCache::Entry> FrameCache::take_excess() {
  std::uint64_t bytes = 0;
  for (const Entry& entry : cache_)
    bytes += (entry.built ? entry.grid_bytes : 0) + (entry.volume ? entry.volume_bytes : 0);
  std::vector<Entry> excess;
  if (bytes <= request_->memory_bytes) return excess;
  // Orders by need; the first needed step always stays.
  constexpr std::size_t not_needed = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> rank(cache_.size(), not_needed);
  const std::vector<std::uint32_t> needed = kept();
  for (std::size_t i = 0; i < needed.size(); ++i) rank[needed[i]] = i;
  std::vector<std::uint32_t> frames;
  for (std::uint32_t frame = 0; frame < cache_.size(); ++frame) {
    const bool is_first = !needed.empty() && frame == needed.front();
    if (!is_first && (cache_[frame].built || cache_[frame].volume)) frames.push_back(frame);
  }
  std::ranges::sort(frames, [&](std::uint32_t a, std::uint32_t b) { return rank[a] > rank[b]; });
  const auto fits = [&] { return bytes <= request_->memory_bytes; };
  for (const std::uint32_t frame : frames) {
    Entry& entry = cache_[frame];
    if (fits()) return excess;
    if (!entry.volume) continue;
    bytes -= entry.volume_bytes;
    excess.emplace_back().volume = std::exchange(entry.volume, nullptr);
  }
  for (const std::uint32_t frame : frames) {
    Entry& entry = cache_[frame];
    if (fits()) return excess;
    if (!entry.built) continue;
    bytes -= entry.grid_bytes;
    excess.emplace_back().built = std::exchange(entry.built, std::nullopt);
  }
  return excess;
}

// ---- on the worker thread ----

Worker::Job FrameCache::job() {
  return {what, Progress::Stage::loading, [this](Progress& progress) { work(progress); }};
}

void FrameCache::work(Progress& progress) {
  std::optional<Ends> ends;
  for (;;) {
    std::optional<Which> step;
    BuildSettings settings;
    FrameFilesPtr to_analyze;
    {
      const std::scoped_lock lock(mutex_);
      if (!request_ || cancelled_) return;
      if (analysis_ == Analysis::due) {
        to_analyze = request_->files;
      } else if (const auto found = next()) {
        step = Which{request_->files, request_->steps, *found};
        settings = *request_->settings;
      } else {
        return;
      }
    }
    // Limits apply to each step separately: with a thread limit, other jobs run between two steps.
    resource_limits_->run([&] {
      if (to_analyze) {
        analyze(to_analyze, progress);
      } else {
        build(*step, settings, ends, progress);
      }
    });
    notify();
    if (worker_.continue_later(job())) return;
  }
}

Log FrameCache::log_of(const std::string& path) {
  return Log([this, path](LogLevel level, const char* message) {
    std::string said(message);
    if (const auto at = said.find(path); at != std::string::npos) said.erase(at, path.size());
    {
      const std::scoped_lock lock(mutex_);
      if (!said_.insert(said).second) return;
    }
    log_.write(level, message);
  });
}

void FrameCache::say_failures(std::span<const Error> failures, bool another_is_shown) const {
  for (const Error& failure : failures) {
    const std::string cause = failure.what();
    log_.warning(another_is_shown ? cause + ": another frame is shown instead" : cause);
  }
}

bool FrameCache::fail(const Which& which, std::optional<std::uint32_t> frame, const Error& failure,
                      const Progress& progress) {
  {
    const std::scoped_lock lock(mutex_);
    progress.check();  // cancellation for a rebuild also happens under the lock
    if (!is_requested(which)) return false;
    (frame ? own(*frame) : cache_[which.step]).failure = failure;
    find_substitutes();
    ++revision_;
  }
  return true;
}

void FrameCache::analyze(const FrameFilesPtr& files, Progress& progress) {
  AnalyzedFrame analyzed;
  Steps steps;
  {
    const std::scoped_lock lock(mutex_);
    if (!is_requested(files)) return;
    steps = request_->steps;
  }
  const auto end = [&](Analysis how) {
    const std::scoped_lock lock(mutex_);
    if (!is_requested(files)) return;
    if (how != Analysis::due) progress.check();
    analysis_ = how;
    if (how != Analysis::done) return;
    if (request_->takes_suggested && files->shown.suggested_density_scale && analyzed.density_scale &&
        request_->settings)
      request_->settings->refine.density_scale = *analyzed.density_scale;
    analyzed_ = analyzed;
    ++revision_;
  };
  std::vector<Error> failures;
  try {
    for (const std::uint32_t frame : by_size(*files)) {
      try {
        progress.begin(Progress::Stage::loading);
        const VolumeFile file = files->file(frame);
        const VolumeAssetPtr volume = file.read(log_of(file.path.given()), &progress);
        progress.check();
        const std::uint64_t bytes = volume->bytes();
        {
          const std::scoped_lock lock(mutex_);
          if (!is_requested(files)) throw Error(ErrorCode::cancelled, "cancelled");
          own(frame).volume = volume;
          own(frame).volume_bytes = bytes;
        }
        if (!analyzed.volume_info || !volume->empty()) analyzed.volume_info = volume->volume_info();
        settle_temperature(*files, *volume);
        if (!volume->empty()) break;
      } catch (...) {
        const Error failure = caught(what);
        if (failure.code() == ErrorCode::cancelled) throw Error(failure);
        if (fail({files, steps, 0}, frame, failure, progress)) failures.push_back(failure);
      }
    }
    if (analyzed.volume_info) analyzed.density_scale = analyzed.volume_info->coarse.suggest_density_scale();
  } catch (...) {
    say_failures(failures, analyzed.volume_info != nullptr);
    end(Analysis::due);
    throw;
  }
  // Only now it is known whether another frame can be shown.
  say_failures(failures, analyzed.volume_info != nullptr);
  end(analyzed.volume_info ? Analysis::done : Analysis::in_vain);
}

void FrameCache::settle_temperature(const FrameFiles& files, const VolumeAsset& volume) {
  const auto& temperature = volume.frame().temperature;
  if (!temperature || !(temperature->max_value > 0.0F)) return;
  const std::scoped_lock lock(mutex_);
  if (request_ && request_->files.get() == &files && !temperature_scale_)
    temperature_scale_ = volume.temperature_scale();
}

VolumeAssetPtr FrameCache::read_frame(const Which& which, std::uint32_t frame, Progress& progress) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_requested(which) && own(frame).volume) return own(frame).volume;
  }
  VolumeFile file = which.files->file(frame);
  {
    const std::scoped_lock lock(mutex_);
    if (is_requested(which)) file.temperature_scale = temperature_scale_;
  }
  progress.begin(Progress::Stage::loading);
  VolumeAssetPtr volume = file.read(log_of(file.path.given()), &progress);
  settle_temperature(*which.files, *volume);
  const std::uint64_t bytes = volume->bytes();
  std::vector<Entry> old;
  const std::scoped_lock lock(mutex_);
  progress.check();
  if (is_requested(which)) {
    own(frame).volume = volume;
    own(frame).volume_bytes = bytes;
    old = take_excess();
  }
  return volume;
}

VolumeAssetPtr FrameCache::read(const Which& which, std::optional<Ends>& ends, std::optional<std::uint32_t>& reading,
                                Progress& progress) {
  const auto frame_there = [&](std::uint32_t frame) {
    reading = frame;
    return read_frame(which, frame, progress);
  };
  const std::uint32_t frame = which.steps.frame(which.step);
  if (!which.steps.is_between(which.step)) return frame_there(frame);
  if (!ends || ends->files != which.files || ends->frame != frame) {
    // The end of the previous interval is the beginning of this one.
    VolumeAssetPtr before;
    if (ends && ends->files == which.files && ends->frame + 1 == frame) before = ends->after;
    ends.reset();
    if (!before) before = frame_there(frame);
    VolumeAssetPtr after = frame_there(frame + 1);
    ends = Ends{which.files, frame, std::move(before), std::move(after)};
  }
  reading.reset();
  {
    const std::scoped_lock lock(mutex_);
    if (is_requested(which) && cache_[which.step].volume) return cache_[which.step].volume;
  }
  progress.begin(Progress::Stage::loading);
  const double part = which.steps.part(which.step);
  const volume::VolumeFrame& before = ends->before->frame();
  const volume::VolumeFrame& after = ends->after->frame();
  try {
    volume::VolumeFrame made = which.steps.between == scene::Between::advect
                                   ? volume::between(before, after, part, which.steps.seconds, &progress)
                                   : volume::blend(before, after, part, &progress);
    made.temperature_scale = ends->after->temperature_scale();
    return std::make_shared<const VolumeAsset>(std::move(made), &progress);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::cancelled) throw;
    throw Error(error.code(),
                which.files->paths[frame] + ": the interpolated frame after it cannot be built: " + error.what());
  }
}

void FrameCache::build(const Which& which, const BuildSettings& settings, std::optional<Ends>& ends,
                       Progress& progress) {
  const std::string& path = which.files->paths[which.steps.frame(which.step)];
  const Trace::Span span(trace_, path);
  Entry made;
  std::optional<Error> failure;
  std::optional<std::uint32_t> reading;
  try {
    Stopwatch watch;
    made.volume = read(which, ends, reading, progress);
    const double load_seconds = watch.lap();
    made.built = build_grid(log_of(path), made.volume, settings, progress, *resource_limits_);
    made.built->seconds.load = load_seconds;
    made.built->volume = nullptr;
    made.grid_bytes = made.built->source->bytes();
    made.volume_bytes = made.volume->bytes();
    progress.check();
  } catch (...) {
    failure = caught(what);
  }
  const bool cancelled = failure && failure->code() == ErrorCode::cancelled;
  // Record the failure first, so that the step is not started again.
  if (failure && !cancelled && fail(which, reading, *failure, progress)) {
    const bool another = [&] {
      const std::scoped_lock lock(mutex_);
      return is_requested(which) && substitutes_[which.step].has_value();
    }();
    say_failures({&*failure, 1}, another);
  }
  std::vector<Entry> old;
  {
    const std::scoped_lock lock(mutex_);
    if (!failure) progress.check();
    if (!failure && is_requested(which)) {
      old.push_back(std::exchange(cache_[which.step], std::move(made)));
      ++revision_;
      std::ranges::move(take_excess(), std::back_inserter(old));
    }
  }
  if (cancelled) throw Error(*failure);
}

}  // namespace cumulet::viewer
