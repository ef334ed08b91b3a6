#include "default_medium.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <frame_row.hpp>
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
// Range of the maximum temperature of air in kelvin, as weather models store it beside clouds.
constexpr double coldest_air = 150.0;
constexpr double hottest_air = 350.0;

// Grids beside density that simulations of smoke write; "shadow" is Mantaflow's.
constexpr std::array<std::string_view, 3> smoke_names = {"smoke", "soot", "shadow"};

/// Properties of a volume that determine its content.
struct Evidence {
  double flame = 0.0;        // maximum of the flame grid
  double temperature = 0.0;  // maximum of the temperature grid, as stored
  double kelvin = 0.0;       // the same in kelvin
  bool simulated = false;    // grids or metadata of a simulation of fire or smoke
};

bool is_fire(double kelvin) { return kelvin >= coldest_fire && kelvin <= hottest_fire; }

Content content_of(const Evidence& evidence) {
  if (evidence.flame > 0.0 || is_fire(evidence.kelvin)) return Content::fire;
  if (evidence.temperature >= coldest_air && evidence.temperature <= hottest_air) return Content::cloud;
  return evidence.simulated ? Content::smoke : Content::cloud;
}

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

/// Returns true if a grid with this name is written by simulations of fire or smoke.
bool is_simulated(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto is_in = [&](const auto& names) { return std::ranges::find(names, name) != names.end(); };
  return is_in(settings::temperature_names) || is_in(settings::flame_names) || is_in(smoke_names);
}

bool has_simulated_grid(const std::string& file) {
  bool found = false;
  const auto look = [](void* user, const char* name, const char*, const char*) {
    if (is_simulated(name)) *static_cast<bool*>(user) = true;
  };
  return cumulet_list_grids(file.c_str(), look, &found, nullptr, 0) == CUMULET_OK && found;
}

/// Returns true if the file, or the first file of a sequence, is written by a simulation of fire or smoke.
bool is_simulation(const std::string& file) {
  if (file.empty()) return false;
  if (const auto row = FrameRow::of_name(file)) return row->count() > 0 && is_simulation(row->file(0));
  if (has_simulated_grid(file)) return true;
  cumulet_inspection* inspection = nullptr;
  if (cumulet_inspect_volume_file(file.c_str(), &inspection, nullptr, 0) != CUMULET_OK) return false;
  const bool found = is_of_mantaflow(inspection);
  cumulet_inspection_release(inspection);
  return found;
}

/// Returns true if the scene names a grid of temperatures or flames.
bool names_fire(const VolumeFile& file) {
  const auto named = [](const std::string& grid) { return !grid.empty() && grid != "none"; };
  return named(file.temperature_grid) || named(file.flame_grid);
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

/// simulated: is_simulation() of the volume's file, or the scene names a grid of fire.
DefaultMedium default_medium(const cumulet_volume* volume, const SceneVolume& scene, bool simulated) {
  DefaultMedium made{Content::cloud, scene.medium};
  cumulet_medium_desc& medium = made.medium;
  const cumulet_volume_info info = info_of(volume);
  const double size = size_of(info);
  float temperature_scale = medium.temperature_scale;
  if (temperature_scale == 0.0F) temperature_scale = temperature_scale_of(volume).value_or(0.0F);
  Evidence evidence;
  evidence.flame = max_of(volume, CUMULET_RAMP_FLAME);
  evidence.temperature = max_of(volume, CUMULET_RAMP_TEMPERATURE);
  evidence.kelvin = double{temperature_scale} * evidence.temperature;
  evidence.simulated = simulated;
  made.content = size > 0.0 ? content_of(evidence) : Content::cloud;
  if (made.content == Content::smoke && scene.albedo_given) made.content = Content::cloud;
  if (made.content == Content::cloud) return made;
  const bool visible = cumulet_volume_suggest_density_scale(volume, &medium.density_scale) == CUMULET_OK;
  if (made.content == Content::smoke) {
    const float given_scale = medium.temperature_scale;
    apply(Preset::smoke, medium);
    medium.temperature_scale = given_scale;
    return made;
  }
  if (!visible) medium.density_scale = 0.0;  // a flame without smoke
  medium.temperature_scale = temperature_scale;
  apply({.flame = evidence.flame, .temperature = is_fire(evidence.kelvin) ? evidence.temperature : 0.0, .size = size},
        medium);
  return made;
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

bool is_of_mantaflow(const cumulet_inspection* inspection) {
  cumulet_volume_file_info file{};
  file.struct_size = sizeof file;
  if (cumulet_inspection_get_file(inspection, &file) != CUMULET_OK) return false;
  for (std::uint32_t grid = 0; grid < file.grid_count; ++grid) {
    cumulet_metadata entry{};
    entry.struct_size = sizeof entry;
    // The loop ends at the index past the last entry.
    for (std::uint32_t i = 0;
         cumulet_inspection_get_metadata(inspection, static_cast<std::int32_t>(grid), i, &entry) == CUMULET_OK; ++i) {
      if (std::string_view(entry.name) == "file_base_resolution") return true;
    }
  }
  return false;
}

Content content_of(cumulet_inspection* inspection) {
  cumulet_volume_file_info file{};
  file.struct_size = sizeof file;
  if (cumulet_inspection_get_file(inspection, &file) != CUMULET_OK) return Content::cloud;
  Evidence evidence;
  evidence.simulated = is_of_mantaflow(inspection);
  for (std::uint32_t i = 0; i < file.grid_count; ++i) {
    cumulet_grid_info grid{};
    grid.struct_size = sizeof grid;
    if (cumulet_inspection_get_grid(inspection, i, &grid) != CUMULET_OK) continue;
    evidence.simulated |= is_simulated(grid.name);
    const std::string_view channel = grid.channel;
    if (channel == "flame") evidence.flame = double{grid.max_value};
    if (channel == "temperature") evidence.temperature = double{grid.max_value};
  }
  // The default of cumulet_medium_desc::temperature_scale.
  constexpr double max_relative = 20.0;
  evidence.kelvin = evidence.temperature * (evidence.temperature > max_relative ? 1.0 : 1500.0);
  return content_of(evidence);
}

DefaultMedium default_medium(const cumulet_volume* volume, const SceneVolume& scene) {
  return default_medium(volume, scene, names_fire(scene) || is_simulation(scene.volume));
}

bool show_by_default(cumulet_viewer* viewer, const cumulet_volume_file_desc& file, const SceneVolume& scene) {
  if (!names_fire(scene) && !is_simulation(file.path)) return false;
  Notes notes;
  const std::shared_ptr<cumulet_volume> volume = open_quietly(file, notes);
  if (!volume || info_of(volume.get()).active_voxels == 0) return false;
  DefaultMedium made = default_medium(volume.get(), scene, true);
  if (made.content == Content::cloud)  // has no visible density if this fails
    static_cast<void>(cumulet_volume_suggest_density_scale(volume.get(), &made.medium.density_scale));
  for (const auto& [level, text] : notes)
    if (file.log != nullptr) file.log(file.log_user, level, text.c_str());
  if (cumulet_set_medium(viewer, &made.medium) != CUMULET_OK || cumulet_set_volume(viewer, volume.get()) != CUMULET_OK)
    throw std::runtime_error(cumulet_last_error(viewer));
  return true;
}

}  // namespace cumulet::demo
