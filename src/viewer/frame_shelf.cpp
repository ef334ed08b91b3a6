#include "viewer/frame_shelf.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <system_error>

#include "viewer/stopwatch.hpp"
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

FrameShelf::FrameShelf(Log log, std::function<void()> notify, Trace trace, AllowancePtr allowance)
    : log_(std::move(log)),
      notify_(std::move(notify)),
      trace_(trace),
      allowance_(std::move(allowance)),
      worker_([this] { tell(); }, trace) {}

void FrameShelf::wish(Wish wish) {
  std::vector<Shelved> old;  // destroyed after the lock is released, because its contents may be large
  {
    const std::scoped_lock lock(mutex_);
    const bool other_files = !is_wished(wish.files);
    const bool other_steps = other_files || wish.steps != wish_->steps;
    if (other_steps) {
      worker_.cancel();
      stand_ins_.reserve(wish.steps.count(wish.files->count()));  // so that nothing throws after the request has been
                                                                  // replaced
    }
    if (other_files) {
      old = std::exchange(shelf_, std::vector<Shelved>(wish.steps.count(wish.files->count())));
      judging_ = Judging::due;
      judged_.reset();
      temperature_scale_.reset();
      said_.clear();
    } else if (other_steps) {
      old = take_other_steps(wish.steps);
    }
    const bool suggested = wish.takes_suggested && wish.files->shown.suggested_density_scale;
    if (suggested && judged_ && judged_->density_scale && wish.settings)
      wish.settings->refine.density_scale = *judged_->density_scale;
    wish_ = std::move(wish);
    if (other_steps) find_stand_ins();
    cancelled_ = false;
    std::ranges::move(take_excess(), std::back_inserter(old));
    start();
  }
  changed_.notify_all();
}

void FrameShelf::clear() {
  std::vector<Shelved> old;
  {
    const std::scoped_lock lock(mutex_);
    worker_.cancel();
    wish_.reset();
    judged_.reset();
    old = std::exchange(shelf_, {});
  }
  changed_.notify_all();
}

void FrameShelf::rebuild() {
  std::vector<Shelved> old;
  const std::scoped_lock lock(mutex_);
  if (!wish_) return;
  for (Shelved& shelved : shelf_) {
    if (shelved.volume) old.emplace_back().volume = std::exchange(shelved.volume, nullptr);
    shelved.stale = true;
    shelved.failure.reset();
  }
  find_stand_ins();
  // The running job began before the call.
  worker_.cancel();
  if (judging_ == Judging::in_vain) judging_ = Judging::due;
  cancelled_ = false;
  start();
}

void FrameShelf::cancel() {
  {
    const std::scoped_lock lock(mutex_);
    cancelled_ = true;
    worker_.cancel();
  }
  changed_.notify_all();
}

std::optional<FrameShelf::Judged> FrameShelf::take_judged() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(judged_, std::nullopt);
}

std::optional<FrameShelf::Ready> FrameShelf::nearest() const {
  const std::scoped_lock lock(mutex_);
  if (!wish_) return std::nullopt;
  const auto wanted = first();
  const std::uint32_t target = wanted.value_or(wish_->order.front());
  const auto steps_there = static_cast<std::uint32_t>(shelf_.size());
  std::optional<std::uint32_t> found;
  // At equal distances the earlier step is preferred.
  for (std::uint32_t away = 0; !found && (away <= target || away < steps_there - target); ++away) {
    if (away <= target && shelf_[target - away].built) {
      found = target - away;
    } else if (away < steps_there - target && shelf_[target + away].built) {
      found = target + away;
    }
  }
  if (!found) return std::nullopt;
  const Steps& steps = wish_->steps;
  Ready ready{steps.frame(*found), steps.part(*found), *shelf_[*found].built,
              found == wanted && is_ready(shelf_[*found])};
  ready.built.volume = shelf_[*found].volume;
  return ready;
}

FrameShelf::Status FrameShelf::frames() const {
  const std::scoped_lock lock(mutex_);
  Status status;
  for (std::uint32_t step = 0; step < shelf_.size(); ++step) {
    const Shelved& shelved = shelf_[step];
    if (!wish_->steps.is_between(step))
      status.frames.push_back(shelved.failure ? State::failed : is_ready(shelved) ? State::ready : State::waiting);
    status.bytes += (shelved.built ? shelved.grid_bytes : 0) + (shelved.volume ? shelved.volume_bytes : 0);
  }
  return status;
}

std::optional<Error> FrameShelf::failure_of(std::uint32_t frame) const {
  const std::scoped_lock lock(mutex_);
  return wish_ && frame < wish_->files->count() ? own(frame).failure : std::nullopt;
}

bool FrameShelf::busy() const {
  const std::scoped_lock lock(mutex_);
  return waits();
}

Worker::Status FrameShelf::status() const {
  const std::scoped_lock lock(mutex_);
  const Worker::Status work = worker_.status();
  Worker::Status status;
  if (waits()) status = work;
  status.failure.reset();
  if (!wish_) return status;
  if (is_judged() && !first()) {
    status.failure = own(wish_->steps.frame(wish_->order.front())).failure;
  } else if (work.failure && work.failure->code() != ErrorCode::cancelled) {
    status.failure = work.failure;  // not caused by a file; building failed
  }
  return status;
}

bool FrameShelf::wait(std::optional<std::chrono::steady_clock::time_point> until) const {
  std::unique_lock lock(mutex_);
  const auto ready = [this] { return !waits(); };
  if (until) return changed_.wait_until(lock, *until, ready);
  changed_.wait(lock, ready);
  return true;
}

void FrameShelf::tell() {
  {
    const std::scoped_lock lock(mutex_);  // so that a waiting thread has either not checked its condition yet, or is
                                          // waiting
  }
  changed_.notify_all();
  notify_();
}

// ---- mutex_ is held ----

void FrameShelf::start() {
  if (is_judged() && !next()) {
    worker_.forget_failure();
    return;
  }
  worker_.post({what, Progress::Stage::loading, [this](Progress& progress) { work(progress); }});
}

bool FrameShelf::is_ready(const Shelved& shelved) const {
  return shelved.built && !shelved.stale && wish_->settings && shelved.built->serves(*wish_->settings);
}

bool FrameShelf::is_possible(std::uint32_t step) const {
  const Steps& steps = wish_->steps;
  const std::uint32_t frame = steps.frame(step);
  if (shelf_[step].failure || own(frame).failure) return false;
  return !steps.is_between(step) || !own(frame + 1).failure;
}

void FrameShelf::find_stand_ins() {
  stand_ins_.assign(shelf_.size(), std::nullopt);
  std::uint32_t last = 0;
  while (last < shelf_.size() && shelf_[last].failure) last += wish_->steps.a_frame;
  if (last >= shelf_.size()) return;
  for (std::uint32_t step = 0; step < shelf_.size(); ++step) {
    const bool possible = is_possible(step);
    if (possible && !wish_->steps.is_between(step)) last = step;
    stand_ins_[step] = possible ? step : last;
  }
}

std::vector<FrameShelf::Shelved> FrameShelf::take_other_steps(const Steps& steps) {
  std::vector<Shelved> other(steps.count(wish_->files->count()));
  for (std::uint32_t frame = 0; frame < wish_->files->count(); ++frame) std::swap(other[steps.own(frame)], own(frame));
  return std::exchange(shelf_, std::move(other));
}

std::vector<std::uint32_t> FrameShelf::kept() const {
  std::uint64_t known = 0;
  std::uint64_t known_bytes = 0;
  for (const Shelved& shelved : shelf_) {
    known += shelved.grid_bytes > 0 ? 1U : 0U;
    known_bytes += shelved.grid_bytes;
  }
  const std::uint64_t likely = known > 0 ? known_bytes / known : 0;
  std::vector<std::uint32_t> frames;
  std::vector<bool> taken(shelf_.size());
  std::uint64_t bytes = 0;
  for (const std::uint32_t wished : wish_->order) {
    const auto frame = stand_ins_[wished];
    if (!frame || taken[*frame]) continue;
    const std::uint64_t takes = shelf_[*frame].grid_bytes > 0 ? shelf_[*frame].grid_bytes : likely;
    if (!frames.empty() && bytes + takes > wish_->memory_bytes) break;
    bytes += takes;
    taken[*frame] = true;
    frames.push_back(*frame);
  }
  return frames;
}

std::optional<std::uint32_t> FrameShelf::next() const {
  if (!wish_ || !wish_->settings || cancelled_ || judging_ != Judging::done) return std::nullopt;
  for (const std::uint32_t frame : kept()) {
    if (!is_ready(shelf_[frame])) return frame;
  }
  return std::nullopt;
}

bool FrameShelf::waits() const {
  if (!wish_ || cancelled_ || !worker_.busy()) return false;
  if (!is_judged()) return true;
  const auto wanted = first();
  return wanted && !is_ready(shelf_[*wanted]);
}

std::vector<FrameShelf::Shelved> FrameShelf::take_excess() {
  std::uint64_t bytes = 0;
  for (const Shelved& shelved : shelf_)
    bytes += (shelved.built ? shelved.grid_bytes : 0) + (shelved.volume ? shelved.volume_bytes : 0);
  std::vector<Shelved> excess;
  if (bytes <= wish_->memory_bytes) return excess;
  // Orders by need; the first needed step always stays.
  constexpr std::size_t not_needed = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> rank(shelf_.size(), not_needed);
  const std::vector<std::uint32_t> needed = kept();
  for (std::size_t i = 0; i < needed.size(); ++i) rank[needed[i]] = i;
  std::vector<std::uint32_t> frames;
  for (std::uint32_t frame = 0; frame < shelf_.size(); ++frame) {
    const bool is_first = !needed.empty() && frame == needed.front();
    if (!is_first && (shelf_[frame].built || shelf_[frame].volume)) frames.push_back(frame);
  }
  std::ranges::sort(frames, [&](std::uint32_t a, std::uint32_t b) { return rank[a] > rank[b]; });
  const auto fits = [&] { return bytes <= wish_->memory_bytes; };
  for (const std::uint32_t frame : frames) {
    Shelved& shelved = shelf_[frame];
    if (fits()) return excess;
    if (!shelved.volume) continue;
    bytes -= shelved.volume_bytes;
    excess.emplace_back().volume = std::exchange(shelved.volume, nullptr);
  }
  for (const std::uint32_t frame : frames) {
    Shelved& shelved = shelf_[frame];
    if (fits()) return excess;
    if (!shelved.built) continue;
    bytes -= shelved.grid_bytes;
    excess.emplace_back().built = std::exchange(shelved.built, std::nullopt);
  }
  return excess;
}

// ---- on the worker thread ----

void FrameShelf::work(Progress& progress) {
  std::optional<Ends> ends;
  for (;;) {
    std::optional<Which> step;
    BuildSettings settings;
    FrameFilesPtr to_judge;
    {
      const std::scoped_lock lock(mutex_);
      if (!wish_ || cancelled_) return;
      if (judging_ == Judging::due) {
        to_judge = wish_->files;
      } else if (const auto found = next()) {
        step = Which{wish_->files, wish_->steps, *found};
        settings = *wish_->settings;
      } else {
        return;
      }
    }
    // Limits apply to each step separately: with a thread limit, other jobs run between two steps.
    allowance_->run([&] {
      if (to_judge) {
        judge(to_judge, progress);
      } else {
        build(*step, settings, ends, progress);
      }
    });
    tell();
  }
}

Log FrameShelf::log_of(const std::string& path) {
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

void FrameShelf::say_failures(std::span<const Error> failures, bool another_is_shown) const {
  for (const Error& failure : failures) {
    const std::string cause = failure.what();
    log_.warning(another_is_shown ? cause + ": another frame of the sequence is shown instead" : cause);
  }
}

bool FrameShelf::fail(const Which& which, std::optional<std::uint32_t> frame, const Error& failure,
                      const Progress& progress) {
  {
    const std::scoped_lock lock(mutex_);
    progress.check();  // cancellation for a rebuild also happens under the lock
    if (!is_wished(which)) return false;
    (frame ? own(*frame) : shelf_[which.step]).failure = failure;
    find_stand_ins();
    ++revision_;
  }
  return true;
}

void FrameShelf::judge(const FrameFilesPtr& files, Progress& progress) {
  Judged judged;
  Steps steps;
  {
    const std::scoped_lock lock(mutex_);
    if (!is_wished(files)) return;
    steps = wish_->steps;
  }
  const auto end = [&](Judging how) {
    const std::scoped_lock lock(mutex_);
    if (!is_wished(files)) return;
    if (how != Judging::due) progress.check();
    judging_ = how;
    if (how != Judging::done) return;
    if (wish_->takes_suggested && files->shown.suggested_density_scale && judged.density_scale && wish_->settings)
      wish_->settings->refine.density_scale = *judged.density_scale;
    judged_ = judged;
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
          if (!is_wished(files)) throw Error(ErrorCode::cancelled, "cancelled");
          own(frame).volume = volume;
          own(frame).volume_bytes = bytes;
        }
        if (!judged.facts || !volume->empty()) judged.facts = volume->facts();
        settle_temperature(*files, *volume);
        if (!volume->empty()) break;
      } catch (...) {
        const Error failure = caught(what);
        if (failure.code() == ErrorCode::cancelled) throw Error(failure);
        if (fail({files, steps, 0}, frame, failure, progress)) failures.push_back(failure);
      }
    }
    if (judged.facts) judged.density_scale = judged.facts->coarse.suggest_density_scale();
  } catch (...) {
    say_failures(failures, judged.facts != nullptr);
    end(Judging::due);
    throw;
  }
  // Only now it is known whether another frame can be shown.
  say_failures(failures, judged.facts != nullptr);
  end(judged.facts ? Judging::done : Judging::in_vain);
}

void FrameShelf::settle_temperature(const FrameFiles& files, const VolumeAsset& volume) {
  const auto& temperature = volume.frame().temperature;
  if (!temperature || !(temperature->max_value > 0.0F)) return;
  const std::scoped_lock lock(mutex_);
  if (wish_ && wish_->files.get() == &files && !temperature_scale_) temperature_scale_ = volume.temperature_scale();
}

VolumeAssetPtr FrameShelf::read_frame(const Which& which, std::uint32_t frame, Progress& progress) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_wished(which) && own(frame).volume) return own(frame).volume;
  }
  VolumeFile file = which.files->file(frame);
  {
    const std::scoped_lock lock(mutex_);
    if (is_wished(which)) file.temperature_scale = temperature_scale_;
  }
  progress.begin(Progress::Stage::loading);
  VolumeAssetPtr volume = file.read(log_of(file.path.given()), &progress);
  settle_temperature(*which.files, *volume);
  const std::uint64_t bytes = volume->bytes();
  std::vector<Shelved> old;
  const std::scoped_lock lock(mutex_);
  progress.check();
  if (is_wished(which)) {
    own(frame).volume = volume;
    own(frame).volume_bytes = bytes;
    old = take_excess();
  }
  return volume;
}

VolumeAssetPtr FrameShelf::read(const Which& which, std::optional<Ends>& ends, std::optional<std::uint32_t>& reading,
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
    if (is_wished(which) && shelf_[which.step].volume) return shelf_[which.step].volume;
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
    throw Error(error.code(), which.files->paths[frame] + ": what follows it cannot be made: " + error.what());
  }
}

void FrameShelf::build(const Which& which, const BuildSettings& settings, std::optional<Ends>& ends,
                       Progress& progress) {
  const std::string& path = which.files->paths[which.steps.frame(which.step)];
  const Trace::Span span(trace_, path);
  Shelved made;
  std::optional<Error> failure;
  std::optional<std::uint32_t> reading;
  try {
    Stopwatch watch;
    made.volume = read(which, ends, reading, progress);
    const double load_seconds = watch.lap();
    made.built = build_grid(log_of(path), made.volume, settings, progress, *allowance_);
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
      return is_wished(which) && stand_ins_[which.step].has_value();
    }();
    say_failures({&*failure, 1}, another);
  }
  std::vector<Shelved> old;
  {
    const std::scoped_lock lock(mutex_);
    if (!failure) progress.check();
    if (!failure && is_wished(which)) {
      old.push_back(std::exchange(shelf_[which.step], std::move(made)));
      ++revision_;
      std::ranges::move(take_excess(), std::back_inserter(old));
    }
  }
  if (cancelled) throw Error(*failure);
}

}  // namespace cumulet::viewer
