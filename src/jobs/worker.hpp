#pragma once

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/error.hpp"
#include "base/progress.hpp"
#include "base/trace.hpp"
#include "jobs/resource_limits.hpp"
#include "jobs/worker_pool.hpp"

namespace cumulet::viewer {

/// Runs one job at a time, on threads of the pool. Only the newest queued job is kept. All calls are thread-safe; jobs
/// may only call queries and continue_later(). When the process ends, jobs end as if cancelled, and new jobs are
/// refused with Error(cancelled).
class Worker {
 public:
  struct Job {
    std::string what;  ///< prefix of the message if memory is exhausted
    Progress::Stage stage = Progress::Stage::loading;
    /// Throws if it fails. The failure of a job that was replaced is not reported. A job should publish its results
    /// after a last progress.check(), under the lock that its owner holds around replace().
    std::function<void(Progress&)> work;
    bool load = false;  ///< reads a file: see cancel_loads()
  };

  struct Status {
    Progress::Stage stage = Progress::Stage::idle;  ///< of the queued job, else of the running one
    double fraction = 0.0;
    std::optional<Error> failure;  ///< failure of the last job, if any
  };

  /// notify: called on the thread after a job ended. resource_limits: limits for jobs; null: none.
  explicit Worker(std::function<void()> notify, Trace trace = {}, ResourceLimitsPtr resource_limits = nullptr,
                  std::shared_ptr<WorkerPool> pool = WorkerPool::of_process())
      : notify_(std::move(notify)),
        trace_(trace),
        resource_limits_(std::move(resource_limits)),
        pool_(std::move(pool)) {}
  /// Cancels the job and waits for it.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Replaces the queued job; the running one is finished. Use it for jobs whose results are all worth displaying. With
  /// fast requests the running job's result is displayed, then the newest. At most one job's time is spent on outdated
  /// work.
  void post(Job job) { take(std::move(job), false); }
  /// Replaces the queued job and cancels the running one, unless the job before it was cancelled in this way too. A
  /// wrong choice does not delay the next one, but in a stream of requests at least every second job is finished.
  void replace(Job job) { take(std::move(job), true); }
  /// For a running job of many parts that finds out by itself what is left to do. Call it between two parts. If other
  /// workers wait for a thread, queues `rest` unless another job is queued, and returns true: the job should return.
  [[nodiscard]] bool continue_later(Job rest);
  /// Ends both jobs soon, with ErrorCode::cancelled.
  void cancel() { end_jobs(false); }
  /// Ends both jobs and drops their failures and that of the job before.
  void drop();
  /// cancel() for jobs that read a file.
  void cancel_loads() { end_jobs(true); }

  /// Drops the failure of the last job.
  void forget_failure();

  /// True if a job is queued or running.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Status status() const;
  /// Waits until idle, or until the given time. Returns true if idle.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;
  /// As JobSource::set_awaited().
  void set_awaited(bool awaited);

 private:
  // The running job and why it ends.
  struct Current {
    std::shared_ptr<Progress> progress;
    bool load = false;
    bool spared = false;  // not to be cancelled by replace(), because the job before it was cancelled for it
    bool replaced = false;
    bool dropped = false;
  };
  void take(Job job, bool replaces);
  // Makes run() end soon.
  void stop();
  void end_jobs(bool loads_only);
  // Runs jobs until none is queued.
  void run();
  void run_one(std::unique_lock<std::mutex>& lock);
  // Queues run() behind the waiting tasks of the pool, if there are any. mutex_ must be held.
  bool make_way();

  std::function<void()> notify_;
  Trace trace_;
  ResourceLimitsPtr resource_limits_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Job> next_;
  std::optional<Current> current_;
  bool last_was_replaced_ = false;
  std::optional<Error> failure_;
  bool stopping_ = false;
  bool awaited_ = true;
  std::shared_ptr<WorkerPool> pool_;
  bool active_ = false;     // run() is running, or will
  std::thread::id runner_;  // while it is running
  const pid_t process_ = getpid();
  const WorkerPool::TaskPtr task_ = std::make_shared<WorkerPool::Task>([this] { run(); }, [this] { stop(); });
};

}  // namespace cumulet::viewer
