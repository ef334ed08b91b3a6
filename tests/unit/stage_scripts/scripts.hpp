#pragma once

// Scripts of stage_record_test, and their volumes, files and surfaces.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "support/stage_recorder.hpp"
#include "support/surfaces.hpp"
#include "support/volumes.hpp"

namespace cumulet::test {

struct StageScript {
  const char* name;  ///< of the script and its record
  void (*run)(StageRecorder& recorder);
};

inline void PrintTo(const StageScript& script, std::ostream* out) { *out << script.name; }

using InstancePtr = std::shared_ptr<viewer::Instance>;
using SequencePtr = std::shared_ptr<viewer::Sequence>;

std::vector<StageScript> volume_scripts();
std::vector<StageScript> instance_scripts();
std::vector<StageScript> limit_scripts();
std::vector<StageScript> sequence_scripts();
std::vector<StageScript> dynamic_volume_scripts();
std::vector<StageScript> surface_scripts();
std::vector<StageScript> light_scripts();
std::vector<StageScript> camera_scripts();
std::vector<StageScript> error_scripts();

// ---- steps ----

void set_grid(StageRecorder& r, const std::string& name, const viewer::GridSettings& settings);
void add(StageRecorder& r, const std::string& name, const InstancePtr& instance);
void remove(StageRecorder& r, const std::string& name, const InstancePtr& instance);
/// Changes the settings of an instance, waits and writes a frame.
void edit(StageRecorder& r, const std::string& name, const InstancePtr& instance,
          const std::function<void(viewer::InstanceSettings&)>& change);
/// Frames that are read from these files.
SequencePtr sequence_of(const std::vector<std::string>& paths, std::uint64_t memory_bytes = std::uint64_t{1} << 32U,
                        bool suggested = false);
void set_sequence(StageRecorder& r, const SequencePtr& sequence);
void simulate_display(StageRecorder& r, bool displays);

// ---- messages at which jobs can be held ----

inline constexpr const char* negative_voxel = "negative voxel";         ///< loads of write_slow_ball()
inline constexpr const char* limited_cells = "stopped the refinement";  ///< builds with limited_grid()
inline constexpr const char* unknown_extension = "rendered without";    ///< loads of write_model(), if it is slow

// ---- volumes in memory ----

/// A lumpy ball.
viewer::VolumeAssetPtr cloud(int side, int seed, const std::string& name = "density");
/// Density, temperature and flame.
viewer::VolumeAssetPtr fire();
/// Density that moves.
viewer::VolumeAssetPtr wind();
/// Density with an anisotropy grid.
viewer::VolumeAssetPtr haze();
viewer::VolumeAssetPtr nothing();

/// The default medium with this density scale.
viewer::Medium medium_of(double density_scale);

/// A grid that is refined to so few cells that its build logs a message.
viewer::GridSettings limited_grid();
/// A grid of all voxels that differ.
viewer::GridSettings fine_grid();
/// A grid that is refined for the views.
viewer::GridSettings adaptive_grid();

glm::dmat4 moved(double x, double y = 0.0, double z = 0.0);
glm::dmat4 scaled(double factor);

// ---- files ----

/// A ball whose size and values differ from frame to frame.
void write_ball(const std::string& path, int frame);
/// A ball with a negative voxel. Its proxy is made before the voxel is reported.
void write_slow_ball(const std::string& path);
/// Balls with these names.
void write_grids(const std::string& path, const std::vector<std::string>& names);
/// Files of a sequence of balls. Returns their paths.
std::vector<std::string> write_clip(const StageRecorder& recorder, int frames);
void write_text(const std::string& path, const std::string& text);
/// A glTF file: a triangle that moves by 4 along x in 2 seconds, and a camera. slow: the load logs a warning.
void write_model(const std::string& path, bool slow = false);
/// An environment.
void write_radiance(const std::string& path, unsigned width);

// ---- surfaces in memory ----

/// A quadrilateral. Its poses pass the gate with the text "pose at TIME.".
class GatedScene : public StillScene {
 public:
  explicit GatedScene(Gate& gate) : gate_(gate) { add_quad({{{-1, 0, 0}, {1, 0, 0}, {1, 2, 0}, {-1, 2, 0}}}, add({})); }
  [[nodiscard]] surface::Pose pose(double time, std::size_t animation,
                                   const Progress* progress = nullptr) const override;

 private:
  Gate& gate_;
};

/// A quadrilateral that moves along x by 1 per second. Throws at negative times.
class MovingScene : public StillScene {
 public:
  MovingScene() { add_quad({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}, add(diffuse(glm::vec3(0.5F)))); }
  [[nodiscard]] surface::Pose pose(double time, std::size_t animation,
                                   const Progress* progress = nullptr) const override;
  [[nodiscard]] bool may_move(std::size_t /*animation*/) const override { return true; }
  [[nodiscard]] std::optional<surface::PoseEnds> pose_ends(double time, std::size_t animation, double seconds,
                                                           const Progress* progress = nullptr) const override;
};

template <class Scene>
viewer::SurfaceAssetPtr surfaces_of(std::shared_ptr<const Scene> scene) {
  return std::make_shared<const viewer::SurfaceAsset>(std::move(scene), "by hand");
}

}  // namespace cumulet::test
