#pragma once

#include <glm/glm.hpp>

namespace cumulet::viewer {

/// An axis-aligned box in world space.
struct Bounds {
  glm::dvec3 min{0.0};
  glm::dvec3 max{0.0};
};

}  // namespace cumulet::viewer
