#pragma once

// For tests: a record of the work that a viewer requests.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace cumulet {
class FilePath;
}

namespace cumulet::light {
struct Day;
}

namespace cumulet::scene {
struct GridPlan;
}

namespace cumulet::viewer {

class Live;
class SurfaceAsset;
class VolumeAsset;
struct BuildSettings;
struct FrameRequest;
struct GridRequest;
struct PoseRequest;
struct SurfaceChoice;
struct VolumeFile;

/// Receives the requests that a viewer sends to its workers, in order, on the thread that sends them. A function must
/// not call the viewer or a worker, because the worker's lock may be held. For tests.
class JobLog {
 public:
  /// Identifies a player: 0 is the viewer's own, others belong to instances.
  using Player = std::uint64_t;

  virtual ~JobLog() = default;

  // Builder
  virtual void load_volume(const VolumeFile& file, const std::optional<BuildSettings>& settings,
                           const std::optional<BuildSettings>& proxy) = 0;
  /// A running load will use these settings.
  virtual void configure_volume(const std::optional<BuildSettings>& settings) = 0;
  virtual void build_volume(const std::shared_ptr<const VolumeAsset>& volume, const BuildSettings& settings,
                            const std::shared_ptr<const scene::GridPlan>& before) = 0;
  // SurfaceBuilder
  virtual void load_surfaces(const FilePath& path, const SurfaceChoice& choice) = 0;
  /// A running load will use this choice.
  virtual void configure_surfaces(const SurfaceChoice& choice) = 0;
  virtual void pose_surfaces(const std::shared_ptr<const SurfaceAsset>& asset, const SurfaceChoice& choice) = 0;
  // EnvironmentBuilder
  virtual void load_environment(const FilePath& path) = 0;
  virtual void make_sky(const light::Day& day) = 0;
  // GridCache and PoseCache
  virtual void request(const std::vector<GridRequest>& requests) = 0;
  virtual void request(const std::vector<PoseRequest>& requests) = 0;
  // FrameCache
  virtual void request(Player player, const FrameRequest& request) = 0;
  // LiveBuilder
  virtual void follow_states(Player player, const std::shared_ptr<Live>& live,
                             const std::optional<BuildSettings>& settings) = 0;
  virtual void configure_states(Player player, const std::optional<BuildSettings>& settings) = 0;
  /// A call without arguments, for example "cancel". worker: description of the worker.
  virtual void call(const char* worker, Player player, const char* function) = 0;

 protected:
  JobLog() = default;
  JobLog(const JobLog&) = default;
  JobLog& operator=(const JobLog&) = default;
};

}  // namespace cumulet::viewer
