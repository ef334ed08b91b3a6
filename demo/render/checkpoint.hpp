#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "options.hpp"

namespace cumulet::demo {

/// Names and values of the settings that a checkpoint depends on. Images with equal lists can resume from each other's
/// samples.
using CheckpointOf = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] CheckpointOf checkpoint_of(const RenderOptions& options);

/// The accumulated samples of an image, and the settings that they belong to.
struct Checkpoint {
  CheckpointOf of;
  std::string driver;  ///< OpenGL vendor, renderer and version. With another driver the result is correct, but not
                       ///< bit-identical.
  std::vector<std::byte> accumulation;
};

/// Replaces the file atomically. Throws std::runtime_error, one line with the path and the cause.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

/// Returns nullopt if the file does not exist. Throws std::runtime_error, one line with the path and the cause, if the
/// file is no checkpoint, is damaged, or belongs to other settings than `wanted`.
[[nodiscard]] std::optional<Checkpoint> read_checkpoint(const std::string& path, const CheckpointOf& wanted);

}  // namespace cumulet::demo
