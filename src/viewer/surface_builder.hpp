#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/log.hpp"
#include "base/progress.hpp"
#include "render/surface_data.hpp"

namespace cumulet::viewer {

using SurfacePtr = std::shared_ptr<const render::SurfaceSource>;

/// Which moment of which animation.
struct SurfaceMoment {
  double time = 0.0;  // seconds
  std::uint32_t animation = 0;
  bool operator==(const SurfaceMoment&) const = default;
};

/// Reads glTF scenes and poses them on a thread of its own; the newest wish wins. All calls are safe from any thread.
class SurfaceBuilder {
 public:
  /// notify: called on the worker after a job ended.
  SurfaceBuilder(Log log, std::function<void()> notify) : log_(log), notify_(std::move(notify)) {}
  /// Cancels and waits.
  ~SurfaceBuilder();
  SurfaceBuilder(const SurfaceBuilder&) = delete;
  SurfaceBuilder& operator=(const SurfaceBuilder&) = delete;

  /// Reads a file, then poses it. Replaces what is under way.
  void load(std::string path, SurfaceMoment moment);
  /// Poses what was made last anew; a load under way takes the moment over.
  void pose(SurfacePtr last, SurfaceMoment moment);
  void cancel();
  /// The newest result, once.
  std::optional<SurfacePtr> take();
  /// Whether there is work under way, or a result that nobody took.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] bool working() const;
  /// How the last job ended, if it failed.
  [[nodiscard]] std::optional<Error> failure() const;
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const;

 private:
  struct Job {
    std::string path;  // empty: pose only
    SurfacePtr last;
    SurfaceMoment moment;
  };
  void post(Job job);
  void run();

  Log log_;
  std::function<void()> notify_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::optional<Job> next_;
  std::optional<Job> under_way_;
  std::shared_ptr<Progress> current_;
  bool stopping_ = false;
  std::optional<SurfacePtr> result_;
  std::optional<Error> failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace cumulet::viewer
