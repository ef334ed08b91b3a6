#pragma once

// glsl/punctual.glsl as C++, and a glTF light as its record: the raster pass and the path tracer take the same.

#include <algorithm>
#include <cmath>

#include "base/shared_code.hpp"
#include "surface/scene.hpp"

namespace cumulet::core {
#include "punctual.glsl"
}  // namespace cumulet::core

namespace cumulet::light {

/// origin: what positions count from.
inline core::CmLight lamp_record(const surface::PunctualLight& light, const glm::dvec3& origin) {
  using Kind = surface::PunctualLight::Kind;
  core::CmLight result{};
  result.position = glm::vec4(glm::dvec3(light.position) - origin, light.kind == Kind::directional ? 0.0 : 1.0);
  result.direction = glm::vec4(light.direction, light.range);
  result.intensity = glm::vec4(light.intensity, 0.0F);
  result.cone = glm::vec4(0.0F, 1.0F, 0.0F, 0.0F);
  if (light.kind == Kind::spot) {
    const float outer = std::cos(light.outer_cone);
    const float scale = 1.0F / std::max(0.001F, std::cos(light.inner_cone) - outer);
    result.cone = glm::vec4(scale, -outer * scale, 0.0F, 0.0F);
  }
  return result;
}

}  // namespace cumulet::light
