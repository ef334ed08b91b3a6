#include "viewer/builder.hpp"

#include <new>
#include <utility>

#include "grid/tet_grid.hpp"
#include "viewer/stopwatch.hpp"

namespace cumulet::viewer {

Builder::Builder(Log log, std::function<void()> notify) : log_(log), notify_(std::move(notify)) {}

Builder::~Builder() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    next_.reset();
    if (current_) current_->cancel();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Builder::post(Job job) {
  {
    const std::scoped_lock lock(mutex_);
    if (current_) current_->cancel();
    loading_ = false;
    next_ = std::move(job);
    error_.reset();
    message_.clear();
    // A result that nobody took is of an older wish.
    built_.reset();
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  }
  changed_.notify_all();
}

void Builder::load(std::string path, std::string grid_name, std::optional<BuildSettings> settings) {
  post({std::move(path), std::move(grid_name), nullptr, settings});
}

void Builder::build(VolumePtr volume, const BuildSettings& settings) { post({{}, {}, std::move(volume), settings}); }

bool Builder::configure_load(const std::optional<BuildSettings>& settings) {
  const std::scoped_lock lock(mutex_);
  if (next_ && !next_->path.empty()) {
    next_->settings = settings;
    return true;
  }
  if (!next_ && loading_) {
    load_settings_ = settings;
    return true;
  }
  return false;
}

void Builder::cancel() {
  {
    const std::scoped_lock lock(mutex_);
    if (!next_ && !current_) return;
    if (next_) {
      next_.reset();
      error_ = ErrorCode::cancelled;
      message_ = "cancelled";
    }
    if (current_) current_->cancel();
  }
  changed_.notify_all();
}

std::optional<VolumePtr> Builder::take_loaded() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(loaded_, std::nullopt);
}

std::optional<Built> Builder::take_built() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(built_, std::nullopt);
}

bool Builder::busy() const {
  const std::scoped_lock lock(mutex_);
  return next_ || current_ || loaded_ || built_;
}

Builder::Status Builder::status() const {
  const std::scoped_lock lock(mutex_);
  Status status;
  status.error = error_;
  status.message = message_;
  if (next_) {
    status.stage = next_->path.empty() ? Progress::Stage::refining : Progress::Stage::loading;
  } else if (current_) {
    status.stage = current_->stage();
    status.fraction = current_->fraction();
  }
  return status;
}

bool Builder::wait(std::optional<std::chrono::steady_clock::time_point> until) const {
  std::unique_lock lock(mutex_);
  const auto idle = [this] { return !next_ && !current_; };
  if (until) return changed_.wait_until(lock, *until, idle);
  changed_.wait(lock, idle);
  return true;
}

void Builder::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || next_; });
    if (stopping_) return;
    const Job job = *std::exchange(next_, std::nullopt);
    const auto progress = std::make_shared<Progress>();
    progress->begin(job.path.empty() ? Progress::Stage::refining : Progress::Stage::loading);
    current_ = progress;
    loading_ = !job.path.empty();
    load_settings_ = job.settings;
    lock.unlock();
    std::optional<ErrorCode> error;
    std::string message;
    try {
      work(job, *progress);
    } catch (const Error& e) {
      error = e.code();
      message = e.what();
    } catch (const std::bad_alloc&) {
      error = ErrorCode::out_of_memory;
      message = (job.path.empty() ? std::string("building the grid") : job.path) + ": out of memory";
    } catch (const std::exception& e) {
      error = ErrorCode::internal;
      message = std::string("internal error: ") + e.what();
    }
    lock.lock();
    current_.reset();
    loading_ = false;
    // A newer wish makes how this one ended old news.
    if (!next_) {
      error_ = error;
      message_ = message;
    }
    lock.unlock();
    changed_.notify_all();
    notify_();
    lock.lock();
  }
}

void Builder::work(const Job& job, Progress& progress) {
  VolumePtr volume = job.volume;
  std::optional<BuildSettings> settings = job.settings;
  Stopwatch watch;
  double load_seconds = 0.0;
  if (!job.path.empty()) {
    volume = std::make_shared<const VolumeAsset>(volume::import_volume(job.path, job.grid_name, log_, &progress));
    load_seconds = watch.lap();
    const std::scoped_lock lock(mutex_);
    progress.check();
    loaded_ = volume;
    loading_ = false;
    settings = load_settings_;
  }
  if (!settings) return;
  Built built = make(volume, *settings, progress);
  built.seconds.load = load_seconds;
  const std::scoped_lock lock(mutex_);
  progress.check();
  built_ = std::move(built);
}

Built Builder::make(const VolumePtr& volume, const BuildSettings& settings, Progress& progress) const {
  Built built;
  built.volume = volume;
  const auto statistics = volume->statistics(progress, built.seconds.statistics);
  Stopwatch watch;
  progress.begin(Progress::Stage::refining);
  if (settings.march != render::March::tet) {
    const std::shared_ptr<const volume::ScalarVolume> voxels(volume, &volume->volume());
    built.source =
        std::make_shared<const render::MarchSource>(render::make_voxel_source(settings.march, voxels, statistics));
    built.seconds.records = watch.lap();
    return built;
  }
  const auto diamonds = std::make_unique<const grid::DiamondSet>(*statistics, settings.refine, &progress);
  auto builder = std::make_unique<grid::GridBuilder>(*statistics, *diamonds);
  builder->bisect(&progress);
  built.seconds.refine = watch.lap();
  progress.begin(Progress::Stage::records);
  const float max_value = volume->volume().max_value;
  auto grid = std::make_shared<const grid::TetGrid>(builder->records(settings.refine.cells, max_value, &progress));
  builder.reset();
  built.seconds.records = watch.lap();
  built.cells = grid->cells.size();
  built.levels = grid->levels;
  built.limited = grid->limited;
  if (grid->limited) {
    log_.info("max_cells (" + std::to_string(settings.refine.max_cells) +
              ") ended the refinement before the threshold");
  }
  built.source = std::make_shared<const render::MarchSource>(
      render::make_tet_source(std::move(grid), settings.refine.cells == grid::CellKind::linear, max_value));
  return built;
}

}  // namespace cumulet::viewer
