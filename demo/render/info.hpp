#pragma once

#include <iosfwd>
#include <scene_file.hpp>
#include <span>
#include <string>
#include <vector>

namespace cumulet::demo {

/// Writes a description of the scene's files, as lines or as JSON. Throws std::runtime_error, one line that names the
/// file.
void write_info(const SceneOptions& scene, bool as_json, std::ostream& out);

/// Returns the up axis that the metadata of a volume file names: Z for Blender and Mantaflow, else Y, also for files
/// that cannot be read.
[[nodiscard]] UpAxis known_up_axis(const std::string& volume_file);

/// Returns known_up_axis() of the first of these files that can be read; Y if there is none.
[[nodiscard]] UpAxis known_up_axis(std::span<const std::string> volume_files);

/// Returns a hint for each volume of the scene that is shown with Y up and whose metadata names Blender or Mantaflow.
[[nodiscard]] std::vector<std::string> up_hints(const SceneOptions& scene);

}  // namespace cumulet::demo
