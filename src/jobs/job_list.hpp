#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "jobs/job_source.hpp"
#include "jobs/reported_failures.hpp"

namespace cumulet::viewer {

/// All sources of jobs of a viewer: its own, in the order in which they were added, then players. A player follows a
/// sequence or a dynamic volume of instances. status(), cancel() and wait() are thread-safe; for other functions the
/// caller holds the viewer's state lock.
class JobList {
 public:
  explicit JobList(JobContext context) : context_(std::move(context)) {}
  JobList(const JobList&) = delete;
  JobList& operator=(const JobList&) = delete;

  /// Adds a source for this kind of content.
  template <class Source>
  Source& add(ContentKind kind) {
    auto source = std::make_unique<Source>(context_);
    Source& added = *source;
    own_.push_back({kind, std::move(source)});
    return added;
  }
  /// Replaces the players.
  void set_players(std::vector<std::shared_ptr<JobSource>> players);
  /// Returns the arguments for a player.
  [[nodiscard]] JobContext context(JobLog::Player player) const;

  /// Calls the function of the same name of all sources, in order.
  void cancel();
  void rebuild();
  void set_job_log(JobLog* log);
  using Until = std::optional<std::chrono::steady_clock::time_point>;
  /// Waits for all sources, until the given time. Returns true unless the time ran out. Players that are replaced
  /// meanwhile are not waited for.
  bool wait(Until until) const;

  /// True if a source is busy.
  [[nodiscard]] bool busy() const;
  /// Only for one kind of content. Players belong to instances.
  [[nodiscard]] bool busy(ContentKind kind) const;

  struct Status {
    /// Of the first source that is working: own ones in the order of ContentKind, then players.
    Progress::Stage stage = Progress::Stage::idle;
    double fraction = 0.0;
    ContentFailures failures;  ///< that of the first source of each kind that has one
  };
  [[nodiscard]] Status status() const;

 private:
  struct Own {
    ContentKind kind;
    std::unique_ptr<JobSource> source;
  };
  // Calls `visit` with kind and source of all, with the lock.
  template <class Visit>
  void for_each(Visit&& visit) const;

  JobContext context_;
  std::vector<Own> own_;
  mutable std::mutex mutex_;  // of players_
  std::vector<std::shared_ptr<JobSource>> players_;
};

}  // namespace cumulet::viewer
