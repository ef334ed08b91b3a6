#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "base/revision.hpp"
#include "base/slot.hpp"
#include "render/grid/grid_builds.hpp"
#include "render/scene/analytic_light_data.hpp"
#include "render/scene/environment_data.hpp"
#include "render/scene/instance_data.hpp"
#include "render/scene/march_data.hpp"
#include "render/scene/model_upload.hpp"
#include "render/scene/parameters.hpp"
#include "render/scene/shared_marches.hpp"
#include "render/scene/trace_inputs.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// The scene's data in one context. They may be older than the newest snapshot; each part is replaced as a whole. All
/// calls that change it need a current context and an active StateGuard.
class GpuScene {
 public:
  /// memories: bricks of GPU-resident volumes. marches: uploaded grids of the share group.
  GpuScene(gl::FunctionsPtr gl, gl::ProgramsPtr programs, gl::Limits limits, DeviceMemoriesPtr memories,
           SharedMarchesPtr marches)
      : gl_(std::move(gl)),
        programs_(std::move(programs)),
        limits_(limits),
        marches_(std::move(marches)),
        heap_(marches_->functions(), {.largest_page = static_cast<std::size_t>(limits.texture_buffer_texels) * 16}),
        grids_(gl_, programs_, limits, std::move(memories)),
        surface_pass_(gl_) {}
  GpuScene(const GpuScene&) = delete;
  GpuScene& operator=(const GpuScene&) = delete;
  /// Without a current context of the share group `gl` must be abandoned.
  ~GpuScene();

  struct Wanted {
    bool raster = true;            // with the data of the surface pass
    std::uint64_t settings = 0;    // changes with every change of a setting, so that failed parts are tried again
    std::int64_t page_texels = 0;  // size of a page of cell data; 0: the driver's limit
    // Memory limit of the scene: volumes that would exceed it are not uploaded.
    std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
  };
  /// Uploads the differences to the snapshot until about the deadline. Throws Error(out_of_memory, unsupported, gl) if
  /// a part cannot be uploaded; the previous data of the part stay. If the data of the surface pass fail, the surfaces
  /// are only path-traced.
  void update(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline);

  /// In the order that Picked::volume indexes.
  [[nodiscard]] const std::vector<scene::Volume>& volumes() const { return present_; }
  /// Null: there is no volume, so no picture can be made.
  [[nodiscard]] const MarchData* data() const { return data_ ? data_->get() : nullptr; }
  /// Number of viewers of the share group that hold data(), this one included.
  [[nodiscard]] std::uint64_t data_viewers() const {
    return data_ ? static_cast<std::uint64_t>(data_->use_count()) - 1 : 0;  // the group has one reference
  }
  /// Revision number; changes when the volume data or the number of volumes changes.
  [[nodiscard]] Revision<MarchData> data_revision() const { return data_revision_; }
  /// Revision number; changes when one of several volumes moves.
  [[nodiscard]] Revision<InstanceData> instances_revision() const { return instances_revision_; }
  /// Revision number; changes when paths hit other triangles, when other ones are rasterized, or when a model moves.
  [[nodiscard]] Revision<ModelData> model_revision() const { return model_revision_; }
  /// Revision number; changes with the environment.
  [[nodiscard]] Revision<EnvironmentData> environment_revision() const { return environment_revision_; }
  [[nodiscard]] bool draws_surfaces() const { return static_cast<bool>(raster_); }
  /// Null: there are none.
  [[nodiscard]] const ModelInstances* models() const { return model_instances_.get(); }
  [[nodiscard]] bool uploading_volumes() const { return upload_.has_value(); }
  [[nodiscard]] bool uploading() const { return upload_ || model_upload_ || environment_upload_; }
  /// Fraction of the current upload or build that is done, 0 to 1; 1 if there is none.
  [[nodiscard]] double progress() const;
  /// Time that the last or current upload took, if it includes this source, in seconds.
  [[nodiscard]] std::optional<double> upload_seconds(const scene::MarchSourcePtr& of) const;
  /// Including memory that other viewers use, too.
  [[nodiscard]] std::uint64_t data_bytes() const { return data_ ? (*data_)->bytes() : 0; }
  /// The part of other_bytes() that can be freed when volumes arrive: grid builds in progress, and free space of the
  /// heap's pages.
  [[nodiscard]] std::uint64_t passing_bytes() const { return grids_.bytes() + heap_.free_bytes(); }
  /// Cell counts of a tetrahedral grid; null: it is not uploaded.
  [[nodiscard]] const MarchData::Cells* cells(const scene::MarchSourcePtr& of) const {
    return data_ && of ? (*data_)->cells(*of) : nullptr;
  }
  /// GL memory of everything but the volumes: surfaces, their raster data, environment, instances, builds and free
  /// space.
  [[nodiscard]] std::uint64_t other_bytes() const;

  /// World-space corners of the bounding boxes of the volumes, eight per volume.
  [[nodiscard]] std::vector<glm::dvec3> corners() const;
  /// World-space diagonal of the bounding box of all volumes; 0: there are none.
  [[nodiscard]] double extent() const;

  /// The snapshot's surroundings if its environment is uploaded. Else the previous ones with the previous environment.
  [[nodiscard]] light::Surroundings surroundings(const scene::Snapshot& snapshot) const;
  /// The snapshot's lights. Their sky radiance is the mean of the environment, uploaded or not.
  [[nodiscard]] light::DistantLights lights(const scene::Snapshot& snapshot) const;
  /// Trace inputs, without the host's depth. traced: paths hit triangles even if there is a surface pass.
  [[nodiscard]] TraceInputs trace_inputs(const scene::Snapshot& snapshot, bool traced);
  /// Transforms of the objects in the previous frame, for motion vectors. Needs data() and the snapshot's view.
  [[nodiscard]] scene::MotionTable motion(const scene::Snapshot& snapshot) const;
  /// Parameters for a picture of this size, with the snapshot's view and lights and the uploaded data. Needs data() and
  /// the snapshot's view.
  [[nodiscard]] PictureParameters parameters(const scene::Snapshot& snapshot, const TraceInputs& trace_inputs,
                                             const core::CmIntegrator& integrator, glm::uvec2 size) const;

 private:
  void update_models(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline);
  void upload_models(const ModelData::Sources& sources, const std::vector<scene::Model>& models, const Wanted& wanted,
                     Deadline deadline);
  void finish_models();
  // The snapshot's models whose sources are uploaded. A model whose newest source is not uploaded keeps its previous
  // one.
  [[nodiscard]] std::vector<scene::Model> present_models(const scene::Snapshot& snapshot) const;
  void make_model_instances(std::vector<scene::Model> models, const Wanted& wanted);
  void show_raster(const ModelData::Sources& of, RasterContents contents);
  // Shows the rasterized models with the same transforms as the path-traced ones.
  void update_raster();
  void drop_data();
  // Frees data_ if no other viewer has them.
  void clear_data();
  // Replaces data_ by those of the upload in progress, which ends it.
  void put_data(MarchDataPtr data, const scene::Snapshot& snapshot);
  // Plans the upload in progress once its grids are built. Returns false if that takes longer.
  bool plan_upload(const Wanted& wanted, Deadline deadline);
  // Frees lattices and the previous data if new data need their memory. complete: another viewer has uploaded them.
  // Returns false if the previous data were freed. Throws Error(out_of_memory) if that does not suffice.
  bool make_room(std::uint64_t bytes, bool complete, const Wanted& wanted, Deadline deadline);
  // Builds the grids that are built on the GPU and are not uploaded. Returns whether all are built.
  bool build_grids(const MarchUpload::Sources& of, std::uint64_t max_bytes, Deadline deadline);
  void require_room(std::uint64_t bytes, std::uint64_t max_bytes) const;
  void update_environment(const light::Surroundings& surroundings, const Wanted& wanted, Deadline deadline);
  // Sets present_: the snapshot's volumes whose data are uploaded. A volume whose newest data are missing keeps its
  // previous ones. If there are none, those of the last upload.
  void find_present(const scene::Snapshot& snapshot);
  // True if a model moves while the shutter is open.
  [[nodiscard]] bool models_move() const;
  void update_instances(const scene::Snapshot& snapshot, const Wanted& wanted);
  [[nodiscard]] light::Lit ball_of(const scene::Volume& volume) const;
  // The mean over rays through the bounding sphere of all volumes. Each volume counts by its fraction of the sphere's
  // cross section.
  [[nodiscard]] double optical_depth() const;
  // Bounding spheres of all volumes and of all models; radius 0 if there are none.
  [[nodiscard]] std::array<light::Lit, 2> lit() const;
  void update_analytic_lights(const scene::Snapshot& snapshot, const Wanted& wanted);
  // Surroundings with the uploaded environment, or if none is uploaded yet, with the snapshot's.
  [[nodiscard]] light::Surroundings sky_surroundings(const scene::Snapshot& snapshot) const;
  void update_data(const MarchUpload::Sources& sources, const scene::Snapshot& snapshot, const Wanted& wanted,
                   Deadline deadline);
  // The volumes of the last upload, relative to the snapshot's origin.
  [[nodiscard]] std::vector<scene::Volume> came_with_data(const scene::Snapshot& snapshot) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  SharedMarchesPtr marches_;
  gl::WordHeap heap_;  // its pages may outlive the viewer, with grids that others use
  GridBuilds grids_;   // of volumes that are being uploaded
  // An upload in progress, and the settings at its start.
  struct VolumeUnderWay {
    MarchUpload::Sources of;
    std::vector<scene::Volume> volumes;  // volumes at its start
    glm::dvec3 origin{0.0};              // of their coordinates
    std::uint64_t settings = 0;
    SharedMarches::Wait wait{};                   // for another viewer that uploads the same...
    SharedMarches::InProgressPtr announcement{};  // ...or for which others wait
    std::unique_ptr<MarchUpload> work{};
  };
  Slot<MarchDataPtr, MarchUpload::Sources> data_;
  std::vector<scene::Volume> data_of_;  // volumes of the last upload
  glm::dvec3 data_origin_{0.0};         // of their coordinates
  Revision<MarchData> data_revision_;
  std::optional<VolumeUnderWay> upload_;  // the next data_
  struct Took {
    MarchUpload::Sources of;
    double seconds = 0.0;
  };
  Took took_;                           // the newest upload
  std::vector<scene::Volume> present_;  // the snapshot's volumes that have data
  struct ModelsUnderWay {
    ModelData::Sources of;
    std::vector<scene::Model> models;  // models at its start
    std::uint64_t settings = 0;
    ModelParts parts = ModelParts::both;
    std::unique_ptr<ModelUpload> work;
  };
  Revision<ModelData> model_revision_;
  Slot<ModelDataPtr, ModelData::Sources> model_;
  std::vector<scene::Model> models_of_;  // models of the last upload
  struct ModelInstancesOf {
    std::vector<scene::Model> models;
    ModelDataPtr data;
    bool operator==(const ModelInstancesOf&) const = default;
  };
  Slot<ModelInstances, ModelInstancesOf> model_instances_;  // if there are any
  Slot<RasterContents, ModelData::Sources> raster_;         // if it is needed
  SurfaceRaster surface_pass_;                              // draws raster_
  std::optional<ModelsUnderWay> model_upload_;              // the next model_ and raster_
  struct EnvironmentUnderWay {
    light::EnvironmentPtr of;
    std::uint64_t settings = 0;
    std::unique_ptr<EnvironmentUpload> work;
  };
  Slot<EnvironmentData, light::EnvironmentPtr> environment_;
  light::Surroundings surroundings_;  // with the uploaded environment
  std::optional<EnvironmentUnderWay> environment_upload_;
  Revision<EnvironmentData> environment_revision_;
  struct InstancesOf {
    std::vector<scene::Volume> volumes;
    Revision<MarchData> data;
    bool operator==(const InstancesOf&) const = default;
  };
  Slot<InstanceData, InstancesOf>
      instances_;  // if there are several volumes, a holdout, a clip, or anything that moves
  Revision<InstanceData> instances_revision_;
  struct AnalyticLightsOf {
    scene::Part<light::AnalyticLights> host;
    std::vector<scene::Model> models;  // uploaded ones
    std::array<light::Lit, 2> lit;
    bool operator==(const AnalyticLightsOf&) const = default;
  };
  Slot<AnalyticLightData, AnalyticLightsOf> analytic_lights_;  // for paths that hit the models, if there are any...
  Slot<AnalyticLightData, AnalyticLightsOf>
      host_analytic_lights_;  // ...and for paths that do not, only if there are models
};

}  // namespace cumulet::render
