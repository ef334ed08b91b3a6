#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "assets/instance.hpp"
#include "base/file_path.hpp"
#include "jobs/pose_cache.hpp"
#include "jobs/reported_failures.hpp"
#include "jobs/surface_builder.hpp"
#include "scene/snapshot.hpp"
#include "stage/settings.hpp"
#include "stage/shared_item.hpp"
#include "stage/stage_host.hpp"
#include "surface/scene.hpp"

namespace cumulet::viewer {

/// The viewer's own surfaces, and models. Functions are called under the state lock. Functions that change settings
/// have the contract of those of Viewer with the same name.
class ModelStage {
 public:
  /// surfaces, poses, failures, host: outlive the stage.
  ModelStage(SurfaceBuilder& surfaces, PoseCache& poses, ReportedFailures& failures, StageHost& host)
      : surfaces_(surfaces), poses_(poses), failures_(failures), host_(host) {}

  /// Reads changed settings, requests poses, and takes results. Returns how many models have changed.
  std::size_t sync();
  /// Poses of models are requested again by the next sync().
  void renew_requests() { poses_due_ = true; }

  void add_model(std::shared_ptr<ModelInstance> model, std::uint64_t id);
  void remove_model(const ModelInstance& model);
  void load_surfaces(const FilePath& path);
  void show_surfaces(scene::ModelSourcePtr surfaces);
  void set_surfaces(SurfaceAssetPtr surfaces);
  void set_surface_settings(const SurfaceSettings& settings);
  [[nodiscard]] const SurfaceSettings& settings() const { return settings_; }
  void set_shutter(double seconds);

  SurfaceAssetPtr surfaces_asset();
  /// Returns a camera of the newest pose of the surfaces. Throws Error(invalid_argument) if it does not exist.
  [[nodiscard]] const surface::SceneCamera& camera(std::size_t index) const;
  /// Returns all displayed models, including the viewer's own surfaces.
  [[nodiscard]] std::vector<scene::Model> models() const;
  [[nodiscard]] bool shows_models() const;
  [[nodiscard]] bool shows_triangles() const;
  /// Appends the world bounds of each displayed object.
  void append_bounds(std::vector<Bounds>& boxes) const;
  /// Returns the host's tag of a model; nullopt if it is not shown.
  [[nodiscard]] std::optional<std::uint64_t> tag_of(std::uint64_t id) const;

 private:
  // A displayed model.
  struct Shown : SharedItem<ModelSettings> {
    using SharedItem::SharedItem;
    std::optional<PoseCache::Request> request;
    std::optional<PoseCache::Request> begun;  // the last request before `request` that was being posed
    scene::ModelSourcePtr source;             // the newest; null: none yet
    scene::ModelSourcePtr previous_source;    // one frame ago; null: same as `source`
    [[nodiscard]] bool is_wanted() const { return settings.surfaces && !settings.hidden; }
    [[nodiscard]] bool is_shown() const { return is_wanted() && source; }
  };
  std::vector<Shown>::iterator find(const ModelInstance& model);
  // Cancels work because other surfaces will be shown. keep_poses: only loads, because a host may set surfaces faster
  // than they are posed.
  void cancel_surfaces(bool keep_poses);
  // Requests the pose of the viewer's own surfaces.
  void pose_surfaces();
  // Takes the poses that are ready, and requests others.
  void take_poses();
  // Request for its pose one frame ago; nullopt: same as now.
  [[nodiscard]] static std::optional<PoseCache::Request> previous_pose(const Shown& shown);
  // Returns the choice with the shutter duration if the surfaces may move. surfaces: null: they are still to be read.
  [[nodiscard]] SurfaceChoice choice_to_pose(SurfaceChoice choice, const SurfaceAssetPtr& surfaces) const;

  SurfaceBuilder& surfaces_;
  PoseCache& poses_;
  ReportedFailures& failures_;
  StageHost& host_;
  SurfaceSettings settings_;
  SurfaceAssetPtr asset_;         // the newest surfaces; null: none
  scene::ModelSourcePtr source_;  // their newest pose; null: none
  std::vector<Shown> shown_;      // in the order in which they were added
  bool poses_due_ = false;        // the requests for poses are outdated
  double shutter_seconds_ = 0.0;
};

}  // namespace cumulet::viewer
