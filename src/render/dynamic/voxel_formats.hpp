#pragma once

// Packed voxels of a host's formats.

#include <cstddef>
#include <glm/glm.hpp>
#include <span>

#include "render/dynamic/brick_kernels.hpp"
#include "volume/bricks.hpp"

namespace cumulet::render {

[[nodiscard]] std::size_t bytes_of(VoxelFormat format);
[[nodiscard]] std::size_t brick_bytes(VoxelFormat format);
/// Converts a packed brick to floats.
void unpack(VoxelFormat format, const std::byte* from, std::span<float, volume::brick_voxels> to);

/// Returns the number of bricks per axis.
[[nodiscard]] inline glm::ivec3 bricks_of(glm::ivec3 size) { return (size - 1) / volume::brick_size + 1; }

}  // namespace cumulet::render
