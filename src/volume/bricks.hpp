#pragma once

// A ScalarVolume's values, brick by brick.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "volume/volume.hpp"

namespace cumulet::volume {

/// The order of brick_origins: by x, then y, then z.
bool lexicographic(const glm::ivec3& a, const glm::ivec3& b);

/// The 512 values of the brick at this origin, which may be in `room`; null where the volume has none. O(log bricks).
const float* find_brick(const ScalarVolume& volume, const glm::ivec3& origin, BrickValues::Brick& room);

/// What tiles and the background give the voxels of a brick at this origin that the volume has not: 512 values.
/// tiles: places in volume.tiles, all that meet it among them.
void fill_brick(const ScalarVolume& volume, const glm::ivec3& origin, std::span<const std::uint32_t> tiles, float* out);

/// Of a box, both ends inclusive; none where an end is below the other. No side may be longer than 2^20.
std::int64_t voxels_between(const glm::ivec3& low, const glm::ivec3& high);
std::int64_t voxels_of(const Tile& tile);
/// How many voxels within bounds have the background value, being in no brick and no tile. O(bricks + tiles).
std::int64_t background_voxels(const ScalarVolume& volume);

}  // namespace cumulet::volume
