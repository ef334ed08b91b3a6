#include "jobs/worker.hpp"

#include <new>
#include <utility>

namespace cumulet::viewer {

namespace {

std::optional<Error> failure_of(const Worker::Job& job, const ResourceLimitsPtr& resource_limits, Progress& progress) {
  try {
    if (resource_limits) {
      resource_limits->run([&] { job.work(progress); });
    } else {
      job.work(progress);
    }
    return std::nullopt;
  } catch (...) {
    return caught(job.what);
  }
}

}  // namespace

Worker::~Worker() {
  if (process_ != getpid()) {
    // A forked child does not have the threads, so that destroying the pool would wait forever.
    static_cast<void>(new (std::nothrow) std::shared_ptr<WorkerPool>(std::move(pool_)));
    return;
  }
  task_->forget_stop();
  stop();
  if (pool_->remove(task_)) return;
  std::unique_lock lock(mutex_);
  // A callback on the thread itself may have called exit(); the thread never returns then.
  if (runner_ == std::this_thread::get_id()) return;
  changed_.wait(lock, [this] { return !active_; });
}

void Worker::stop() {
  std::optional<Job> never_begun;
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    if (current_) current_->progress->cancel();
    // It will not run; threads waiting for it must return.
    never_begun = std::exchange(next_, std::nullopt);
    if (never_begun) failure_ = Error(ErrorCode::cancelled, "cancelled");
  }
  changed_.notify_all();
}

void Worker::take(Job job, bool replaces) {
  std::optional<Job> old;  // destroyed after the lock is released, because its contents may be large
  {
    const std::scoped_lock lock(mutex_);
    // Both may throw, so they come before any change.
    if (stopping_) throw Error(ErrorCode::cancelled, "the process is exiting");
    if (!active_) {
      pool_->run(task_);
      active_ = true;
    }
    if (replaces && current_ && !current_->spared) {
      current_->replaced = true;
      current_->progress->cancel();
    }
    old = std::exchange(next_, std::move(job));
    failure_.reset();
  }
  changed_.notify_all();
}

bool Worker::continue_later(Job rest) {
  if (!pool_->is_contended()) return false;
  const std::scoped_lock lock(mutex_);
  if (stopping_ || !current_ || current_->progress->cancelled()) return false;
  if (!next_) next_ = std::move(rest);
  return true;
}

void Worker::end_jobs(bool loads_only) {
  std::optional<Job> old;
  {
    const std::scoped_lock lock(mutex_);
    if (next_ && (next_->load || !loads_only)) {
      failure_ = Error(ErrorCode::cancelled, "cancelled");
      old = std::exchange(next_, std::nullopt);
    }
    if (current_ && (current_->load || !loads_only)) current_->progress->cancel();
  }
  changed_.notify_all();
}

void Worker::drop() {
  std::optional<Job> old;
  {
    const std::scoped_lock lock(mutex_);
    old = std::exchange(next_, std::nullopt);
    failure_.reset();
    if (current_) {
      current_->dropped = true;
      current_->progress->cancel();
    }
  }
  changed_.notify_all();
}

void Worker::forget_failure() {
  const std::scoped_lock lock(mutex_);
  failure_.reset();
}

bool Worker::busy() const {
  const std::scoped_lock lock(mutex_);
  return next_ || current_.has_value();
}

Worker::Status Worker::status() const {
  const std::scoped_lock lock(mutex_);
  Status status;
  status.failure = failure_;
  if (next_) {
    status.stage = next_->stage;
  } else if (current_) {
    status.stage = current_->progress->stage();
    status.fraction = current_->progress->fraction();
  }
  return status;
}

bool Worker::wait(std::optional<std::chrono::steady_clock::time_point> until) const {
  std::unique_lock lock(mutex_);
  const auto idle = [this] { return !awaited_ || (!next_ && !current_); };
  if (until) return changed_.wait_until(lock, *until, idle);
  changed_.wait(lock, idle);
  return true;
}

void Worker::set_awaited(bool awaited) {
  {
    const std::scoped_lock lock(mutex_);
    awaited_ = awaited;
  }
  changed_.notify_all();
}

void Worker::run_one(std::unique_lock<std::mutex>& lock) {
  std::optional<Job> job = std::exchange(next_, std::nullopt);
  const auto progress = std::make_shared<Progress>();
  progress->begin(job->stage);
  current_ = Current{progress, job->load, last_was_replaced_};
  lock.unlock();
  std::optional<Error> failure;
  {
    const Trace::Span span(trace_, job->what);
    failure = failure_of(*job, resource_limits_, *progress);
  }
  job.reset();
  // A cancelled job reports only its cancellation, because its result is no longer needed.
  if (failure && progress->cancelled()) failure = Error(ErrorCode::cancelled, "cancelled");
  lock.lock();
  last_was_replaced_ = current_->replaced;
  const bool dropped = current_->dropped;
  current_.reset();
  // If a newer job is queued, this job's failure is not reported.
  if (!next_ && !dropped) failure_ = std::move(failure);
  lock.unlock();
  keep_statics(StaticsOf::job);
  changed_.notify_all();
  notify_();
  lock.lock();
}

void Worker::run() {
  std::unique_lock lock(mutex_);
  // Also if a callback of the host ends the thread. This object may be gone after it.
  struct End {
    Worker& worker;
    std::unique_lock<std::mutex>& lock;
    bool runs_again = false;
    ~End() {
      if (!lock.owns_lock()) lock.lock();
      worker.current_.reset();
      worker.active_ = runs_again;
      worker.runner_ = {};
      worker.changed_.notify_all();
    }
  } end{*this, lock};
  runner_ = std::this_thread::get_id();
  while (next_) {
    run_one(lock);
    // A stream of jobs must not keep other workers from running.
    end.runs_again = next_ && make_way();
    if (end.runs_again) return;
  }
  if (!process_is_ending()) return;
  lock.unlock();
  notify_();
}

bool Worker::make_way() {
  if (!pool_->is_contended()) return false;
  try {
    pool_->run(task_);
    return true;
  } catch (...) {
    return false;  // no thread can be created
  }
}

}  // namespace cumulet::viewer
