#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "base/revision.hpp"
#include "base/slot.hpp"
#include "render/environment_data.hpp"
#include "render/instance_data.hpp"
#include "render/lamp_data.hpp"
#include "render/march_data.hpp"
#include "render/model_upload.hpp"
#include "render/tracer.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// What of a scene is in one context, which may be older than the newest snapshot: each part comes as a whole. All
/// calls that change it need the context current and a StateGuard around.
class GpuScene {
 public:
  /// memories: where volumes' bricks are that are in GL.
  GpuScene(gl::FunctionsPtr gl, gl::ProgramsPtr programs, gl::Limits limits, DeviceMemoriesPtr memories)
      : gl_(std::move(gl)),
        programs_(std::move(programs)),
        limits_(limits),
        heap_(gl_, {.largest_page = static_cast<std::size_t>(limits.texture_buffer_texels) * 16}),
        grids_(gl_, programs_, limits, std::move(memories)),
        surface_pass_(gl_) {}

  struct Wanted {
    bool raster = true;            // the surface pass as well
    std::uint64_t settings = 0;    // another after each change of a setting: what failed is tried again
    std::int64_t page_texels = 0;  // where pages of cell records end; 0: at the driver's limit
    // Of all that is here: no volume is brought beyond that.
    std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max();
  };
  /// Brings what differs from the snapshot, until about the deadline. Throws Error(out_of_memory, unsupported, gl) for
  /// a part that cannot be brought; what there is of it stays.
  /// Where surfaces can be met but not drawn, they are met alone.
  void update(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline);

  /// In the order of what Picked::place counts.
  [[nodiscard]] const std::vector<scene::Volume>& volumes() const { return present_; }
  /// Null: no volume, and no picture.
  [[nodiscard]] const MarchData* data() const { return data_.get(); }
  /// Another with other data, or with more volumes of it, or fewer.
  [[nodiscard]] Revision<MarchData> data_revision() const { return data_revision_; }
  /// Another where volumes stand elsewhere, of which there are several.
  [[nodiscard]] Revision<InstanceData> instances_revision() const { return instances_revision_; }
  /// Another where paths meet other triangles, or others are drawn, or at another place.
  [[nodiscard]] Revision<ModelData> model_revision() const { return model_revision_; }
  /// Another with another environment, or none.
  [[nodiscard]] Revision<EnvironmentData> environment_revision() const { return environment_revision_; }
  [[nodiscard]] bool draws_surfaces() const { return static_cast<bool>(raster_); }
  /// Null: none are here.
  [[nodiscard]] const PlacedModels* models() const { return placed_.get(); }
  [[nodiscard]] bool uploading_volumes() const { return upload_.has_value(); }
  [[nodiscard]] bool uploading() const { return upload_ || model_upload_ || environment_upload_; }
  /// 0 to 1, of what is under way; else 1.
  [[nodiscard]] double progress() const;
  /// Of that volume, if it is the last that came, or is coming.
  [[nodiscard]] std::optional<double> upload_seconds(const scene::MarchSourcePtr& of) const;
  [[nodiscard]] std::uint64_t data_bytes() const { return data_ ? data_->bytes() : 0; }
  /// Of all else that bytes() has, what goes as volumes come: a build under way, and what is free of their pages.
  [[nodiscard]] std::uint64_t passing_bytes() const { return grids_.bytes() + heap_.free_bytes(); }
  /// Of tetrahedra that are here; null: they are not.
  [[nodiscard]] const MarchData::Cells* cells(const scene::MarchSourcePtr& of) const {
    return data_ && of ? data_->cells(*of) : nullptr;
  }
  /// Of surfaces, of what draws them, and of what is kept for more.
  [[nodiscard]] std::uint64_t other_bytes() const;

  /// Eight of the box of each volume that is here, in the world.
  [[nodiscard]] std::vector<glm::dvec3> corners() const;
  /// The diagonal of the world box that holds these; 0: there are none.
  [[nodiscard]] double extent() const;

  /// As the snapshot has it, of the environment that is here.
  [[nodiscard]] light::Surroundings surroundings(const scene::Snapshot& snapshot) const;
  /// The snapshot's, and as their sky the mean of the environment that is there, or is to be.
  [[nodiscard]] light::DistantLights lights(const scene::Snapshot& snapshot) const;
  /// What paths end at, but for the host's depth. traced: they meet triangles, if there is a surface pass, too.
  [[nodiscard]] Obstacles obstacles(const scene::Snapshot& snapshot, bool traced);
  /// Where what is here was a frame ago. Only with data and view.
  [[nodiscard]] scene::MotionTable motion(const scene::Snapshot& snapshot) const;
  /// Of a picture of that size of what is here, as the snapshot has it seen and lit. Only with data and view.
  [[nodiscard]] PictureParameters parameters(const scene::Snapshot& snapshot, const Obstacles& obstacles,
                                             const core::CmIntegrator& integrator, glm::uvec2 size) const;

 private:
  void update_models(const scene::Snapshot& snapshot, const Wanted& wanted, Deadline deadline);
  void upload_models(const ModelData::Sources& sources, const std::vector<scene::Model>& models, const Wanted& wanted,
                     Deadline deadline);
  void finish_models();
  // Those of the snapshot whose sources are here; one whose newest is not with the one that it had.
  [[nodiscard]] std::vector<scene::Model> present_models(const scene::Snapshot& snapshot) const;
  void place_models(std::vector<scene::Model> models, const Wanted& wanted);
  void show_raster(const ModelData::Sources& of, RasterContents contents);
  // What is drawn stands where what paths meet does.
  void place_raster();
  void drop_data();
  // Of those that GL builds and that are not here. Returns whether all are built.
  bool build_grids(const MarchUpload::Sources& of, std::uint64_t most_bytes, Deadline deadline);
  void require_room(std::uint64_t bytes, std::uint64_t most_bytes) const;
  void update_environment(const light::Surroundings& surroundings, const Wanted& wanted, Deadline deadline);
  // Those of the snapshot whose data are here; one whose newest are not with those that came. Of none: what came.
  void find_present(const scene::Snapshot& snapshot);
  // While the shutter is open.
  [[nodiscard]] bool models_move() const;
  void update_instances(const scene::Snapshot& snapshot, const Wanted& wanted);
  [[nodiscard]] light::Lit ball_of(const scene::Volume& volume) const;
  // The mean over rays through the ball of all volumes that are here: of each, by how much of that it takes.
  [[nodiscard]] double optical_depth() const;
  // Of the volumes and the model that are here, or of nothing.
  [[nodiscard]] std::array<light::Lit, 2> lit() const;
  void update_lamps(const scene::Snapshot& snapshot, const Wanted& wanted);
  // By the environment that is there, or is to be.
  [[nodiscard]] light::Surroundings sky_surroundings(const scene::Snapshot& snapshot) const;
  void update_data(const MarchUpload::Sources& sources, const scene::Snapshot& snapshot, const Wanted& wanted,
                   Deadline deadline);
  // Those that came with the data, from the snapshot's origin.
  [[nodiscard]] std::vector<scene::Volume> came_with_data(const scene::Snapshot& snapshot) const;

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  gl::Limits limits_;
  gl::WordHeap heap_;
  GridBuilds grids_;  // of volumes under way
  // Under way, and with which settings it was begun.
  struct VolumeUnderWay {
    MarchUpload::Sources of;
    std::vector<scene::Volume> volumes;  // with those
    glm::dvec3 origin{0.0};              // that they count from
    std::uint64_t settings = 0;
    std::unique_ptr<MarchUpload> work;
  };
  Slot<MarchData, MarchUpload::Sources> data_;
  std::vector<scene::Volume> data_of_;  // that it came with
  glm::dvec3 data_origin_{0.0};         // that these count from
  Revision<MarchData> data_revision_;
  std::optional<VolumeUnderWay> upload_;  // of what data will be
  struct Took {
    MarchUpload::Sources of;
    double seconds = 0.0;
  };
  Took took_;                           // the newest upload
  std::vector<scene::Volume> present_;  // what of the snapshot's is in data
  struct ModelsUnderWay {
    ModelData::Sources of;
    std::vector<scene::Model> models;  // with those
    std::uint64_t settings = 0;
    ModelParts parts = ModelParts::both;
    std::unique_ptr<ModelUpload> work;
  };
  Revision<ModelData> model_revision_;
  Slot<ModelDataPtr, ModelData::Sources> model_;
  std::vector<scene::Model> models_of_;  // that it came with
  struct PlacedOf {
    std::vector<scene::Model> models;
    ModelDataPtr data;
    bool operator==(const PlacedOf&) const = default;
  };
  Slot<PlacedModels, PlacedOf> placed_;              // where there are any
  Slot<RasterContents, ModelData::Sources> raster_;  // where it is of use
  SurfaceRaster surface_pass_;                       // shows that
  std::optional<ModelsUnderWay> model_upload_;       // of what both will be
  struct EnvironmentUnderWay {
    light::EnvironmentPtr of;
    std::uint64_t settings = 0;
    std::unique_ptr<EnvironmentUpload> work;
  };
  Slot<EnvironmentData, light::EnvironmentPtr> environment_;
  light::Surroundings surroundings_;  // by that
  std::optional<EnvironmentUnderWay> environment_upload_;
  Revision<EnvironmentData> environment_revision_;
  struct InstancesOf {
    std::vector<scene::Volume> volumes;
    Revision<MarchData> data;
    bool operator==(const InstancesOf&) const = default;
  };
  Slot<InstanceData, InstancesOf> instances_;  // where there are several volumes, or anything moves
  Revision<InstanceData> instances_revision_;
  struct LampsOf {
    scene::Part<light::Lamps> host;
    std::vector<scene::Model> models;  // that are here
    std::array<light::Lit, 2> lit;
    bool operator==(const LampsOf&) const = default;
  };
  Slot<LampData, LampsOf> lamps_;       // of paths that meet the model, if there is one...
  Slot<LampData, LampsOf> host_lamps_;  // ...and of those that do not, only then
};

}  // namespace cumulet::render
