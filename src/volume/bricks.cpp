#include "volume/bricks.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

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

ScalarVolume volume_on_device(DeviceBricksPtr bricks, std::string name, const glm::dmat4& index_to_world) {
  ScalarVolume volume;
  volume.name = std::move(name);
  volume.index_to_world = index_to_world;
  volume.bounds_max = glm::ivec3(0);
  if (!bricks->origins.empty()) {
    volume.bounds_min = glm::ivec3(std::numeric_limits<int>::max());
    volume.bounds_max = glm::ivec3(std::numeric_limits<int>::min());
  }
  for (std::size_t i = 0; i < bricks->origins.size(); ++i) {
    const BrickSummary& s = bricks->summary(i);
    const auto corner = [&](unsigned from) {
      return bricks->origins[i] +
             glm::ivec3((s.box >> from) & 7U, (s.box >> (from + 3)) & 7U, (s.box >> (from + 6)) & 7U);
    };
    volume.bounds_min = glm::min(volume.bounds_min, corner(0));
    volume.bounds_max = glm::max(volume.bounds_max, corner(9));
    volume.active_voxels += s.voxels & CM_BRICK_VOXELS;
    volume.huge_voxels += huge_voxels_of(s);
    for (std::size_t cell = 0; cell < 6; ++cell) volume.max_value = std::max(volume.max_value, s.cells[7 * cell + 6]);
  }
  volume.huge_voxels += bricks->huge_voxels;
  volume.brick_origins = bricks->origins;
  volume.on_device = std::move(bricks);
  return volume;
}

}  // namespace cumulet::volume
