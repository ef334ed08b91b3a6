#include "fire.hpp"

#include <cmath>
#include <presets.hpp>
#include <scene_file.hpp>
#include <settings.hpp>

namespace cumulet::demo {

namespace {

// Range of flame temperatures in kelvin. Volumes with other temperatures are not shown as fire.
constexpr double coldest_fire = 800.0;
constexpr double hottest_fire = 6000.0;

double max_of(const cumulet_volume* volume, cumulet_ramp ramp) {
  cumulet_histogram_info info{};
  info.struct_size = sizeof info;
  return cumulet_volume_get_histogram(volume, ramp, &info) == CUMULET_OK ? double{info.max_value} : 0.0;
}

cumulet_volume_info info_of(const cumulet_volume* volume) {
  cumulet_volume_info info{};
  info.struct_size = sizeof info;
  // Cannot fail: the volume exists and struct_size is set.
  static_cast<void>(cumulet_volume_get_info(volume, &info));
  return info;
}

double size_of(const cumulet_volume_info& info) {
  const auto edge = [&](int axis) { return info.bounds_max[axis] - info.bounds_min[axis]; };
  return std::hypot(edge(0), edge(1), edge(2));
}

}  // namespace

bool is_unsaid(const cumulet_medium_desc& medium) {
  cumulet_medium_desc said = medium;
  cumulet_medium_desc plain = SceneOptions().medium;
  plain.density_scale = said.density_scale;
  settings::spell_out_zeros(said);
  settings::spell_out_zeros(plain);
  return settings::same(said, plain);
}

std::optional<float> temperature_scale_of(const cumulet_volume* volume) {
  if (!(max_of(volume, CUMULET_RAMP_TEMPERATURE) > 0.0)) return std::nullopt;
  return static_cast<float>(info_of(volume).temperature_scale);
}

std::optional<cumulet_medium_desc> medium_of_fire(const cumulet_volume* volume, const cumulet_medium_desc& plain) {
  cumulet_medium_desc medium = plain;
  settings::spell_out_zeros(medium);
  const cumulet_volume_info info = info_of(volume);
  Burning burning{.flame = max_of(volume, CUMULET_RAMP_FLAME),
                  .temperature = max_of(volume, CUMULET_RAMP_TEMPERATURE),
                  .size = size_of(info)};
  if (medium.temperature_scale == 0.0F) medium.temperature_scale = temperature_scale_of(volume).value_or(0.0F);
  // Warm smoke and clouds (about 270 K) also have temperatures, but do not burn.
  const double kelvin = double{medium.temperature_scale} * burning.temperature;
  if (!(kelvin >= coldest_fire && kelvin <= hottest_fire)) burning.temperature = 0.0;
  if (!(burning.flame + burning.temperature > 0.0) || !(burning.size > 0.0)) return std::nullopt;
  if (cumulet_volume_suggest_density_scale(volume, &medium.density_scale) != CUMULET_OK)
    medium.density_scale = 0.0;  // a flame without smoke
  apply(burning, medium);
  return medium;
}

}  // namespace cumulet::demo
