#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "base/log.hpp"
#include "base/trace.hpp"
#include "jobs/job_log.hpp"
#include "jobs/worker.hpp"

namespace cumulet::viewer {

/// Arguments that all sources of jobs have in common.
struct JobContext {
  Log log;
  std::function<void()> notify;  ///< called on a worker thread after each result, and when a job ended
  Trace trace = {};
  ResourceLimitsPtr resource_limits = std::make_shared<const ResourceLimits>();
  JobLog* job_log = nullptr;  ///< receives requests; null: none. For tests
  JobLog::Player player = 0;  ///< identifies the source there
};

/// A part of a viewer with jobs on worker threads. JobList calls these functions for all parts.
class JobSource {
 public:
  explicit JobSource(const JobContext& context) : job_log_(context.job_log), player_(context.player) {}
  virtual ~JobSource() = default;
  JobSource(const JobSource&) = delete;
  JobSource& operator=(const JobSource&) = delete;

  /// Ends running and queued jobs with ErrorCode::cancelled. Thread-safe.
  virtual void cancel() = 0;
  /// Lets finished and failed work be done again. Default: does nothing, because the viewer requests the work again.
  virtual void rebuild() {}
  /// True if a required result is being made or has not been taken.
  [[nodiscard]] virtual bool busy() const = 0;
  /// Thread-safe.
  [[nodiscard]] virtual Worker::Status status() const = 0;
  /// Waits until no required result is being made, or until the given time. Returns true unless the time ran out.
  virtual bool wait(std::optional<std::chrono::steady_clock::time_point> until) const = 0;
  /// False: wait() returns true at once, in threads that wait already too, until this is set to true again. Default:
  /// does nothing, because only players are dropped. Thread-safe.
  virtual void set_awaited(bool /*awaited*/) {}

  /// Sets the receiver of requests, or null; for tests.
  void set_job_log(JobLog* log) { job_log_ = log; }

 protected:
  /// Null: requests are not logged.
  [[nodiscard]] JobLog* job_log() const { return job_log_; }
  [[nodiscard]] JobLog::Player player() const { return player_; }
  /// Logs a call without arguments. worker: description of the worker.
  void log_call(const char* worker, const char* function) const {
    if (job_log_ != nullptr) job_log_->call(worker, player_, function);
  }

 private:
  JobLog* job_log_;
  JobLog::Player player_;
};

}  // namespace cumulet::viewer
