#pragma once

#include <span>
#include <string>

#include "options.hpp"

namespace cumulet::demo {

/// What is the same for all frames of a sequence though nobody said it (density scale and medium, ground, camera), kept
/// in a file: whoever makes frames of the sequence then need not read the volume that it is taken from.

/// Which file a volume is now: its name without folders, size in bytes and time of change in seconds, a line.
[[nodiscard]] std::string volume_state(const std::string& volume);

/// Takes it from the file into the scene. False, and the scene as it was, where there is none, or one of another scene,
/// picture size or version, or damaged, or found of a volume that is not among `volumes` in the same state: then it is
/// to be found anew.
[[nodiscard]] bool read_settled(const std::string& file, SceneOptions& scene, std::span<const std::string> volumes);

/// Writes, in one step, what was found for a scene as it was given, of a volume that had this state before. Throws
/// std::runtime_error, one line with the file and the cause.
void write_settled(const std::string& file, const SceneOptions& given, const SceneOptions& found,
                   const std::string& state);

}  // namespace cumulet::demo
