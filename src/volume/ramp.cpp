#include "volume/ramp.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstdint>

#include "base/progress_part.hpp"

namespace cumulet::volume {

float Ramp::operator()(float value) const {
  if (points_.empty() || value == 0.0F) return value;
  const auto above = std::ranges::upper_bound(points_, value, {}, &glm::vec2::x);
  if (above == points_.begin()) return points_.front().y;
  if (above == points_.end()) return points_.back().y;
  const glm::dvec2 a = *(above - 1);
  const glm::dvec2 b = *above;
  return static_cast<float>(a.y + (b.y - a.y) * ((double{value} - a.x) / (b.x - a.x)));
}

namespace {

/// Of a box, both ends inclusive.
std::int64_t voxels(const glm::ivec3& low, const glm::ivec3& high) {
  const glm::i64vec3 size = glm::max(glm::i64vec3(high) - glm::i64vec3(low) + std::int64_t{1}, glm::i64vec3(0));
  return size.x * size.y * size.z;
}

/// Whether a voxel within bounds has the background value, for lack of another.
bool shows_background(const ScalarVolume& volume) {
  std::int64_t left = voxels(volume.bounds_min, volume.bounds_max);
  for (const Tile& tile : volume.tiles) left -= voxels(tile.min, tile.max);
  for (const glm::ivec3& origin : volume.brick_origins)
    left -= voxels(glm::max(origin, volume.bounds_min), glm::min(origin + (brick_size - 1), volume.bounds_max));
  return left > 0;
}

}  // namespace

ScalarVolume apply(const Ramp& ramp, const ScalarVolume& volume, const Progress* progress) {
  ScalarVolume out;
  out.name = volume.name;
  out.index_to_world = volume.index_to_world;
  out.bounds_min = volume.bounds_min;
  out.bounds_max = volume.bounds_max;
  out.background = ramp(volume.background);
  out.active_voxels = volume.active_voxels;
  out.brick_origins = volume.brick_origins;
  out.tiles = volume.tiles;
  out.negative_voxels = volume.negative_voxels;
  out.non_finite_voxels = volume.non_finite_voxels;
  for (Tile& tile : out.tiles) tile.value = ramp(tile.value);

  resize(out.brick_values, volume.brick_values.size(), progress);
  out.max_value = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, out.brick_values.size(), 64 * brick_voxels),
      shows_background(volume) ? out.background : 0.0F,
      [&](const auto& range, float most) {
        check(progress);
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          out.brick_values[i] = ramp(volume.brick_values[i]);
          most = std::max(most, out.brick_values[i]);
        }
        return most;
      },
      [](float a, float b) { return std::max(a, b); });
  for (const Tile& tile : out.tiles) out.max_value = std::max(out.max_value, tile.value);
  std::erase_if(out.tiles, [&](const Tile& tile) { return tile.value == out.background; });
  return out;
}

}  // namespace cumulet::volume
