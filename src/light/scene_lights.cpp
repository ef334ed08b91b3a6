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

SceneLights scene_lights(std::span<const surface::PunctualLight> lamps, double radius) {
  SceneLights lights;
  lights.cross_section = std::numbers::pi * radius * radius;
  lights.lamps = static_cast<std::uint32_t>(lamps.size());
  for (const surface::PunctualLight& lamp : lamps) lights.lamp_flux += flux_of(lamp, lights.cross_section);
  return lights;
}

}  // namespace cumulet::light
