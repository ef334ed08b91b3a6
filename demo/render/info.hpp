#pragma once

#include <iosfwd>
#include <optional>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// What is in the scene's files, as lines or as JSON. Throws std::runtime_error, one line that names the file.
void write_info(const SceneOptions& scene, bool as_json, std::ostream& out);

/// A line for who shows with Y up what its metadata says is Blender's or Mantaflow's, whose up axis is Z.
[[nodiscard]] std::optional<std::string> up_hint(const SceneVolume& volume);

}  // namespace cumulet::demo
