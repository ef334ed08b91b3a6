#include "light/light_table.hpp"

#include <algorithm>
#include <numbers>

#include "base/luminance.hpp"

namespace cumulet::light {

namespace {

// Half of the sky's share of the light: paths that escape sample it as well.
double sky_chance(double sun, double sky, bool near) {
  if (sun > 0.0) return 0.5 * sky / (sky + sun);
  if (!(sky > 0.0)) return 0.0;
  return near ? 0.25 : 1.0;
}

// Of what is not the sky: the triangles' share of the flux, but 0.2 to 0.8 where there are others.
double triangle_share(const SceneLights& scene, double sun) {
  if (scene.triangles == 0) return 0.0;
  const double others = scene.lamp_flux + sun * scene.cross_section;
  return others > 0.0 ? std::clamp(scene.triangle_flux / (scene.triangle_flux + others), 0.2, 0.8) : 1.0;
}

}  // namespace

LightTable::LightTable(const DistantLights& distant, const SceneLights& scene, bool glow) : distant_(distant) {
  const double sun = luminance(glm::dvec3(distant.sun_irradiance));
  const double sky = 4.0 * std::numbers::pi * luminance(glm::dvec3(distant.sky_radiance));
  const auto add = [&](Kind kind, double chance) {
    if (chance > 0.0) entries_.push_back({kind, static_cast<float>(chance)});
  };
  const double to_sky = sky_chance(sun, sky, scene.lamps + scene.triangles > 0);
  const double to_triangles = (1.0 - to_sky) * triangle_share(scene, sun);
  // The sun and each lamp alike.
  const double alike = scene.lamps + (sun > 0.0 ? 1.0 : 0.0);
  const double to_one = alike > 0.0 ? (1.0 - to_sky - to_triangles) / alike : 0.0;
  add(Kind::sky, to_sky);
  add(Kind::triangle, to_triangles);
  add(Kind::lamp, scene.lamps * to_one);
  if (sun > 0.0) add(Kind::sun, to_one);
  if (glow) add(Kind::glow, 0.5);
}

float LightTable::chance(Kind kind) const {
  const auto found = std::ranges::find(entries_, kind, &Entry::kind);
  return found != entries_.end() ? found->chance : 0.0F;
}

core::CmLights LightTable::parameters() const {
  core::CmLights p{};
  p.sun_direction = glm::vec3(distant_.to_sun);
  p.sun_irradiance = distant_.sun_irradiance;
  p.sky_radiance = distant_.sky_radiance;
  p.any = std::ranges::any_of(entries_, [](const Entry& entry) { return entry.kind != Kind::glow; }) ? 1U : 0U;
  p.sky_chance = chance(Kind::sky);
  p.triangle_chance = chance(Kind::triangle);
  p.lamp_chance = chance(Kind::lamp);
  p.glow_chance = chance(Kind::glow);
  return p;
}

}  // namespace cumulet::light
