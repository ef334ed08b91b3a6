#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/file_path.hpp"
#include "light/environment.hpp"
#include "light/sky.hpp"
#include "viewer/worker.hpp"

namespace cumulet::viewer {

/// Reads environments and computes physical skies, on a thread each: neither waits for the other. The newest wish wins,
/// and none starves, as Builder has it. All calls are safe from any thread.
class EnvironmentBuilder {
 public:
  /// notify: called on a worker after a job ended.
  explicit EnvironmentBuilder(const std::function<void()>& notify, Trace trace = {},
                              const AllowancePtr& allowance = nullptr)
      : files_(notify, trace, allowance), skies_(notify, trace, allowance) {}

  /// Reads a file. Replaces what is under way, as Worker::replace() does.
  void load(const FilePath& path);
  /// After the sky under way, which is shown first.
  void make_sky(const light::Day& day);
  /// Loads: skies are settings, and soon there. What was read, and nobody took, is dropped.
  void drop_loads();
  /// How the last sky ended is reported no more.
  void forget_sky_failure() { skies_.forget_failure(); }
  /// Loads under way; what was read is still to be taken.
  void cancel() { files_.cancel(); }

  /// The newest environment that was read, once.
  std::optional<light::EnvironmentPtr> take_environment();
  /// The newest sky, once.
  std::optional<light::Daylight> take_sky();

  /// Whether there is work under way, or a result that nobody took.
  [[nodiscard]] bool busy() const;
  /// Of loads; their failure, else that of skies.
  [[nodiscard]] Worker::Status status() const;
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const {
    return files_.wait(until) && skies_.wait(until);
  }

 private:
  mutable std::mutex mutex_;
  std::optional<light::EnvironmentPtr> environment_;
  std::optional<light::Daylight> sky_;
  std::optional<light::Daylight> last_sky_;  // of the one job at a time: whose air the next may keep
  Worker files_;                             // these last: their threads use all of the above
  Worker skies_;
};

}  // namespace cumulet::viewer
