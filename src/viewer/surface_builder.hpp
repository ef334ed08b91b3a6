#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "viewer/job_log.hpp"
#include "viewer/surface_asset.hpp"
#include "viewer/worker.hpp"

namespace cumulet::viewer {

/// Result of loading or posing surfaces.
struct PosedModel {
  SurfaceAssetPtr asset;  ///< if it was read from a file
  scene::ModelSourcePtr source;
};

/// Reads glTF scenes and poses them on a worker thread. Requests are coalesced as in Builder: the latest wins, and
/// running jobs are not starved. All calls are thread-safe.
class SurfaceBuilder {
 public:
  /// notify: called on the worker thread after a job ended.
  SurfaceBuilder(Log log, std::function<void()> notify, Trace trace = {}, ResourceLimitsPtr resource_limits = nullptr)
      : log_(std::move(log)), worker_(std::move(notify), trace, std::move(resource_limits)) {}

  /// Reads a file, then poses it. Replaces the running job, as Worker::replace().
  void load(const FilePath& path, SurfaceChoice choice);
  /// Changes the choice of a running load. Returns false if there is none; the caller must then take its result and
  /// call pose().
  bool configure_load(SurfaceChoice choice);
  /// Poses a scene after the running pose, so that slow poses are displayed before the next.
  void pose(SurfaceAssetPtr asset, SurfaceChoice choice);
  void cancel();
  /// Cancels only loads, because other surfaces have been set.
  void cancel_loads();
  /// Drops the failure of the last job.
  void forget_failure() { worker_.forget_failure(); }
  /// Returns the newest result, once.
  std::optional<PosedModel> take();
  /// True if a job is running or a result has not been taken.
  [[nodiscard]] bool busy() const;
  [[nodiscard]] Worker::Status status() const { return worker_.status(); }
  /// Waits until idle, or until the given time. Returns true if idle.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const { return worker_.wait(until); }
  /// Sets the receiver of requests, or null; for tests.
  void set_job_log(JobLog* log) { job_log_ = log; }

 private:
  // The choice for the pose that follows a load. It may change while `open`, until the pose begins.
  struct Load {
    SurfaceChoice choice;
    bool open = true;
  };
  void read(const FilePath& path, Load& load, Progress& progress);

  Log log_;
  JobLog* job_log_ = nullptr;
  mutable std::mutex mutex_;
  std::weak_ptr<Load> load_;  // held by its job
  std::optional<PosedModel> result_;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
