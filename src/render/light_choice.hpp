#pragma once

#include <glm/glm.hpp>

#include "render/parameters.hpp"
#include "render/surface_data.hpp"

namespace cumulet::render {

/// The lights that are far away.
struct DistantLights {
  glm::dvec3 to_sun{0.0, 1.0, 0.0};  // world, unit
  glm::vec3 sun_irradiance{0.0F};
  glm::vec3 sky_radiance{0.0F};
};

/// These, and with which probabilities next-event estimation looks for each kind of light there is. surfaces: those
/// that paths meet, or null. glow: whether the medium's own light falls on surfaces.
core::CmLights light_parameters(const DistantLights& lights, const SurfaceData* surfaces, bool glow);

}  // namespace cumulet::render
