#pragma once

#include <span>
#include <string>

#include "options.hpp"

namespace cumulet::demo {

/// Sequence cache: a file with the settings that all frames of a sequence share. They are derived from a volume
/// (density scale and medium, light and display of a fire, ground, camera). Later runs need not read that volume.

/// Returns a line that identifies the state of a file: size in bytes, modification time in seconds, and name without
/// folders. For a folder of slices: the sum of their sizes, and the latest time.
[[nodiscard]] std::string volume_state(const std::string& volume);

/// Reads the settings from options.sequence_cache into the scene. Returns false and leaves the scene unchanged if the
/// file is missing or damaged, or belongs to another scene, image size or version. It also returns false if its volume
/// is not in `volumes` or has changed. The settings must then be derived again.
[[nodiscard]] bool read_settled(RenderOptions& options, std::span<const std::string> volumes);

/// Writes the derived settings of options.scene atomically. given: the scene as requested; state: volume_state() before
/// loading. Throws std::runtime_error, one line with the file and the cause.
void write_settled(const RenderOptions& options, const SceneOptions& given, const std::string& state);

}  // namespace cumulet::demo
