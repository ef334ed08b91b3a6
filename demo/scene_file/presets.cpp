#include "presets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <settings.hpp>

namespace cumulet::demo {

namespace {

void set(float (&rgb)[3], float r, float g, float b) { std::copy_n(std::array{r, g, b}.begin(), 3, rgb); }

}  // namespace

void apply(Preset preset, cumulet_medium_desc& medium) {
  const double density_scale = medium.density_scale;
  medium = {};
  medium.struct_size = sizeof medium;
  medium.density_scale = density_scale;
  switch (preset) {
    case Preset::cumulus:
      medium.phase = CUMULET_PHASE_MIE;
      medium.droplet_diameter = 20.0F;
      break;
    case Preset::smoke:
      set(medium.coalbedo, 0.5F, 0.5F, 0.5F);
      break;
    case Preset::fire:
      set(medium.coalbedo, 0.6F, 0.62F, 0.64F);
      medium.blackbody = 2.0F;
      medium.flame_strength = 4.0F;
      set(medium.flame_color, 1.0F, 0.4F, 0.1F);
      break;
    case Preset::explosion:
      set(medium.coalbedo, 0.68F, 0.7F, 0.72F);
      medium.max_bounces = 12;
      medium.blackbody = 12.0F;
      medium.flame_strength = 9.0F;
      set(medium.flame_color, 1.0F, 0.3F, 0.05F);
      break;
    case Preset::ground_fog:
      set(medium.coalbedo, 0.002F, 0.002F, 0.002F);
      medium.phase = CUMULET_PHASE_MIE;
      medium.droplet_diameter = 8.0F;
      break;
  }
  settings::spell_out_zeros(medium);
  medium.density_scale = density_scale;
}

void apply(const Burning& burning, cumulet_medium_desc& medium) {
  const bool smoke = medium.density_scale > 0.0;
  const float temperature_scale = medium.temperature_scale;
  apply(smoke ? Preset::explosion : Preset::fire, medium);
  medium.temperature_scale = temperature_scale;
  // Emission per unit length divided by extinction per unit length gives the radiance of an opaque medium.
  const double hides = smoke ? medium.density_scale : 16.0 / burning.size;
  const auto strength = [](double value) { return static_cast<float>(std::clamp(value, 0.0, 1e6)); };
  medium.flame_strength = burning.flame > 0.0 ? strength(hides / burning.flame) : 1.0F;
  // Black-body radiance in Blender's unit, 1e-6 sigma / pi T^4.
  const double kelvin = double{medium.temperature_scale} * burning.temperature;
  constexpr double hottest = 0.26;
  medium.blackbody = kelvin > 0.0 ? strength(hottest * hides / (1.805e-14 * std::pow(kelvin, 4.0))) : 0.0F;
}

std::optional<Preset> preset_of(const cumulet_medium_desc& medium) {
  cumulet_medium_desc asked = medium;
  settings::spell_out_zeros(asked);
  for (const settings::Choice& choice : preset_choices) {
    const auto preset = static_cast<Preset>(choice.value);
    cumulet_medium_desc made = asked;
    apply(preset, made);
    if (settings::same(made, asked)) return preset;
  }
  return std::nullopt;
}

}  // namespace cumulet::demo
