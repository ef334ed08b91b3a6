#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "grid/refine.hpp"
#include "scene/channels.hpp"
#include "scene/march_source.hpp"
#include "viewer/job_source.hpp"
#include "viewer/volume_asset.hpp"
#include "viewer/worker.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::viewer {

/// A volume file, the grids to show, and its transform.
struct VolumeFile {
  FilePath path;
  volume::GridNames grids;
  glm::dmat4 to_world{1.0};              ///< affine, from the file's own world space
  bool suggested_density_scale = false;  ///< the medium uses the density scale suggested for the volume
  /// As VolumeFrame::temperature_scale.
  std::optional<double> temperature_scale = {};
  /// Minimum number of bricks for which a low-resolution proxy is made; tests use other values.
  std::uint64_t min_proxy_bricks = volume::worth_a_proxy;

  /// Throws the errors of import_frame() and of VolumeAsset's constructor.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress) const;
  /// take_proxy: receives the low-resolution proxy from import_frame(), transformed by to_world.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress,
                                    const std::function<void(volume::Proxy)>& take_proxy) const;
};

/// Result of loading a VolumeFile.
struct LoadedVolume {
  VolumeAssetPtr volume;
  std::optional<double> density_scale;  ///< to be used for the medium
};

/// Device that builds tetrahedral grids.
enum class BuildOn { cpu = 0, gpu = 1 };

/// Inputs of a grid build (acceleration structure).
struct BuildSettings {
  scene::March march = scene::March::tet;
  BuildOn on = BuildOn::cpu;
  grid::RefineSettings refine;
  volume::Ramp density_ramp;
  scene::Emission emission;
  bool anisotropic = true;       ///< the volume's anisotropy grid replaces the medium's anisotropy
  double shutter_seconds = 0.0;  ///< for volumes with velocities
  bool operator==(const BuildSettings&) const = default;
};

/// Returns true if a grid built with `made` can be used for `wanted`. Opacities may differ by a factor of 2.
[[nodiscard]] bool suits(const BuildSettings& made, const BuildSettings& wanted);

struct BuildSeconds {
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
};

/// A built grid or voxel source in main memory, usable by any GL context.
struct Built {
  VolumeAssetPtr volume;
  scene::MarchSourcePtr source;
  BuildSettings settings;
  std::uint64_t active_voxels = 0;
  bool moves = false;  ///< changes while a shutter is open
  // For a grid built on the GPU: known once it has been built.
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t cell_limit = 0;  ///< limit that applied to a tetrahedral grid
  BuildSeconds seconds;

  /// Main memory in bytes, including data shared with others.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Returns true if it can be used for these settings of the same volume. A volume that does not move is the same for
  /// any shutter.
  [[nodiscard]] bool serves(const BuildSettings& wanted) const;
};

/// Low-resolution proxy, shown for a large file until it is read and built.
struct Proxy {
  VolumeInfoPtr volume_info;  ///< with the bounds of the whole volume
  scene::MarchSourcePtr source;
  std::optional<double> density_scale;  ///< suggested for it, if the medium is to use the suggestion
  std::weak_ptr<const void> load;       ///< expires with the job of the load
};

/// Logs that refinement ended at `most` cells: because of max_cells, or because of the memory limits.
void log_limited(const Log& log, std::uint64_t most, std::uint64_t max_cells);

/// Returns true if building with these settings requires the voxels in main memory.
[[nodiscard]] bool needs_values(const VolumeAsset& volume, const BuildSettings& settings);

/// Builds a grid on this thread. Throws Error(cancelled), and everything that its steps throw.
///
/// A GPU build is only planned here; the GPU executes the plan. Volumes that move while the shutter is open are built
/// on the CPU, and this is logged. Grids are coarsened to fit the main and GPU memory limits; if even the coarsest does
/// not fit, Error(out_of_memory) is thrown.
///
/// before: for a moving camera, the plan that is shown now. Its cells are kept where possible to avoid popping. The
/// result has no source if GPU-resident voxels are needed in main memory first.
[[nodiscard]] Built build_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings,
                               Progress& progress, const ResourceLimits& resource_limits = {},
                               const scene::GridPlanPtr& before = nullptr);

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
