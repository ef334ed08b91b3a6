#include "settled.hpp"

#include <algorithm>
#include <chrono>
#include <file.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace cumulet::demo {
namespace {

constexpr std::string_view first_line = "Cumulet settled 2\n";

/// Returns the first lines of the file: format, version, scene and image size. The volume's state and the scene follow.
std::string head(const SceneOptions& given) {
  return std::string(first_line) + version_text() + ' ' + scene_hash(given) + ' ' + std::to_string(given.width) + 'x' +
         std::to_string(given.height) + '\n';
}

}  // namespace

std::string volume_state(const std::string& volume) {
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(volume, none);
  const auto changed = std::filesystem::last_write_time(volume, none).time_since_epoch();
  // Whole seconds: some file systems have no finer resolution, and nodes may mount one file system differently.
  return std::to_string(size) + ' ' +
         std::to_string(std::chrono::duration_cast<std::chrono::seconds>(changed).count()) + ' ' +
         std::filesystem::path(volume).filename().string();
}

bool read_settled(const std::string& file, SceneOptions& scene, std::span<const std::string> volumes) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return false;
  const std::string text = image::read_file(file);
  const std::string wanted = head(scene);
  if (!text.starts_with(wanted)) return false;
  const std::string_view rest = std::string_view(text).substr(wanted.size());
  const std::string_view state = rest.substr(0, rest.find('\n'));
  if (state.size() == rest.size()) return false;
  const bool same = std::ranges::any_of(volumes, [&](const std::string& volume) {
    // The name is compared first, so that other files are not accessed.
    return state.ends_with(' ' + std::filesystem::path(volume).filename().string()) && volume_state(volume) == state;
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
  scene.ground = found->ground;
  scene.camera = found->camera;
  return true;
}

void write_settled(const std::string& file, const SceneOptions& given, const SceneOptions& found,
                   const std::string& state) {
  image::replace_file(file, head(given) + state + '\n' + scene_text(found, file));
}

}  // namespace cumulet::demo
