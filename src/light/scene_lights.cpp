#include "light/scene_lights.hpp"

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

double flux_of(const surface::PunctualLight& lamp, double cross_section) {
  using Kind = surface::PunctualLight::Kind;
  const double solid_angle =
      2.0 * std::numbers::pi * (lamp.kind == Kind::spot ? 1.0 - std::cos(double{lamp.outer_cone}) : 2.0);
  return luminance(glm::dvec3(lamp.intensity)) * (lamp.kind == Kind::directional ? cross_section : solid_angle);
}

}  // namespace

SceneLights scene_lights(const surface::Pose& pose, const EmitterTable& triangles) {
  SceneLights lights;
  const double radius = 0.5 * glm::length(pose.high - pose.low);
  lights.cross_section = std::numbers::pi * radius * radius;
  lights.lamps = static_cast<std::uint32_t>(pose.lights.size());
  for (const surface::PunctualLight& lamp : pose.lights) lights.lamp_flux += flux_of(lamp, lights.cross_section);
  lights.triangles = static_cast<std::uint32_t>(triangles.entries.size());
  lights.triangle_flux = triangles.flux;
  return lights;
}

}  // namespace cumulet::light
