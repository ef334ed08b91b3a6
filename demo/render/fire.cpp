#include "fire.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <grid_names.hpp>
#include <memory>
#include <presets.hpp>
#include <scene_file.hpp>
#include <settings.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

// A fire that is missed here costs only time.
bool names_fire(const cumulet_volume_file_desc& file) {
  const auto named = [](const char* grid) {
    return grid != nullptr && *grid != '\0' && std::string_view(grid) != "none";
  };
  if (named(file.temperature_grid) || named(file.flame_grid)) return true;
  bool found = false;
  const auto look = [](void* user, const char* name, const char*, const char*) {
    std::string lower = name;
    std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto is_in = [&](const auto& names) { return std::ranges::find(names, lower) != names.end(); };
    if (is_in(settings::temperature_names) || is_in(settings::flame_names)) *static_cast<bool*>(user) = true;
  };
  return cumulet_list_grids(file.path, look, &found, nullptr, 0) == CUMULET_OK && found;
}

// Keeps notes until it is known who reports them.
using Notes = std::vector<std::pair<cumulet_log_level, std::string>>;

std::shared_ptr<cumulet_volume> open_quietly(cumulet_volume_file_desc file, Notes& notes) {
  file.log = [](void* user, cumulet_log_level level, const char* text) {
    static_cast<Notes*>(user)->emplace_back(level, text);
  };
  file.log_user = &notes;
  cumulet_volume* opened = nullptr;
  static_cast<void>(cumulet_volume_open_file(&file, &opened, nullptr, 0));
  return {opened, cumulet_volume_release};
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

bool show_fire(cumulet_viewer* viewer, const cumulet_volume_file_desc& file, const cumulet_medium_desc& plain) {
  if (!names_fire(file)) return false;
  Notes notes;
  const std::shared_ptr<cumulet_volume> volume = open_quietly(file, notes);
  if (!volume || info_of(volume.get()).active_voxels == 0) return false;
  cumulet_medium_desc medium = plain;
  if (const auto burning = medium_of_fire(volume.get(), plain)) {
    medium = *burning;
  } else {
    static_cast<void>(cumulet_volume_suggest_density_scale(volume.get(), &medium.density_scale));  // if visible
  }
  for (const auto& [level, text] : notes)
    if (file.log != nullptr) file.log(file.log_user, level, text.c_str());
  if (cumulet_set_medium(viewer, &medium) != CUMULET_OK || cumulet_set_volume(viewer, volume.get()) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer));
  return true;
}

}  // namespace cumulet::demo
