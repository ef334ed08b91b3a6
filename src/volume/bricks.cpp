#include "volume/bricks.hpp"

#include <algorithm>
#include <cstddef>
#include <tuple>

namespace cumulet::volume {

namespace {

// Both ends are inclusive.
bool holds(const glm::ivec3& low, const glm::ivec3& high, const glm::ivec3& p) {
  return glm::all(glm::greaterThanEqual(p, low)) && glm::all(glm::lessThanEqual(p, high));
}

}  // namespace

std::int64_t voxels_between(const glm::ivec3& low, const glm::ivec3& high) {
  const glm::i64vec3 size = glm::max(glm::i64vec3(high) - glm::i64vec3(low) + std::int64_t{1}, glm::i64vec3(0));
  return size.x * size.y * size.z;
}

bool lexicographic(const glm::ivec3& a, const glm::ivec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

const float* find_brick(const ScalarVolume& volume, const glm::ivec3& origin, BrickValues::Brick& room) {
  const auto found = std::ranges::lower_bound(volume.brick_origins, origin, lexicographic);
  if (found == volume.brick_origins.end() || *found != origin) return nullptr;
  return volume.brick_values.brick(static_cast<std::size_t>(found - volume.brick_origins.begin()), room);
}

void fill_brick(const ScalarVolume& volume, const glm::ivec3& origin, std::span<const std::uint32_t> tiles,
                float* out) {
  for (int v = 0; v < brick_voxels; ++v) {
    const glm::ivec3 p = origin + glm::ivec3(v / 64, (v / 8) % 8, v % 8);
    float value = volume.background;
    for (const std::uint32_t t : tiles) {
      if (holds(volume.tiles[t].min, volume.tiles[t].max, p)) value = volume.tiles[t].value;
    }
    out[v] = holds(volume.bounds_min, volume.bounds_max, p) ? value : 0.0F;
  }
}

std::int64_t voxels_of(const Tile& tile) { return voxels_between(tile.min, tile.max); }

std::int64_t background_voxels(const ScalarVolume& volume) {
  std::int64_t left = voxels_between(volume.bounds_min, volume.bounds_max);
  for (const Tile& tile : volume.tiles) left -= voxels_of(tile);
  for (const glm::ivec3& origin : volume.brick_origins)
    left -= voxels_between(glm::max(origin, volume.bounds_min), glm::min(origin + (brick_size - 1), volume.bounds_max));
  return left;
}

}  // namespace cumulet::volume
