#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "gl/objects.hpp"
#include "scene/instances.hpp"

namespace cumulet::render {

/// Table and BVH of several volume instances on the GPU. Their grids are in MarchData. All calls need a current context
/// and an active StateGuard.
class InstanceData {
 public:
  /// origin: world position of the origin of the scene's frame. Throws as make_instances() does, and Error(unsupported)
  /// if the table exceeds a limit of the driver.
  static InstanceData make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                           std::span<const scene::Instance> instances, const glm::dvec3& origin);

  void bind(const gl::Functions& gl) const;
  /// The frame of rays: the world, relative to its origin.
  [[nodiscard]] const core::CmSpace& space() const { return space_; }
  [[nodiscard]] const glm::dvec3& origin() const { return origin_; }
  /// Medium of the first instance. Properties that decide which programs and lights are needed are the maximum over all
  /// instances.
  [[nodiscard]] const core::CmMedium& medium() const { return medium_; }
  /// Total emitted power and length scale of all instances, as in scene::EmissiveSum.
  [[nodiscard]] double emissive_power() const { return emissive_power_; }
  [[nodiscard]] double emissive_length() const { return emissive_length_; }
  /// True if any instance moves while the shutter is open.
  [[nodiscard]] bool moves() const { return moves_; }
  /// True if any instance is clipped.
  [[nodiscard]] bool clips() const { return clips_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  gl::Object records_;
  gl::Object nodes_;
  core::CmSpace space_{};
  core::CmMedium medium_{};
  glm::dvec3 origin_{0.0};
  double emissive_power_ = 0.0;
  double emissive_length_ = 0.0;
  bool moves_ = false;
  bool clips_ = false;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
