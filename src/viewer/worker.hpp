#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "base/library_thread.hpp"
#include "base/progress.hpp"
#include "base/trace.hpp"
#include "viewer/allowance.hpp"

namespace cumulet::viewer {

/// A thread that does one job at a time; of those that wait, the newest. It begins with the first job. All calls are
/// safe from any thread, but for jobs, which may only look. When the process ends, jobs end as if they were cancelled,
/// and others are refused with Error(cancelled).
class Worker {
 public:
  struct Job {
    std::string what;  ///< begins the line when there is not enough memory
    Progress::Stage stage = Progress::Stage::loading;
    /// Throws if it fails. Nobody sees how a job ended that a newer one replaced: what it hands over it should hand
    /// over after a last progress.check(), under the lock that its owner holds around replace().
    std::function<void(Progress&)> work;
    bool load = false;  ///< reads a file: see cancel_loads()
  };

  struct Status {
    Progress::Stage stage = Progress::Stage::idle;  ///< of the job that waits, else of the one under way
    double fraction = 0.0;
    std::optional<Error> failure;  ///< how the last job ended, if not well
  };

  /// notify: called on the thread after a job ended.
  /// allowance: what jobs may take; null: whatever there is.
  explicit Worker(std::function<void()> notify, Trace trace = {}, AllowancePtr allowance = nullptr)
      : notify_(std::move(notify)), trace_(trace), allowance_(std::move(allowance)) {}
  /// Cancels and waits.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// In place of a job that waits; the one under way goes on to its end. For jobs that each make a picture of their
  /// own: however fast wishes come, what is under way is shown, and then the newest. None starves, and at most one
  /// job's time is spent on what nobody wants any more.
  void post(Job job) { take(std::move(job), false); }
  /// In place of a job that waits and of the one under way, which is cancelled, unless the job before it was so as
  /// well: whoever chose wrongly need not wait, but of a stream of wishes at least every second is finished.
  void replace(Job job) { take(std::move(job), true); }
  /// Ends both, soon, with ErrorCode::cancelled.
  void cancel() { end_jobs(false); }
  /// The same, and nobody is told how they ended, nor how the one before did.
  void drop();
  /// cancel() of those that read a file.
  void cancel_loads() { end_jobs(true); }

  /// How the last job ended is told no more.
  void forget_failure();

  /// Whether a job waits or is under way.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Status status() const;
  /// Until there is nothing to do, at most until then. Returns whether there is not.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;

 private:
  // A job under way, and why it ends.
  struct Current {
    std::shared_ptr<Progress> progress;
    bool load = false;
    bool spared = false;  // by replace(): the one before was cancelled for it
    bool replaced = false;
    bool dropped = false;
  };
  void take(Job job, bool replaces);
  // The thread ends soon.
  void stop();
  void end_jobs(bool loads_only);
  void run();

  std::function<void()> notify_;
  Trace trace_;
  AllowancePtr allowance_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Job> next_;
  std::optional<Current> current_;
  bool last_was_replaced_ = false;
  std::optional<Error> failure_;
  bool stopping_ = false;
  std::optional<LibraryThread> thread_;  // last: it uses all of the above
};

}  // namespace cumulet::viewer
