#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "base/revision.hpp"
#include "gl/programs.hpp"
#include "render/pacing/pace.hpp"
#include "render/pacing/upload.hpp"
#include "render/scene/gpu_scene.hpp"
#include "scene/snapshot.hpp"

namespace cumulet::render {

/// The light of a map: parallel light from a unit direction, or a point light.
struct MapLight {
  enum class Kind { parallel, point };
  Kind kind = Kind::parallel;
  glm::dvec3 towards{0.0, 1.0, 0.0};
  glm::dvec3 position{0.0};
  bool operator==(const MapLight&) const = default;
};

/// A map to make; positions are in world space.
struct MapRequest {
  MapLight light;
  std::uint32_t size = 256;   ///< texels of width and height
  std::uint32_t slices = 32;  ///< at least 2
  bool operator==(const MapRequest&) const = default;
};

/// Transmittance of all volumes of a scene between a light and points around them, as a 3D texture
/// (glsl/features/transmittance.comp) of 2 bytes per texel. It is rendered row by row, while the last complete map
/// stays available. If the scene changes before a map is complete, the next is coarser; once the scene rests, it
/// becomes finer again. All calls except queries need a current context and an active StateGuard.
class TransmittanceMap {
 public:
  TransmittanceMap(gl::FunctionsPtr gl, gl::ProgramsPtr programs);
  /// Continues the map until about the deadline. Throws Error(out_of_memory, gl) and keeps the previous map.
  void advance(const MapRequest& request, const scene::Snapshot& snapshot, GpuScene& scene, Deadline deadline);

  /// The newest complete map; before the first, one texel of transmittance 1. Never 0 after advance().
  [[nodiscard]] GLuint texture() const { return shown_.texture.name(); }
  [[nodiscard]] std::uint32_t size() const { return shown_.size; }
  [[nodiscard]] std::uint32_t slices() const { return shown_.slices; }
  /// Affine transform of that map. Parallel light: world to texture coordinates. Point light: world to the vector from
  /// the light, in world units.
  [[nodiscard]] const glm::dmat4& to_map() const { return shown_.to_map; }
  /// Point light: distances of the first and last slice from it. Parallel light: both are 0.
  [[nodiscard]] glm::dvec2 range() const { return shown_.range; }
  /// True if that map fits the last request and the scene at that time, and has the full size.
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
  // All inputs of a map.
  struct Of {
    MapRequest request;
    glm::dvec3 origin{0.0};  // of the snapshot's coordinates
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
  // Shows one texel of transmittance 1.
  void show_clear();
  void collect();
  static Made make(const gl::FunctionsPtr& gl, std::uint32_t size, std::uint32_t slices);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  InFlightDispatches dispatches_in_flight_;
  std::shared_ptr<RoundCost> cost_ = std::make_shared<RoundCost>();
  gl::Object uniforms_;
  Made shown_;
  std::optional<Of> shown_of_;
  std::optional<UnderWay> under_way_;
  std::optional<Of> failed_;  // inputs that could not be started last
  unsigned coarser_ = 0;      // log2 of the divisor of the size
  bool newest_ = false;
};

}  // namespace cumulet::render
