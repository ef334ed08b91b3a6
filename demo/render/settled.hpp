#pragma once

#include <string>

#include "options.hpp"

namespace cumulet::demo {

/// What is the same for all frames of a sequence though nobody said it (density scale and medium, ground, camera), kept
/// in a file: whoever makes frames of the sequence then need not read the volume that it is taken from.

/// Takes it from the file into the scene. False, and the scene as it was, where there is none, or one of another scene,
/// picture size or version, or damaged: then it is to be found anew.
[[nodiscard]] bool read_settled(const std::string& file, SceneOptions& scene);

/// Writes, in one step, what was found for a scene as it was given. Throws std::runtime_error, one line with the file
/// and the cause.
void write_settled(const std::string& file, const SceneOptions& given, const SceneOptions& found);

}  // namespace cumulet::demo
