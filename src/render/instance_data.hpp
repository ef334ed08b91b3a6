#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "gl/objects.hpp"
#include "scene/instances.hpp"

namespace cumulet::render {

/// Several volumes, as paths find them, on the GPU: what each is of is MarchData's. All calls need the context current
/// and a StateGuard around.
class InstanceData {
 public:
  /// origin: where the scene's frame begins, in the world. Throws as make_instances does, and Error(unsupported) for
  /// more than the driver binds.
  static InstanceData make(const gl::FunctionsPtr& gl, const gl::Limits& limits,
                           std::span<const scene::Instance> instances, const glm::dvec3& origin);

  void bind(const gl::Functions& gl) const;
  /// What rays are told of their frame: the world, counted from its origin.
  [[nodiscard]] const core::CmSpace& space() const { return space_; }
  [[nodiscard]] const glm::dvec3& origin() const { return origin_; }
  /// Of the first, but as strong in what decides which programs and lights there are as any is.
  [[nodiscard]] const core::CmMedium& medium() const { return medium_; }
  /// Of all of them, as scene::GlowSum has both.
  [[nodiscard]] double glow_power() const { return glow_power_; }
  [[nodiscard]] double glow_length() const { return glow_length_; }
  /// Whether any does while the shutter is open.
  [[nodiscard]] bool moves() const { return moves_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  gl::Object records_;
  gl::Object nodes_;
  core::CmSpace space_{};
  core::CmMedium medium_{};
  glm::dvec3 origin_{0.0};
  double glow_power_ = 0.0;
  double glow_length_ = 0.0;
  bool moves_ = false;
  std::uint64_t bytes_ = 0;
};

}  // namespace cumulet::render
