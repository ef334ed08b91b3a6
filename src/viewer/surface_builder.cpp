#include "viewer/surface_builder.hpp"

#include <new>
#include <utility>

namespace cumulet::viewer {

SurfaceBuilder::~SurfaceBuilder() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    next_.reset();
    if (current_) current_->cancel();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void SurfaceBuilder::post(Job job) {
  next_ = std::move(job);
  failure_.reset();
  result_.reset();
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

void SurfaceBuilder::load(std::string path, SurfaceMoment moment) {
  {
    const std::scoped_lock lock(mutex_);
    if (current_) current_->cancel();
    post({std::move(path), nullptr, moment});
  }
  changed_.notify_all();
}

void SurfaceBuilder::pose(SurfacePtr last, SurfaceMoment moment) {
  {
    const std::scoped_lock lock(mutex_);
    if (next_ && !next_->path.empty()) {
      next_->moment = moment;
      return;
    }
    if (under_way_ && !under_way_->path.empty()) {
      // Posed once it is read: the loop in run() sees this.
      under_way_->moment = moment;
      return;
    }
    if (last == nullptr) return;
    post({{}, std::move(last), moment});
  }
  changed_.notify_all();
}

void SurfaceBuilder::cancel() {
  {
    const std::scoped_lock lock(mutex_);
    if (next_) failure_ = Error(ErrorCode::cancelled, "cancelled");
    next_.reset();
    if (current_) current_->cancel();
  }
  changed_.notify_all();
}

std::optional<SurfacePtr> SurfaceBuilder::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

bool SurfaceBuilder::busy() const {
  const std::scoped_lock lock(mutex_);
  return next_ || current_ || result_;
}

bool SurfaceBuilder::working() const {
  const std::scoped_lock lock(mutex_);
  return next_ || current_;
}

std::optional<Error> SurfaceBuilder::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

bool SurfaceBuilder::wait(std::optional<std::chrono::steady_clock::time_point> until) const {
  std::unique_lock lock(mutex_);
  const auto idle = [this] { return !next_ && !current_; };
  if (until) return changed_.wait_until(lock, *until, idle);
  changed_.wait(lock, idle);
  return true;
}

void SurfaceBuilder::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || next_; });
    if (stopping_) return;
    under_way_ = std::exchange(next_, std::nullopt);
    Job job = *under_way_;
    const auto progress = std::make_shared<Progress>();
    current_ = progress;
    lock.unlock();
    std::optional<Error> failure;
    SurfacePtr made = job.last;
    try {
      surface::ScenePtr scene = job.path.empty() ? nullptr : surface::import_gltf(job.path, log_, progress.get());
      for (;;) {
        progress->check();
        const surface::Scene& posed = scene ? *scene : *made->scene;
        surface::Pose pose = posed.pose(job.moment.time, job.moment.animation);
        made = scene ? render::make_surface_source(std::exchange(scene, nullptr), std::move(pose), progress.get())
                     : render::make_surface_source(*made, std::move(pose), progress.get());
        const std::scoped_lock again(mutex_);
        if (under_way_->moment == job.moment) break;
        job.moment = under_way_->moment;
      }
    } catch (const Error& e) {
      failure = e;
    } catch (const std::bad_alloc&) {
      failure = Error(ErrorCode::out_of_memory,
                      (job.path.empty() ? "posing the surfaces" : job.path) + std::string(": out of memory"));
    } catch (const std::exception& e) {
      failure = Error(ErrorCode::internal, std::string("internal error: ") + e.what());
    }
    lock.lock();
    current_.reset();
    under_way_.reset();
    if (!next_) {
      failure_ = failure;
      if (!failure && !progress->cancelled()) result_ = std::move(made);
    }
    lock.unlock();
    changed_.notify_all();
    notify_();
    lock.lock();
  }
}

}  // namespace cumulet::viewer
