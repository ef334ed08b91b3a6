#include "settled.hpp"

#include <file.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace cumulet::demo {
namespace {

constexpr std::string_view first_line = "Cumulet settled 1\n";

/// What it was found for, a line; the scene comes after it.
std::string head(const SceneOptions& given) {
  return std::string(first_line) + version_text() + ' ' + scene_hash(given) + ' ' + std::to_string(given.width) + 'x' +
         std::to_string(given.height) + '\n';
}

}  // namespace

bool read_settled(const std::string& file, SceneOptions& scene) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return false;
  const std::string text = image::read_file(file);
  const std::string wanted = head(scene);
  if (!text.starts_with(wanted)) return false;
  std::optional<SceneOptions> found;
  try {
    found = parse_scene(text.substr(wanted.size()), file);
  } catch (const std::runtime_error&) {
    return false;
  }
  scene.auto_density_scale = found->auto_density_scale;
  scene.medium = found->medium;
  scene.ground = found->ground;
  scene.camera = found->camera;
  return true;
}

void write_settled(const std::string& file, const SceneOptions& given, const SceneOptions& found) {
  image::replace_file(file, head(given) + scene_text(found, file));
}

}  // namespace cumulet::demo
