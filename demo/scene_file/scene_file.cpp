#include "scene_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "matrix.hpp"

namespace cumulet::demo {
namespace {

namespace fs = std::filesystem;

/// Lists names in quotes, for an error message.
std::string list_quoted(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "\"" : ", \"") + name + "\"";
  return list.empty() ? "none" : list;
}

}  // namespace

SceneVolume::SceneVolume() { medium.struct_size = sizeof medium; }

std::string SceneModel::label() const { return name.empty() ? fs::path(file).filename().string() : name; }

std::string SceneVolume::label() const { return name.empty() ? fs::path(volume).filename().string() : name; }

SceneOptions::SceneOptions() {
  for_each_group(*this, [](auto& group) { group.struct_size = sizeof group; });
  sampling.samples = 64;
  display.denoise = CUMULET_DENOISE_FAST;
}

cumulet_playback_desc playback_of(const SceneSequence& sequence, const FrameRow& row) {
  cumulet_playback_desc desc = sequence.playback;
  const std::uint32_t first = sequence.first ? row.index_of(*sequence.first) : 0;
  const std::uint32_t last = sequence.last ? row.index_of(*sequence.last) : row.count() - 1;
  desc.first_frame = std::min(first, last);
  desc.frame_count = last - desc.first_frame + 1;
  // One playback frame is the step from one file to the next, whatever the step of their numbers. Velocities are per
  // number, so scale them by that step.
  if (row.count() > 1) {
    settings::spell_out_zeros(desc);
    desc.velocity_scale *= row.number(1) - row.number(0);
  }
  return desc;
}

cumulet_volume_file_desc volume_file(const VolumeFile& file) {
  cumulet_volume_file_desc desc{};
  desc.struct_size = sizeof desc;
  desc.path = file.volume.c_str();
  desc.grid_name = file.grid_name.c_str();
  desc.temperature_grid = file.temperature_grid.c_str();
  desc.flame_grid = file.flame_grid.c_str();
  desc.color_grid = file.color_grid.c_str();
  desc.anisotropy_grid = file.anisotropy_grid.c_str();
  desc.velocity_grid = file.velocity_grid.c_str();
  Matrix to_world = file.to_world;
  if (file.up == UpAxis::z) {
    constexpr Matrix upright = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    to_world = to_world == Matrix{} ? upright : product(to_world, upright);
  }
  std::ranges::copy(to_world, desc.to_world);
  return desc;
}

std::string light_groups_refusal(const std::vector<std::string>& names) {
  if (names.size() > CUMULET_LIGHT_GROUPS)
    return "are more than " + std::to_string(int{CUMULET_LIGHT_GROUPS}) + " names";
  std::set<std::string_view> known;
  for (const std::string& name : names) {
    constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    if (name.empty() || name.find_first_not_of(letters) != std::string::npos)
      return "has a name with characters other than letters, digits, _ and -";
    if (!known.insert(name).second) return "has a name twice";
  }
  return "";
}

void set_shutter(const SceneShutter& shutter, const double (&to_world)[16], double (&open)[16], double (&close)[16]) {
  Matrix transform{};
  std::ranges::copy(to_world, transform.begin());
  const auto end = [&](const std::optional<Matrix>& step, double(&out)[16]) {
    const Matrix at = !step ? Matrix{} : transform == Matrix{} ? *step : product(*step, transform);
    std::ranges::copy(at, out);
  };
  end(shutter.open, open);
  end(shutter.close, close);
}

void look_through(SceneOptions& scene, const std::string& name) {
  const auto found = std::ranges::find(scene.cameras, name, &NamedCamera::name);
  if (found == scene.cameras.end()) {
    std::vector<std::string> names;
    for (const NamedCamera& camera : scene.cameras) names.push_back(camera.name);
    throw std::runtime_error("no camera \"" + name + "\"; the scene has " + list_quoted(names));
  }
  static_cast<SceneCamera&>(scene) = *found;
  scene.surface_camera = -1;
}

void end_shutter(SceneOptions& scene) {
  scene.camera_open.reset();
  scene.camera_close.reset();
}

void set_animation_time(SceneOptions& scene, double seconds) {
  const double time = std::max(seconds, 0.0);
  if (!scene.surfaces.empty()) scene.surface.time = time;
  for (SceneModel& model : scene.models) model.time = time;
}

std::string animation_refusal(const std::string& file, std::uint32_t wanted, std::uint32_t animations) {
  if (wanted == 0 || wanted < animations) return {};  // 0 is the default, also for a file without animations
  return file + ": no animation " + std::to_string(wanted) + "; the file has " + std::to_string(animations);
}

std::uint32_t variant_number(const std::string& file, const std::string& wanted,
                             const std::vector<std::string>& names) {
  if (wanted.empty()) return 0;
  const auto named = std::ranges::find(names, wanted);
  if (named != names.end()) return static_cast<std::uint32_t>(named - names.begin()) + 1;
  std::uint32_t number = 0;
  const char* const end = wanted.data() + wanted.size();
  const auto [rest, error] = std::from_chars(wanted.data(), end, number);
  if (error == std::errc() && rest == end && number < names.size()) return number + 1;
  throw std::runtime_error(file + ": no material variant \"" + wanted + "\"; the file has " + list_quoted(names));
}

void SceneOptions::set_daylight() {
  set_daylight_of_version_1();
  light.sky = CUMULET_SKY_PHYSICAL;
  light.turbidity = 2.5f;
  light.ground_albedo = 0.3f;
}

void SceneOptions::set_daylight_of_version_1() {
  light.sun_azimuth_degrees = 65.0f;
  light.sun_elevation_degrees = 40.0f;
  constexpr std::array<float, 3> sun = {4.4f, 4.05f, 3.55f};
  constexpr std::array<float, 3> sky = {0.06f, 0.11f, 0.21f};
  std::copy(sun.begin(), sun.end(), light.sun_irradiance);
  std::copy(sky.begin(), sky.end(), light.sky_radiance);
}

void SceneOptions::set_environment(const std::string& file) {
  SceneOptions day;
  SceneOptions first;
  day.set_daylight();
  first.set_daylight_of_version_1();
  if (settings::same(light, day.light) || settings::same(light, first.light)) light = SceneOptions().light;
  environment = file;
}

std::string version_text() {
  return std::to_string(CUMULET_VERSION_MAJOR) + "." + std::to_string(CUMULET_VERSION_MINOR) + "." +
         std::to_string(CUMULET_VERSION_PATCH);
}

}  // namespace cumulet::demo
