#include "settled.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <file.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace cumulet::demo {
namespace {

constexpr std::string_view first_line = "Cumulet settled 3\n";

/// Returns the first lines of the file: format, version, scene, image size and whether the look is the default one. The
/// volume's state and the scene follow.
std::string head(const SceneOptions& given, bool default_look) {
  return std::string(first_line) + version_text() + ' ' + scene_hash(given) + ' ' + std::to_string(given.width) + 'x' +
         std::to_string(given.height) + (default_look ? " default look\n" : "\n");
}

/// Returns the name without folders, also of a folder with a slash at its end.
std::string name_of(const std::filesystem::path& path) {
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

bool is_slice(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".tif" || ending == ".tiff";
}

}  // namespace

std::string volume_state(const std::string& volume) {
  namespace fs = std::filesystem;
  std::error_code none;
  std::uintmax_t size = fs::file_size(volume, none);
  auto changed = fs::last_write_time(volume, none).time_since_epoch();
  if (fs::is_directory(volume, none)) {
    // The folder's own time also changes with other files in it.
    size = 0;
    changed = {};
    for (fs::directory_iterator entry(volume, none), end; entry != end; entry.increment(none)) {
      if (!is_slice(entry->path())) continue;
      const auto slice_changed = entry->last_write_time(none).time_since_epoch();
      changed = size == 0 ? slice_changed : std::max(changed, slice_changed);
      size += entry->file_size(none);
    }
  }
  // Whole seconds: some file systems have no finer resolution, and nodes may mount one file system differently.
  return std::to_string(size) + ' ' +
         std::to_string(std::chrono::duration_cast<std::chrono::seconds>(changed).count()) + ' ' + name_of(volume);
}

bool read_settled(RenderOptions& options, std::span<const std::string> volumes) {
  const std::string& file = options.sequence_cache;
  SceneOptions& scene = options.scene;
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return false;
  const std::string text = image::read_file(file);
  const std::string wanted = head(scene, options.default_look);
  if (!text.starts_with(wanted)) return false;
  const std::string_view rest = std::string_view(text).substr(wanted.size());
  const std::string_view state = rest.substr(0, rest.find('\n'));
  if (state.size() == rest.size()) return false;
  const bool same = std::ranges::any_of(volumes, [&](const std::string& volume) {
    // The name is compared first, so that other files are not accessed.
    return state.ends_with(' ' + name_of(volume)) && volume_state(volume) == state;
  });
  if (!same) return false;
  std::optional<SceneOptions> found;
  try {
    found = parse_scene(std::string(rest.substr(state.size() + 1)), file);
  } catch (const std::runtime_error&) {
    return false;
  }
  scene.auto_density_scale = found->auto_density_scale;
  scene.medium = found->medium;
  scene.light = found->light;
  scene.display.exposure_stops = found->display.exposure_stops;
  scene.display.tone_map = found->display.tone_map;
  scene.ground = found->ground;
  scene.camera = found->camera;
  return true;
}

void write_settled(const RenderOptions& options, const SceneOptions& given, const std::string& state) {
  const std::string& file = options.sequence_cache;
  image::replace_file(file, head(given, options.default_look) + state + '\n' + scene_text(options.scene, file));
}

}  // namespace cumulet::demo
