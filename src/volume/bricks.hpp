#pragma once

// Access to a ScalarVolume by brick.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>

#include "volume/volume.hpp"

namespace cumulet::volume {

/// Returns the 512 values of the brick at this origin, possibly in `room`; null if there is no such brick. O(log
/// bricks).
const float* find_brick(const ScalarVolume& volume, const glm::ivec3& origin, BrickValues::Brick& room);

/// Fills the 512 values of a brick that the volume does not store, from tiles and the background. tiles: indices into
/// volume.tiles, including all that overlap the brick.
void fill_brick(const ScalarVolume& volume, const glm::ivec3& origin, std::span<const std::uint32_t> tiles, float* out);

/// Returns the number of voxels in a box, both ends inclusive; 0 if it is empty. Sides are at most 2^20.
std::int64_t voxels_between(const glm::ivec3& low, const glm::ivec3& high);
std::int64_t voxels_of(const Tile& tile);
/// Returns the number of voxels within bounds that no brick and no tile covers. O(bricks + tiles).
std::int64_t background_voxels(const ScalarVolume& volume);

/// Makes a volume of GPU-resident bricks. bricks: tidy.
ScalarVolume volume_on_device(DeviceBricksPtr bricks, std::string name, const glm::dmat4& index_to_world);

}  // namespace cumulet::volume
