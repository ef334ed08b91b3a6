#include "scene/march_source.hpp"

#include <glm/gtc/packing.hpp>
#include <unordered_map>
#include <utility>

namespace cumulet::scene {

namespace {

using glm::ivec3;

void pack_bricks(MarchSource& source) {
  const grid::Statistics& statistics = *source.statistics;
  const ivec3 first = source.box_low >> 3;
  source.brick_count = ((source.box_low + source.box_size + 7) >> 3) - first;
  constexpr std::uint32_t empty = 0xfffffffeU;
  std::unordered_map<float, std::uint32_t> uniform_slots;
  const float scale = source.density_a_value();
  std::uint32_t count = 0;
  volume::BrickValues::Brick room;
  for (int z = 0; z < source.brick_count.z; ++z) {
    for (int y = 0; y < source.brick_count.y; ++y) {
      for (int x = 0; x < source.brick_count.x; ++x) {
        const grid::Statistics::Node& node = statistics.node_at((first + ivec3(x, y, z)) * 8);
        const bool dark = !source.channels.emission || source.channels.emission->is_zero((first + ivec3(x, y, z)) * 8);
        if (node.is_uniform() && node.uniform == 0.0F && dark) {
          source.brick_slots.push_back(empty);
          continue;
        }
        if (node.is_uniform()) {
          const auto [found, added] = uniform_slots.emplace(node.uniform, count);
          source.brick_slots.push_back(found->second);
          if (!added) continue;
        } else {
          source.brick_slots.push_back(count);
        }
        ++count;
        const float* values = node.is_uniform() ? nullptr : statistics.values(node, room);
        for (int i = 0; i < volume::brick_voxels; ++i) {
          source.brick_values.push_back(glm::packHalf1x16((values == nullptr ? node.uniform : values[i]) * scale));
        }
      }
    }
  }
  if (source.brick_values.empty()) source.brick_values.resize(volume::brick_voxels);
}

}  // namespace

MarchSource make_tet_source(std::shared_ptr<const grid::TetGrid> grid, bool linear, float max_value,
                            const Progress* progress) {
  MarchSource source;
  source.cube = grid->cube;
  source.max_value = max_value;
  source.glow = glow_table(*grid, progress);
  source.grid = std::move(grid);
  source.linear = linear;
  return source;
}

MarchSource make_planned_source(GridPlan plan, std::shared_ptr<const volume::ScalarVolume> volume,
                                std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels) {
  MarchSource source;
  source.cube = statistics->cube();
  source.channels = std::move(channels);
  source.max_value = volume->max_value;
  source.linear = plan.lattice->cells == grid::CellKind::linear;
  source.plan = std::make_shared<const GridPlan>(std::move(plan));
  source.volume = std::move(volume);
  source.statistics = std::move(statistics);
  return source;
}

MarchSource make_voxel_source(March march, std::shared_ptr<const volume::ScalarVolume> volume,
                              std::shared_ptr<const grid::Statistics> statistics, grid::Channels channels) {
  MarchSource source;
  source.march = march;
  source.cube = statistics->cube();
  source.max_value = volume->max_value;
  ivec3 low = volume->bounds_min;
  ivec3 high = volume->bounds_max;
  if (volume->empty()) low = high = source.cube.origin;
  if (const grid::RgbField* emission = channels.emission.get()) {
    low = volume->empty() ? emission->bounds_min() : glm::min(low, emission->bounds_min());
    high = volume->empty() ? emission->bounds_max() : glm::max(high, emission->bounds_max());
  }
  source.box_low = low - source.cube.origin;
  source.box_size = high - low + 1;
  source.channels = std::move(channels);
  source.volume = std::move(volume);
  source.statistics = std::move(statistics);
  if (march == March::brick) pack_bricks(source);
  return source;
}

}  // namespace cumulet::scene
