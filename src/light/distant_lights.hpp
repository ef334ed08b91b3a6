#pragma once

#include <glm/glm.hpp>

namespace cumulet::light {

/// The lights that are far away.
struct DistantLights {
  glm::dvec3 to_sun{0.0, 1.0, 0.0};  ///< world, unit
  glm::vec3 sun_irradiance{0.0F};    ///< on a plane that faces it
  glm::vec3 sky_radiance{0.0F};      ///< the same from everywhere
  double sun_angle_degrees = 0.0;    ///< that its disc takes, 0 to 180; 0: a direction
  bool operator==(const DistantLights&) const = default;
};

}  // namespace cumulet::light
