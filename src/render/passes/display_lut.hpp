#pragma once

// Display LUTs of hosts, and the C++ side of glsl/display/display_lut.glsl.

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "display/display_lut.glsl"
}  // namespace cumulet::core

namespace cumulet::render {

enum class LutShaper { linear = 0, log2 = 1, srgb = 2 };

/// A lattice of encoded colors, which replaces the tone curve and the encoding.
struct DisplayLut {
  LutShaper shaper = LutShaper::linear;
  glm::vec2 domain{0.0F, 1.0F};   ///< shaped values at the first and at the last point of an axis
  int size = 0;                   ///< points per axis
  std::vector<glm::vec3> points;  ///< size^3, red fastest
};
using DisplayLutPtr = std::shared_ptr<const DisplayLut>;

/// Returns the encoded color of exposed radiance, in [0, 1].
inline glm::vec3 encoded_color(const DisplayLut& lut, const glm::vec3& exposed) {
  glm::vec3 position(0.0F);
  for (int c = 0; c < 3; ++c)
    position[c] = core::cm_lut_position(exposed[c], static_cast<std::uint32_t>(lut.shaper), lut.domain);
  const core::CmLutCell cell = core::cm_lut_cell(position, lut.size);
  glm::vec3 color(0.0F);
  for (int i = 0; i < 4; ++i) {
    const glm::ivec3& point = cell.points[i];
    const int at = (point.z * lut.size + point.y) * lut.size + point.x;
    color += cell.weights[i] * lut.points[static_cast<std::size_t>(at)];
  }
  return glm::clamp(color, 0.0F, 1.0F);
}

}  // namespace cumulet::render
