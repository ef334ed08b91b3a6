#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "options.hpp"

namespace cumulet::demo {

/// What a checkpoint is of, thing by thing: pictures that have all of it in common go on from each other's samples.
using CheckpointOf = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] CheckpointOf checkpoint_of(const RenderOptions& options);

/// What the samples of a picture had come to, and what it is of.
struct Checkpoint {
  CheckpointOf of;
  std::string driver;  ///< OpenGL's; with another the picture is as right, and not the same bits
  std::vector<std::byte> accumulation;
};

/// Replaces the file in one step. Throws std::runtime_error, one line with the path and the cause.
void write_checkpoint(const std::string& path, const Checkpoint& checkpoint);

/// Nothing where there is no such file. Throws std::runtime_error, one line with the path and the cause, for one that
/// is no checkpoint, damaged, or of something else than wanted.
[[nodiscard]] std::optional<Checkpoint> read_checkpoint(const std::string& path, const CheckpointOf& wanted);

}  // namespace cumulet::demo
