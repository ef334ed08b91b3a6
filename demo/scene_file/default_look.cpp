#include "default_look.hpp"

#include <settings.hpp>

namespace cumulet::demo {
namespace {

template <class Desc>
Desc spelled_out(Desc desc) {
  settings::spell_out_zeros(desc);
  return desc;
}

cumulet_sun_sky_desc daylight() {
  SceneOptions day;
  day.set_daylight();
  return spelled_out(day.light);
}

cumulet_sun_sky_desc darkness() { return spelled_out(SceneOptions().light); }

// The sun is just above the horizon.
cumulet_sun_sky_desc dusk() {
  cumulet_sun_sky_desc light = daylight();
  light.sun_elevation_degrees = 3.0F;
  return light;
}

bool has_light(const SceneOptions& scene, const cumulet_sun_sky_desc& light) {
  return settings::same(spelled_out(scene.light), light);
}

bool is_display(const SceneOptions& scene, float exposure, std::optional<float> measured, cumulet_tone_map tone_map) {
  const float stops = scene.display.exposure_stops;
  return (stops == exposure || stops == measured) && scene.display.tone_map == tone_map;
}

bool is_dusk(const SceneOptions& scene, std::optional<float> measured) {
  return has_light(scene, dusk()) && is_display(scene, dusk_exposure, measured, CUMULET_TONE_MAP_FILMIC);
}

}  // namespace

void take_daylight(SceneOptions& scene) {
  if (has_light(scene, daylight())) scene.light = darkness();
}

void give_daylight(SceneOptions& scene) {
  if (has_light(scene, darkness())) scene.light = daylight();
}

bool is_default_exposure(const SceneOptions& scene, std::optional<float> measured) {
  const float stops = scene.display.exposure_stops;
  return stops == 0.0F || stops == measured || is_dusk(scene, measured);
}

bool take_dusk(SceneOptions& scene, std::optional<float> measured) {
  if (!has_light(scene, daylight()) || !scene.environment.empty() || !scene.ocio.config.empty()) return false;
  if (!is_display(scene, 0.0F, measured, CUMULET_TONE_MAP_NEUTRAL)) return false;
  scene.light = dusk();
  scene.display.exposure_stops = dusk_exposure;
  scene.display.tone_map = CUMULET_TONE_MAP_FILMIC;
  return true;
}

bool give_day(SceneOptions& scene, std::optional<float> measured) {
  if (!is_dusk(scene, measured)) return false;
  scene.light = daylight();
  scene.display.exposure_stops = 0.0F;
  scene.display.tone_map = CUMULET_TONE_MAP_NEUTRAL;
  return true;
}

}  // namespace cumulet::demo
