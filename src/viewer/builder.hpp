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
#include "viewer/volume_asset.hpp"
#include "viewer/worker.hpp"
#include "volume/stand_in.hpp"

namespace cumulet::viewer {

/// A file, what of it is shown, and where it stands.
struct VolumeFile {
  FilePath path;
  volume::GridNames grids;
  glm::dmat4 to_world{1.0};              ///< affine, from the file's own world space
  bool suggested_density_scale = false;  ///< the medium gets the one that is suggested for it
  /// As VolumeFrame has it.
  std::optional<double> temperature_scale = {};
  /// Below which a file has no stand-in; tests have other ones.
  std::uint64_t least_stand_in_bricks = volume::worth_a_stand_in;

  /// Throws what import_frame and VolumeAsset throw.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress) const;
  /// take_stand_in: as import_frame has it, of what stands there.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress,
                                    const std::function<void(volume::StandIn)>& take_stand_in) const;
};

/// What came of it.
struct LoadedVolume {
  VolumeAssetPtr volume;
  std::optional<double> density_scale;  ///< of the medium, from now on
};

/// Who makes the cells of tetrahedra.
enum class BuildOn { cpu = 0, gpu = 1 };

/// What a march is made with.
struct BuildSettings {
  scene::March march = scene::March::tet;
  BuildOn on = BuildOn::cpu;
  grid::RefineSettings refine;
  volume::Ramp density_ramp;
  scene::Emission emission;
  bool anisotropic = true;       ///< an anisotropy of the volume's stands in place of the medium's
  double shutter_seconds = 0.0;  ///< of what moves by its velocity
  bool operator==(const BuildSettings&) const = default;
};

/// Whether grids made with these suit a medium of those: of a factor of opacity between them.
[[nodiscard]] bool suits(const BuildSettings& made, const BuildSettings& wanted);

struct BuildSeconds {
  double load = 0.0;
  double statistics = 0.0;
  double refine = 0.0;
  double records = 0.0;
  double upload = 0.0;
};

/// A march's data in main memory, ready for any context.
struct Built {
  VolumeAssetPtr volume;
  scene::MarchSourcePtr source;
  BuildSettings settings;
  std::uint64_t active_voxels = 0;
  bool moves = false;  ///< while a shutter is open
  // Of a grid that GL builds known once it is there.
  std::uint64_t cells = 0;
  std::uint32_t levels = 0;
  bool limited = false;
  std::uint64_t most_cells = 0;  ///< that it was allowed to have, if it is of tetrahedra
  BuildSeconds seconds;

  /// Main memory, with what others may hold as well.
  [[nodiscard]] std::uint64_t bytes() const;
  /// Whether it does for that of the same volume: what does not move is the same with any shutter.
  [[nodiscard]] bool serves(const BuildSettings& wanted) const;
};

/// What is shown of a large file until it is read and built.
struct StandIn {
  VolumeFactsPtr facts;  ///< bounds are the whole's
  scene::MarchSourcePtr source;
  std::optional<double> density_scale;  ///< that is suggested for it, where the medium is to get one
  std::weak_ptr<const void> load;       ///< expires with the load's job
};

/// Of a grid whose refinement ended at so many cells: max_cells, or what memory takes of these.
void log_limited(const Log& log, std::uint64_t most, std::uint64_t max_cells);

/// Whether nothing can be built of it by these while its voxels are not in main memory.
[[nodiscard]] bool needs_values(const VolumeAsset& volume, const BuildSettings& settings);

/// Of a volume, on this thread. Throws Error(cancelled), and what its parts throw.
/// What GL builds is planned: the job is done once GL can begin. What moves while the shutter is open is built here,
/// which the log is told. Cells are as coarse as the allowance's memory takes, main and GL's; where it does not do for
/// the coarsest, Error(out_of_memory). before: of a camera in motion the plan that is shown, whose cells do not come
/// and go without need.
[[nodiscard]] Built build_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings,
                               Progress& progress, const Allowance& allowance = {},
                               const scene::GridPlanPtr& before = nullptr);

/// Loads volumes and builds what marches need on a thread of its own, one job at a time. The newest wish wins, and none
/// starves: a build under way is finished first, and of loads under way at least every second, so that volumes and
/// settings that change faster than they build are seen as often as they can be. What it holds is bounded: one job
/// under way, one that waits, one result. All calls are safe from any thread.
class Builder {
 public:
  /// notify: called on the worker after a job ended.
  Builder(Log log, std::function<void()> notify, Trace trace = {},
          const AllowancePtr& allowance = std::make_shared<const Allowance>())
      : log_(std::move(log)), notify_(notify), allowance_(allowance), worker_(std::move(notify), trace, allowance) {}

  /// Reads a file; then builds, unless settings are not known yet. Replaces what is under way, as Worker::replace()
  /// does: another file is another subject, and files may take minutes. stand_in: how one is built, as long as settings
  /// are not known, until a large file is there; null: there is none.
  void load(const VolumeFile& file, std::optional<BuildSettings> settings,
            std::optional<BuildSettings> stand_in = std::nullopt);
  /// Builds of this volume, after what is under way. before: as build_grid() has it.
  void build(VolumeAssetPtr volume, const BuildSettings& settings, scene::GridPlanPtr before = nullptr);
  /// Other settings for a load under way. Returns false if there is none: then take what it read, and call build.
  bool configure_load(const std::optional<BuildSettings>& settings);
  void cancel();
  /// Whether a file is being read, or waits to be.
  [[nodiscard]] bool loads() const;
  /// Loads alone: another volume is there.
  void cancel_loads();
  /// Ends all, and nothing is known of it: neither what was read, nor how it ended.
  void forget();
  /// How the last job ended is old news.
  void forget_failure() { worker_.forget_failure(); }

  /// The newest volume that was read, once.
  std::optional<LoadedVolume> take_loaded();
  /// The newest result, once.
  std::optional<Built> take_built();
  /// The stand-in of a load under way, once.
  std::optional<StandIn> take_stand_in();

  /// Whether there is work under way, or a result that nobody took.
  [[nodiscard]] bool busy() const;
  /// Whether there is such a result.
  [[nodiscard]] bool has_result() const;
  [[nodiscard]] Worker::Status status() const { return worker_.status(); }
  /// Until idle, at most until then. Returns whether it is.
  bool wait(std::optional<std::chrono::steady_clock::time_point> until) const { return worker_.wait(until); }

 private:
  // What a load will build: open until the file is read.
  struct Load {
    std::optional<BuildSettings> settings;
    std::optional<BuildSettings> stand_in;
    bool open = true;
  };
  void read(const VolumeFile& file, const std::shared_ptr<Load>& load, Progress& progress);
  void build_stand_in(const VolumeFile& file, volume::StandIn made, const std::shared_ptr<const Load>& load,
                      const Progress& loading);
  // jobs: cancels those that are to be.
  void stop(const std::function<void()>& jobs);
  // Also that which is being built, whose progress is its own: the load's tells how much of the whole is read. mutex_
  // is held.
  void drop_stand_in();
  void build_of(const VolumeAssetPtr& volume, const BuildSettings& settings, double load_seconds, Progress& progress,
                const scene::GridPlanPtr& before = nullptr);

  Log log_;
  std::function<void()> notify_;
  AllowancePtr allowance_;
  mutable std::mutex mutex_;
  std::weak_ptr<Load> load_;               // held by its job
  std::weak_ptr<Progress> stand_in_load_;  // of the stand-in that is being built
  std::optional<StandIn> stand_in_;
  std::optional<LoadedVolume> loaded_;
  std::optional<Built> built_;
  Worker worker_;  // last: its thread uses all of the above
};

}  // namespace cumulet::viewer
