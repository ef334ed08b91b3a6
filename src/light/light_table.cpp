#include "light/light_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

// Half of the sky's fraction of the light: escaping paths sample the sky as well.
double sky_probability(double sun, double sky, bool near) {
  if (sun > 0.0) return 0.5 * sky / (sky + sun);
  if (!(sky > 0.0)) return 0.0;
  return near ? 0.25 : 1.0;
}

// Escaping paths sample it as well, but rarely hit a sun in the image.
double environment_probability(double sun, double environment, bool near) {
  if (sun > 0.0 && environment > 0.0) return std::clamp(environment / (environment + sun), 0.2, 0.8);
  if (!(environment > 0.0)) return 0.0;
  return near ? 0.5 : 1.0;
}

// Triangles' fraction of all light samples that are not for the sky: by flux, but 0.2 to 0.8 if there are other lights.
double triangle_share(const SceneLights& scene, double sun) {
  if (scene.triangles == 0) return 0.0;
  const double others = scene.analytic_light_flux + sun * scene.cross_section;
  return others > 0.0 ? std::clamp(scene.triangle_flux / (scene.triangle_flux + others), 0.2, 0.8) : 1.0;
}

// The sun's fraction of the samples for sun and lights: by irradiance, but 0.2 to 0.8 if there are lights.
double sun_share(const SceneLights& scene, double sun) {
  if (!(sun > 0.0)) return 0.0;
  return scene.analytic_lights > 0 ? std::clamp(sun / (sun + scene.analytic_lights_arrive), 0.2, 0.8) : 1.0;
}

// Probability of sampling emissive cells: by their irradiance at the rim of the medium's box, compared with that of all
// other lights.
double cell_probability(const MediumLight& medium, const SceneLights& scene, double distant) {
  if (!(medium.power > 0.0)) return 0.0;
  const double square = std::max(medium.radius * medium.radius, 1e-30);
  // Scattered rays reach a large fire often enough, and inside of it NEE sees as little as they do: on Mantaflow's
  // frame it cost 1.7 times the steps for a tenth less noise. They rarely reach a small fire.
  const double seen = 1.0 - medium.length * medium.length / (0.04 * square);
  if (!(seen > 0.0)) return 0.0;
  const double others = distant + (scene.analytic_light_flux + scene.triangle_flux) / (4.0 * std::numbers::pi * square);
  // A distant light has no flux if there is no surface to catch it.
  if (!(others > 0.0)) return scene.analytic_lights + scene.triangles > 0 ? 0.5 : 1.0;
  const double cells = medium.power / square;
  return seen * std::clamp(cells / (cells + others), 0.2, 0.8);
}

DistantLights with_mean(DistantLights distant, const Surroundings& surroundings) {
  distant.sky_radiance = sky_of(distant, surroundings);
  return distant;
}

}  // namespace

glm::vec3 sky_of(const DistantLights& distant, const Surroundings& surroundings) {
  if (!surroundings.environment) return distant.sky_radiance;
  return glm::vec3(surroundings.environment->mean * double{surroundings.strength});
}

glm::vec3 level_irradiance(const DistantLights& distant, const Surroundings& surroundings) {
  const glm::dvec3 sky = surroundings.environment
                             ? surroundings.environment->level_irradiance * double{surroundings.strength}
                             : std::numbers::pi * glm::dvec3(distant.sky_radiance);
  const glm::vec3 sun = distant.sun_irradiance * static_cast<float>(std::max(0.0, distant.to_sun.y));
  return glm::vec3(sky) + sun;
}

glm::vec2 turn_of(const Surroundings& surroundings) {
  const double angle = surroundings.rotation_degrees * std::numbers::pi / 180.0;
  return {std::cos(angle), std::sin(angle)};
}

Harmonics harmonics_of(const Surroundings& surroundings) {
  if (!surroundings.environment) return {};
  Harmonics harmonics = surroundings.environment->harmonics;
  for (glm::vec3& coefficient : harmonics) coefficient *= surroundings.strength;
  return harmonics;
}

LightTable::LightTable(const DistantLights& distant, const Surroundings& surroundings, const SceneLights& scene,
                       const MediumLight& medium)
    : distant_(with_mean(distant, surroundings)), surroundings_(surroundings) {
  const double sun = luminance(glm::dvec3(distant.sun_irradiance));
  const double sky = 4.0 * std::numbers::pi * luminance(glm::dvec3(distant_.sky_radiance));
  const auto add = [&](Kind kind, double probability) {
    if (probability > 0.0) entries_.push_back({kind, static_cast<float>(probability)});
  };
  const bool near = scene.analytic_lights + scene.triangles > 0;
  const bool surrounded = surroundings.environment != nullptr;
  const double to_cells = cell_probability(medium, scene, sun + sky);
  const double rest = 1.0 - to_cells;
  const double to_far = surrounded ? environment_probability(sun, sky, near) : sky_probability(sun, sky, near);
  const double to_triangles = (1.0 - to_far) * triangle_share(scene, sun);
  const double to_sun = sun_share(scene, sun) * (1.0 - to_far - to_triangles);
  const double to_analytic_lights = scene.analytic_lights > 0 ? 1.0 - to_far - to_triangles - to_sun : 0.0;
  add(surrounded ? Kind::environment : Kind::sky, rest * to_far);
  add(Kind::triangle, rest * to_triangles);
  add(Kind::analytic_light, rest * to_analytic_lights);
  add(Kind::sun, rest * to_sun);
  add(Kind::cell, to_cells);
  if (medium.aimed) add(Kind::emissive, 0.5);
}

float LightTable::probability(Kind kind) const {
  const auto found = std::ranges::find(entries_, kind, &Entry::kind);
  return found != entries_.end() ? found->probability : 0.0F;
}

core::CmLights LightTable::parameters() const {
  core::CmLights p{};
  p.sun_direction = glm::vec3(distant_.to_sun);
  p.sun_irradiance = distant_.sun_irradiance;
  p.sky_radiance = distant_.sky_radiance;
  // Below a thousandth of a degree it is a direction, because of float precision.
  if (const double half = distant_.sun_angle_degrees * std::numbers::pi / 360.0;
      half > 1e-5 && probability(Kind::sun) > 0.0F) {
    // Irradiance is the integral of radiance times the cosine over the disk.
    p.sun_radiance = distant_.sun_irradiance / static_cast<float>(std::numbers::pi * std::pow(std::sin(half), 2.0));
    p.sun_spread = static_cast<float>(2.0 * std::pow(std::sin(0.5 * half), 2.0));
  }
  p.any = std::ranges::any_of(entries_, [](const Entry& entry) { return entry.kind != Kind::emissive; }) ? 1U : 0U;
  p.sky_probability = probability(Kind::sky);
  p.triangle_probability = probability(Kind::triangle);
  p.analytic_light_probability = probability(Kind::analytic_light);
  p.emissive_probability = probability(Kind::emissive);
  p.cell_probability = probability(Kind::cell);
  p.environment_probability = probability(Kind::environment);
  p.environment_strength = surroundings_.strength;
  p.environment_turn = turn_of(surroundings_);
  return p;
}

}  // namespace cumulet::light
