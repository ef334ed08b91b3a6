#include "nano_grid.hpp"

#include <nanovdb/util/GridBuilder.h>

#include <algorithm>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <optional>
#include <stdexcept>
#include <type_traits>

#include "grid/statistics.hpp"

namespace cumulet::bench {

namespace {

using glm::ivec3;

constexpr int widest_log2 = 12;  // one upper node

float stored(float value, float scale) { return glm::unpackHalf1x16(glm::packHalf1x16(value * scale)); }

template <class Accessor>
void set_brick(Accessor& accessor, const grid::Statistics& statistics, const ivec3& corner, const ivec3& low,
               const ivec3& high, float scale) {
  const grid::Statistics::Node& node = statistics.node_at(corner);
  if (node.is_uniform() && node.uniform == 0.0F) return;
  volume::BrickValues::Brick room;
  const float* values = node.is_uniform() ? nullptr : statistics.values(node, room);
  for (int i = 0; i < volume::brick_voxels; ++i) {
    const ivec3 p = corner + ivec3(i / 64, (i / 8) % 8, i % 8);
    if (glm::any(glm::lessThan(p, low)) || glm::any(glm::greaterThan(p, high))) continue;
    const float value = stored(values == nullptr ? node.uniform : values[i], scale);
    if (value != 0.0F) accessor.setValue(nanovdb::Coord(p.x, p.y, p.z), value);
  }
}

/// Returns the maximum of the cells in a brick, over the voxels at their corners.
float most_between(const grid::Statistics& between, const ivec3& corner) {
  const grid::Statistics::Node& node = between.node_at(corner);
  if (node.is_uniform()) return node.uniform;
  float most = 0.0F;
  for (std::uint32_t i = 0; i < 6; ++i) most = std::max(most, between.kuhn(node, i).max);
  return most;
}

/// Adds leaves without nonzero voxels where cells are not empty.
template <class Accessor>
void add_borders(Accessor& accessor, const grid::Statistics& between, const ivec3& low, const ivec3& high) {
  const ivec3 first = (low - 1) & ~7;
  for (int x = first.x; x <= high.x; x += volume::brick_size) {
    for (int y = first.y; y <= high.y; y += volume::brick_size) {
      for (int z = first.z; z <= high.z; z += volume::brick_size) {
        const nanovdb::Coord corner(x, y, z);
        if (most_between(between, {x, y, z}) > 0.0F && accessor.getValue(corner) == 0.0F)
          accessor.setValue(corner, 0.0F);
      }
    }
  }
}

/// Replaces the maxima of voxels by those of cells.
void set_maxima(nanovdb::FloatGrid& grid, const grid::Statistics& between, float scale) {
  auto& tree = grid.tree();
  auto* leaf = tree.getFirstLeaf();
  for (std::uint32_t i = 0; i < tree.nodeCount(0); ++i, ++leaf) {
    const nanovdb::Coord corner = leaf->origin();
    leaf->data()->setMax(stored(most_between(between, {corner[0], corner[1], corner[2]}), scale));
  }
  auto* lower = tree.getFirstLower();
  for (std::uint32_t i = 0; i < tree.nodeCount(1); ++i, ++lower) {
    float most = 0.0F;
    for (auto child = lower->beginChild(); child; ++child) most = std::max(most, child->maximum());
    lower->data()->setMax(most);
  }
}

template <class BuildType, class Oracle = nanovdb::AbsDiff>
std::vector<std::uint32_t> words_of(const volume::ScalarVolume& volume, grid::Interpolation interpolation,
                                    const Oracle& oracle = {}) {
  grid::Cube cube = grid::fit_cube(volume, interpolation);
  cube.interpolation = grid::Interpolation::nearest;  // voxels, at the places of the interpolated cube
  const grid::Statistics statistics(volume, cube);
  if (statistics.cube().log2_size > widest_log2) throw std::runtime_error("the NanoVDB march: wider than 4096 voxels");
  const ivec3 low = volume.bounds_min - statistics.cube().origin;
  const ivec3 high = volume.bounds_max - statistics.cube().origin;
  nanovdb::GridBuilder<float, BuildType> builder(0.0F, nanovdb::GridClass::FogVolume);
  auto accessor = builder.getAccessor();
  const float scale = volume.max_value > 0.0F ? 1.0F / volume.max_value : 1.0F;
  for (int x = low.x & ~7; x <= high.x; x += volume::brick_size) {
    for (int y = low.y & ~7; y <= high.y; y += volume::brick_size) {
      for (int z = low.z & ~7; z <= high.z; z += volume::brick_size)
        set_brick(accessor, statistics, {x, y, z}, low, high, scale);
    }
  }
  std::optional<grid::Statistics> between;
  if (interpolation == grid::Interpolation::linear) {
    between.emplace(volume, grid::fit_cube(volume, interpolation));
    add_borders(accessor, *between, low, high);
  }
  auto handle = builder.getHandle(1.0, nanovdb::Vec3d(0.0), "density", oracle);
  if constexpr (std::is_same_v<BuildType, float>) {
    if (between) set_maxima(*handle.template grid<float>(), *between, scale);
  } else {
    if (between) throw std::runtime_error("the NanoVDB march interpolates only floats");
  }
  const auto* grid = handle.template grid<BuildType>();
  const auto* root = reinterpret_cast<const std::uint8_t*>(&grid->tree().root());
  if (root - handle.data() != sizeof(nanovdb::GridData) + sizeof(nanovdb::TreeData<>))
    throw std::runtime_error("the NanoVDB march: the root is not where march_hdda.glsl has it");
  std::vector<std::uint32_t> words(handle.size() / sizeof(std::uint32_t));
  std::memcpy(words.data(), handle.data(), words.size() * sizeof(std::uint32_t));
  return words;
}

}  // namespace

std::vector<std::uint32_t> make_nano_grid(const volume::ScalarVolume& volume, NanoType type,
                                          grid::Interpolation interpolation) {
  switch (type) {
    case NanoType::fp16:
      return words_of<nanovdb::Fp16>(volume, interpolation);
    case NanoType::fpn:
      return words_of<nanovdb::FpN>(volume, interpolation, nanovdb::AbsDiff(0.0005F));
    case NanoType::float32:
      break;
  }
  return words_of<float>(volume, interpolation);
}

}  // namespace cumulet::bench
