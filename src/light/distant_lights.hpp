#pragma once

#include <glm/glm.hpp>

namespace cumulet::light {

/// Sun and constant sky.
struct DistantLights {
  glm::dvec3 to_sun{0.0, 1.0, 0.0};  ///< world, unit
  glm::vec3 sun_irradiance{0.0F};    ///< on a plane perpendicular to to_sun
  glm::vec3 sky_radiance{0.0F};      ///< constant over all directions
  double sun_angle_degrees = 0.0;    ///< angular diameter of the sun, 0 to 180; 0: a directional light
  bool operator==(const DistantLights&) const = default;
};

}  // namespace cumulet::light
