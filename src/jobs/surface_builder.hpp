#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "assets/surface_asset.hpp"
#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "jobs/job_source.hpp"
#include "jobs/worker.hpp"

namespace cumulet::viewer {

/// Result of loading or posing surfaces.
struct PosedModel {
  SurfaceAssetPtr asset;  ///< if it was read from a file
  scene::ModelSourcePtr source;
};

/// Reads glTF scenes and poses them on a worker thread. Requests are coalesced as in Builder: the latest wins, and
/// running jobs are not starved. All calls are thread-safe.
class SurfaceBuilder : public JobSource {
 public:
  explicit SurfaceBuilder(const JobContext& context)
      : JobSource(context), log_(context.log), worker_(context.notify, context.trace, context.resource_limits) {}

  /// Reads a file, then poses it. Replaces the running job, as Worker::replace().
  void load(const FilePath& path, SurfaceChoice choice);
  /// Changes the choice of a running load. Returns false if there is none; the caller must then take its result and
  /// call pose().
  bool configure_load(SurfaceChoice choice);
  /// Poses a scene after the running pose, so that slow poses are displayed before the next.
  void pose(SurfaceAssetPtr asset, SurfaceChoice choice);
  void cancel() override;
  /// Cancels only loads, because other surfaces have been set.
  void cancel_loads();
  /// Drops the failure of the last job.
  void forget_failure() { worker_.forget_failure(); }
  /// Returns the newest result, once.
  std::optional<PosedModel> take();
  [[nodiscard]] bool busy() const override;
  [[nodiscard]] Worker::Status status() const override { return worker_.status(); }
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override { return worker_.wait(until); }

 private:
  // The choice for the pose that follows a load. It may change while `open`, until the pose begins.
  struct Load {
    SurfaceChoice choice;
    bool open = true;
  };
  void read(const FilePath& path, Load& load, Progress& progress);

  Log log_;
  mutable std::mutex mutex_;
  std::weak_ptr<Load> load_;  // held by its job
  std::optional<PosedModel> result_;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
