#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/build_grid.hpp"

namespace cumulet::viewer {

/// The grids of one volume that are in use, so that viewers with the same settings build and hold one. It keeps no grid
/// alive. All calls are thread-safe.
class SharedGrids {
 public:
  /// Returns the grid that build_grid() would make: one that exists, or a new one. If another thread is building it,
  /// waits for that and reports its progress. If that build is cancelled or fails, a waiting thread builds the grid
  /// again: no caller has to go on working for others. Messages of the build go to the log of every caller.
  [[nodiscard]] Built get(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings,
                          Progress& progress, const ResourceLimits& resource_limits);
  /// Later calls of get() build again. Grids in use stay.
  void forget();

 private:
  using Lines = std::vector<std::pair<LogLevel, std::string>>;
  struct Made {
    Built built;  // without volume and source
    std::weak_ptr<const scene::MarchSource> source;
    Lines lines;  // messages of the build
  };
  // The grids with the same settings. They differ in their number of cells, because of memory limits.
  struct Entry {
    BuildSettings settings;
    const Progress* building = nullptr;  // of the thread that is building; null: none
    std::vector<Made> made;
  };
  // mutex_ must be held for all of these.
  std::shared_ptr<Entry> entry_of(const BuildSettings& settings);
  // Returns a grid that the limits allow; nullopt: there is none. lines: receives its messages.
  static std::optional<Built> find(const Entry& entry, const VolumeAssetPtr& volume, const BuildSettings& settings,
                                   const ResourceLimits& resource_limits, Lines& lines);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Entry>> entries_;
};

/// Returns the volume's grid for these settings, which other users of the volume may share. A grid that depends on the
/// one shown before, or on voxels in GL memory, is built for this caller alone. Arguments: as for build_grid().
[[nodiscard]] Built shared_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings,
                                Progress& progress, const ResourceLimits& resource_limits = {},
                                const scene::GridPlanPtr& before = nullptr);

/// SharedGrids::forget() of a volume; null: nothing.
void forget_grids(const VolumeAssetPtr& volume);

}  // namespace cumulet::viewer
