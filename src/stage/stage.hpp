#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/log.hpp"
#include "jobs/jobs.hpp"
#include "scene/snapshot.hpp"
#include "stage/camera_stage.hpp"
#include "stage/model_stage.hpp"
#include "stage/sky_stage.hpp"
#include "stage/stage_host.hpp"
#include "stage/volume_stage.hpp"

namespace cumulet::viewer {

/// Everything that a viewer shows, free of GL: prepares frames, and makes their snapshots. Functions are called under
/// the state lock. Functions that change settings have the contract of those of Viewer with the same name.
class Stage {
 public:
  /// jobs, failures, host: outlive the stage.
  Stage(Jobs& jobs, ReportedFailures& failures, StageHost& host, std::shared_ptr<ResourceLimits> limits, Log log);

  VolumeStage volumes;
  ModelStage models;
  SkyStage sky;
  CameraStage camera;

  void add_instance(std::shared_ptr<Instance> instance) { volumes.add_instance(std::move(instance), ++last_id_); }
  void add_model(std::shared_ptr<ModelInstance> model) { models.add_model(std::move(model), ++last_id_); }
  void rebuild();
  void use_surface_camera(std::size_t index);
  /// Sets the time for which the shutter is open. previews: as in VolumeStage::set_preview().
  void set_sampling(double shutter_seconds, bool previews);
  bool input(const InputEvent& event);
  void frame_all();
  Bounds bounds();

  /// Takes results of workers, and requests others.
  void sync();
  /// Counts changes of settings.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  void note_change() { ++revision_; }
  /// Returns the host's tag of an instance or model; 0 for the viewer's own objects.
  [[nodiscard]] std::uint64_t tag_of(std::uint64_t id) const;

  /// Prepares a frame before uploads. size: of its image, in pixels. traces: it traces paths. displays_newest: whether
  /// the newest grids are displayed.
  void prepare(const glm::uvec2& size, bool traces, const std::function<bool()>& displays_newest);
  /// Returns the current scene; the previous snapshot if nothing changed.
  scene::SnapshotPtr snapshot();

 private:
  // World bounds of each displayed object.
  [[nodiscard]] std::vector<Bounds> boxes() const;
  // World bounds of all of them; nullopt if there are none.
  [[nodiscard]] std::optional<Bounds> box() const;
  // Returns the objects to fit a camera to. The result is valid until something changes.
  [[nodiscard]] std::optional<Subject> subject() const;
  [[nodiscard]] std::vector<double> seen_reach(const glm::dvec3& direction, std::span<const glm::dvec3> normals) const;
  // Origin of scene coordinates.
  [[nodiscard]] glm::dvec3 origin(const std::vector<Bounds>& boxes, const std::optional<scene::Ground>& ground) const;
  // all: result of box().
  [[nodiscard]] std::optional<scene::Ground> ground(const std::optional<Bounds>& all) const;
  // Logs a warning once per scene whose positions lack precision.
  void remark_on_precision();

  StageHost& host_;
  Log log_;
  std::uint64_t last_id_ = 0;  // of instances and models
  std::uint64_t revision_ = 1;
  scene::Snapshot scene_;        // current scene, from which snapshots are made
  scene::SnapshotPtr snapshot_;  // newest
  std::vector<std::weak_ptr<const surface::Scene>> remarked_scenes_;
};

}  // namespace cumulet::viewer
