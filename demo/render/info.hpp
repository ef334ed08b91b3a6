#pragma once

#include <iosfwd>
#include <scene_file.hpp>
#include <string>

namespace cumulet::demo {

/// What is in the scene's files, as lines or as JSON. Throws std::runtime_error, one line that names the file.
void write_info(const SceneOptions& scene, bool as_json, std::ostream& out);

/// Whether a volume's metadata says that it comes from Blender or Mantaflow, whose up axis is Z.
[[nodiscard]] bool is_z_up(const std::string& volume_file);

}  // namespace cumulet::demo
