#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "base/revision.hpp"
#include "gl/programs.hpp"
#include "render/gpu_scene.hpp"
#include "render/pace.hpp"
#include "render/upload.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// Whose light a map is of: parallel, from that direction (unit), or from a point.
struct MapLight {
  enum class Kind { parallel, point };
  Kind kind = Kind::parallel;
  glm::dvec3 towards{0.0, 1.0, 0.0};
  glm::dvec3 position{0.0};
  bool operator==(const MapLight&) const = default;
};

/// In the world.
struct MapRequest {
  MapLight light;
  std::uint32_t size = 256;   ///< texels of width and height
  std::uint32_t slices = 32;  ///< at least 2
  bool operator==(const MapRequest&) const = default;
};

/// What of a light comes through all volumes of a scene to points about them, as a 3D texture (glsl/transmittance.comp)
/// of 2 bytes a texel. Made row by row, the last whole one being there meanwhile; of a scene that changes before one is
/// whole, the next is coarser, and of one that rests finer again. Calls but those that tell need the context current
/// and a StateGuard around.
class TransmittanceMap {
 public:
  TransmittanceMap(gl::FunctionsPtr gl, gl::ProgramsPtr programs);
  /// Goes on with it until about the deadline. Throws Error(out_of_memory, gl); what there was stays.
  void advance(const MapRequest& request, const scene::Snapshot& snapshot, GpuScene& scene, Deadline deadline);

  /// The newest whole one; before the first, one texel through which all light comes. Never 0 after advance().
  [[nodiscard]] GLuint texture() const { return shown_.texture.name(); }
  [[nodiscard]] std::uint32_t size() const { return shown_.size; }
  [[nodiscard]] std::uint32_t slices() const { return shown_.slices; }
  /// Of that one, affine: world to texture coordinates; of a point, to the direction from it, in world units.
  [[nodiscard]] const glm::dmat4& to_map() const { return shown_.to_map; }
  /// Of a point: how far from it the first and the last slice are; both 0 of parallel light.
  [[nodiscard]] glm::dvec2 range() const { return shown_.range; }
  /// Whether that is of what was asked for last, as the scene then was, and in full.
  [[nodiscard]] bool is_newest() const { return newest_; }
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct Made {
    gl::Object texture;
    std::uint32_t size = 0;
    std::uint32_t slices = 0;
    glm::dmat4 to_map{1.0};
    glm::dvec2 range{0.0};
  };
  // All that it depends on.
  struct Of {
    MapRequest request;
    glm::dvec3 origin{0.0};  // of the snapshot's places
    std::vector<scene::Volume> volumes;
    Revision<MarchData> data;
    Revision<InstanceData> instances;
    bool operator==(const Of&) const = default;
  };
  struct UnderWay {
    Of of;
    Made made;
    core::CmParameters parameters{};
    glm::dvec2 slices_at{0.0};  // along a ray, of the first and the last
    std::uint32_t row = 0;
  };
  void begin(Of of, const scene::Snapshot& snapshot, GpuScene& scene);
  // One texel through which all light comes.
  void show_clear();
  void collect();
  static Made make(const gl::FunctionsPtr& gl, std::uint32_t size, std::uint32_t slices);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  Flights flights_;
  std::shared_ptr<RoundCost> cost_ = std::make_shared<RoundCost>();
  gl::Object uniforms_;
  Made shown_;
  std::optional<Of> shown_of_;
  std::optional<UnderWay> under_way_;
  std::optional<Of> failed_;  // what last could not be begun
  unsigned coarser_ = 0;      // by this power of two
  bool newest_ = false;
};

}  // namespace cumulet::render
