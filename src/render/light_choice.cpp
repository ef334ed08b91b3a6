#include "render/light_choice.hpp"

#include <numbers>

#include "render/luminance.hpp"

namespace cumulet::render {

namespace {

// Of estimates; half of the sky's share of the light: paths that escape sample it as well.
float sky_probability(float sun, float sky, bool local) {
  if (sun > 0.0F) return 0.5F * sky / (sky + sun);
  if (!(sky > 0.0F)) return 0.0F;
  return local ? 0.25F : 1.0F;
}

}  // namespace

core::CmLights light_parameters(const DistantLights& lights, const SurfaceData* surfaces, bool glow) {
  const auto sun = static_cast<float>(luminance(glm::dvec3(lights.sun_irradiance)));
  const float sky = 4.0F * std::numbers::pi_v<float> * static_cast<float>(luminance(glm::dvec3(lights.sky_radiance)));
  const bool local = surfaces != nullptr && (surfaces->lamps() || surfaces->emitters());
  core::CmLights p{};
  p.sun_direction = glm::vec3(lights.to_sun);
  p.any = sun + sky > 0.0F || local ? 1U : 0U;
  p.sky_probability = sky_probability(sun, sky, local);
  p.sun_irradiance = lights.sun_irradiance;
  p.emitter_probability = surfaces != nullptr ? static_cast<float>(surfaces->emitter_share(sun)) : 0.0F;
  p.sky_radiance = lights.sky_radiance;
  p.glow_probability = glow ? 0.5F : 0.0F;
  return p;
}

}  // namespace cumulet::render
