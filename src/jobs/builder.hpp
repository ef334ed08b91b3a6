#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "assets/volume_asset.hpp"
#include "assets/volume_file.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "jobs/built.hpp"
#include "jobs/job_source.hpp"
#include "jobs/worker.hpp"
#include "scene/march_source.hpp"

namespace cumulet::viewer {

/// Result of loading a VolumeFile.
struct LoadedVolume {
  VolumeAssetPtr volume;
  std::optional<double> density_scale;  ///< to be used for the medium
};

/// Low-resolution proxy, shown for a large file until it is read and built.
struct Proxy {
  VolumeInfoPtr volume_info;  ///< with the bounds of the whole volume
  scene::MarchSourcePtr source;
  std::optional<double> density_scale;  ///< suggested for it, if the medium is to use the suggestion
  std::weak_ptr<const void> load;       ///< expires with the job of the load
};

/// Loads volumes and builds their grids on a worker thread, one job at a time. Requests are coalesced: the latest wins.
/// A running build is finished first. In a stream of loads at least every second one is finished, so intermediate
/// results are displayed. Held at a time: one running job, one queued job and one result. All calls are thread-safe.
class Builder : public JobSource {
 public:
  explicit Builder(const JobContext& context)
      : JobSource(context),
        log_(context.log),
        notify_(context.notify),
        resource_limits_(context.resource_limits),
        worker_(context.notify, context.trace, context.resource_limits) {}

  /// Reads a file, then builds its grid unless `settings` is empty. Replaces the running job, as Worker::replace(),
  /// because files may take minutes. proxy: settings for the low-resolution proxy while `settings` is empty; null:
  /// no proxy.
  void load(const VolumeFile& file, std::optional<BuildSettings> settings,
            std::optional<BuildSettings> proxy = std::nullopt);
  /// Builds a grid for this volume, after the running job. before: as in build_grid().
  void build(VolumeAssetPtr volume, const BuildSettings& settings, scene::GridPlanPtr before = nullptr);
  /// Changes the settings of a running load. Returns false if there is none; the caller must then take the loaded
  /// volume and call build().
  bool configure_load(const std::optional<BuildSettings>& settings);
  void cancel() override;
  /// True while a file is being read or queued.
  [[nodiscard]] bool loads() const;
  /// Cancels only loads, because another volume has been set.
  void cancel_loads();
  /// Ends all jobs and drops their results and failures.
  void forget();
  /// Drops the failure of the last job.
  void forget_failure() { worker_.forget_failure(); }

  /// Returns the newest volume that was read, once.
  std::optional<LoadedVolume> take_loaded();
  /// Drops the volume that was read, if it has not been taken, and its grid.
  void drop_loaded();
  /// Returns the newest result, once.
  std::optional<Built> take_built();
  /// Returns the proxy of the running load, once.
  std::optional<Proxy> take_proxy();

  /// True if a job is running or a result has not been taken.
  [[nodiscard]] bool busy() const override;
  /// True if a result has not been taken.
  [[nodiscard]] bool has_result() const;
  [[nodiscard]] Worker::Status status() const override { return worker_.status(); }
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const override { return worker_.wait(until); }

 private:
  // Settings for the build that follows a load. They may change while `open`, until the file is read.
  struct Load {
    std::optional<BuildSettings> settings;
    std::optional<BuildSettings> proxy;
    bool open = true;
  };
  void read(const VolumeFile& file, const std::shared_ptr<Load>& load, Progress& progress);
  void build_proxy(const VolumeFile& file, volume::Proxy made, const std::shared_ptr<const Load>& load,
                   const Progress& loading);
  // jobs: cancels the jobs.
  void stop(const std::function<void()>& jobs);
  // Drops the proxy and cancels a proxy that is being built. Such a build has its own Progress, because the load's
  // reports reading the whole file. mutex_ must be held.
  void drop_proxy();
  void build_of(const VolumeAssetPtr& volume, const BuildSettings& settings, double load_seconds, Progress& progress,
                const scene::GridPlanPtr& before = nullptr);

  Log log_;
  std::function<void()> notify_;
  ResourceLimitsPtr resource_limits_;
  mutable std::mutex mutex_;
  std::weak_ptr<Load> load_;            // held by its job
  std::weak_ptr<Progress> proxy_load_;  // of the proxy that is being built
  std::optional<Proxy> proxy_;
  std::optional<LoadedVolume> loaded_;
  std::optional<Built> built_;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
