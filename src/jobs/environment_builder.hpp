#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/file_path.hpp"
#include "jobs/job_source.hpp"
#include "jobs/worker.hpp"
#include "light/environment.hpp"
#include "light/sky.hpp"

namespace cumulet::viewer {

/// Reads environment maps and computes physical skies, on one worker thread each. Requests are coalesced as in Builder:
/// the latest wins, and running jobs are not starved. All calls are thread-safe.
class EnvironmentBuilder : public JobSource {
 public:
  explicit EnvironmentBuilder(const JobContext& context)
      : JobSource(context),
        files_(context.notify, context.trace, context.resource_limits),
        skies_(context.notify, context.trace, context.resource_limits) {}

  /// Reads a file. Replaces the running load, as Worker::replace().
  void load(const FilePath& path);
  /// Computes a sky, after the running one, which is displayed first.
  void make_sky(const light::Day& day);
  /// Cancels loads and drops an untaken result. Skies are not affected: they belong to the settings and are fast.
  void drop_loads();
  /// Drops the failure of the last sky.
  void forget_sky_failure() { skies_.forget_failure(); }
  /// Cancels loads; an untaken result remains.
  void cancel() override;

  /// Returns the newest environment that was read, once.
  std::optional<light::EnvironmentPtr> take_environment();
  /// Returns the newest sky, once.
  std::optional<light::Daylight> take_sky();

  [[nodiscard]] bool busy() const override;
  /// Status of loads. The failure is that of loads, else that of skies.
  [[nodiscard]] Worker::Status status() const override;
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override {
    return files_.wait(until) && skies_.wait(until);
  }

 private:
  mutable std::mutex mutex_;
  std::optional<light::EnvironmentPtr> environment_;
  std::optional<light::Daylight> sky_;
  std::optional<light::Daylight> last_sky_;  // used only by the running sky job; the next may reuse its atmosphere
  Worker files_;                             // last: their threads use all of the above
  Worker skies_;
};

}  // namespace cumulet::viewer
