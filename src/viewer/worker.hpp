#pragma once

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

namespace cumulet::viewer {

/// A thread that does one job at a time; of those that wait, the newest. It begins with the first job. All calls are
/// safe from any thread, but for jobs, which may only look.
class Worker {
 public:
  struct Job {
    std::string what;  ///< begins the line when there is not enough memory
    Progress::Stage stage = Progress::Stage::loading;
    /// Throws if it fails. Nobody sees how a job ended that a newer one replaced: what it hands over it should hand
    /// over after a last progress.check(), under the lock that its owner holds around replace().
    std::function<void(Progress&)> work;
  };

  struct Status {
    Progress::Stage stage = Progress::Stage::idle;  ///< of the job that waits, else of the one under way
    double fraction = 0.0;
    std::optional<Error> failure;  ///< how the last job ended, if not well
  };

  /// notify: called on the thread after a job ended.
  explicit Worker(std::function<void()> notify) : notify_(std::move(notify)) {}
  /// Cancels and waits.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// In place of a job that waits; the one under way goes on to its end.
  void post(Job job) { take(std::move(job), false); }
  /// In place of a job that waits and of the one under way, which is cancelled.
  void replace(Job job) { take(std::move(job), true); }
  /// Ends both, soon, with ErrorCode::cancelled.
  void cancel();

  /// Whether a job waits or is under way.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Status status() const;
  /// Until there is nothing to do, at most until then. Returns whether there is not.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;

 private:
  void take(Job job, bool replaces);
  void run();

  std::function<void()> notify_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Job> next_;
  std::shared_ptr<Progress> current_;  // of the job under way
  std::optional<Error> failure_;
  bool stopping_ = false;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace cumulet::viewer
