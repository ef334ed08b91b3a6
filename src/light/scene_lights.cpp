#include "light/scene_lights.hpp"

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

double flux_of(const surface::PunctualLight& analytic_light, double cross_section) {
  using Kind = surface::PunctualLight::Kind;
  const double solid_angle =
      2.0 * std::numbers::pi *
      (analytic_light.kind == Kind::spot ? 1.0 - std::cos(double{analytic_light.outer_cone}) : 2.0);
  return luminance(glm::dvec3(analytic_light.intensity)) *
         (analytic_light.kind == Kind::directional ? cross_section : solid_angle);
}

}  // namespace

SceneLights scene_lights(std::span<const surface::PunctualLight> analytic_lights, double radius) {
  SceneLights lights;
  lights.cross_section = std::numbers::pi * radius * radius;
  lights.analytic_lights = static_cast<std::uint32_t>(analytic_lights.size());
  for (const surface::PunctualLight& analytic_light : analytic_lights)
    lights.analytic_light_flux += flux_of(analytic_light, lights.cross_section);
  return lights;
}

}  // namespace cumulet::light
