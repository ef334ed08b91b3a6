#include "nano_grid.hpp"

#include <nanovdb/util/GridBuilder.h>

#include <cstring>
#include <glm/gtc/packing.hpp>
#include <stdexcept>

#include "grid/statistics.hpp"

namespace cumulet::bench {

namespace {

using glm::ivec3;

constexpr int widest_log2 = 12;  // one upper node

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
    const float value = glm::unpackHalf1x16(glm::packHalf1x16((values == nullptr ? node.uniform : values[i]) * scale));
    if (value != 0.0F) accessor.setValue(nanovdb::Coord(p.x, p.y, p.z), value);
  }
}

template <class BuildType, class Oracle = nanovdb::AbsDiff>
std::vector<std::uint32_t> words_of(const volume::ScalarVolume& volume, const Oracle& oracle = {}) {
  const grid::Statistics statistics(volume, grid::fit_cube(volume));
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
  const auto handle = builder.getHandle(1.0, nanovdb::Vec3d(0.0), "density", oracle);
  const auto* grid = handle.template grid<BuildType>();
  const auto* root = reinterpret_cast<const std::uint8_t*>(&grid->tree().root());
  if (root - handle.data() != sizeof(nanovdb::GridData) + sizeof(nanovdb::TreeData<>))
    throw std::runtime_error("the NanoVDB march: the root is not where march_hdda.glsl has it");
  std::vector<std::uint32_t> words(handle.size() / sizeof(std::uint32_t));
  std::memcpy(words.data(), handle.data(), words.size() * sizeof(std::uint32_t));
  return words;
}

}  // namespace

std::vector<std::uint32_t> make_nano_grid(const volume::ScalarVolume& volume, NanoType type) {
  switch (type) {
    case NanoType::fp16:
      return words_of<nanovdb::Fp16>(volume);
    case NanoType::fpn:
      return words_of<nanovdb::FpN>(volume, nanovdb::AbsDiff(0.0005F));
    case NanoType::float32:
      break;
  }
  return words_of<float>(volume);
}

}  // namespace cumulet::bench
