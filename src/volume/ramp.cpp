#include "volume/ramp.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/progress_part.hpp"
#include "volume/bricks.hpp"

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

glm::vec3 ColorRamp::operator()(float value) const {
  if (stops_.empty()) return glm::vec3(1.0F);
  const auto above = std::ranges::upper_bound(stops_, value, {}, &glm::vec4::x);
  const auto color = [](const glm::vec4& stop) { return glm::vec3(stop.y, stop.z, stop.w); };
  if (above == stops_.begin()) return color(stops_.front());
  if (above == stops_.end()) return color(stops_.back());
  const glm::vec4& a = *(above - 1);
  const glm::vec4& b = *above;
  const double along = (double{value} - double{a.x}) / (double{b.x} - double{a.x});
  return {glm::mix(glm::dvec3(color(a)), glm::dvec3(color(b)), along)};
}

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
  out.huge_voxels = volume.huge_voxels;
  for (Tile& tile : out.tiles) tile.value = ramp(tile.value);

  std::vector<float> values;
  resize(values, volume.brick_values.size(), progress);
  out.max_value = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, values.size(), 64 * brick_voxels),
      background_voxels(volume) > 0 ? out.background : 0.0F,
      [&](const auto& range, float most) {
        check(progress);
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
          values[i] = ramp(volume.brick_values[i]);
          most = std::max(most, values[i]);
        }
        return most;
      },
      [](float a, float b) { return std::max(a, b); });
  out.brick_values = std::move(values);
  for (const Tile& tile : out.tiles) out.max_value = std::max(out.max_value, tile.value);
  std::erase_if(out.tiles, [&](const Tile& tile) { return tile.value == out.background; });
  return out;
}

}  // namespace cumulet::volume
