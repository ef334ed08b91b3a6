#pragma once

#include <iosfwd>
#include <optional>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// Writes a description of the scene's files, as lines or as JSON. Throws std::runtime_error, one line that names the
/// file.
void write_info(const SceneOptions& scene, bool as_json, std::ostream& out);

/// Returns the up axis that the metadata of a volume file names: Z for Blender and Mantaflow, else Y, also for files
/// that cannot be read.
[[nodiscard]] UpAxis known_up_axis(const std::string& volume_file);

/// Returns a hint if the volume is shown with Y up and its metadata names Blender or Mantaflow, whose up axis is Z.
[[nodiscard]] std::optional<std::string> up_hint(const SceneVolume& volume);

}  // namespace cumulet::demo
