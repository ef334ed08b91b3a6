#include "scene/march_source.hpp"

#include <algorithm>
#include <array>
#include <glm/gtc/packing.hpp>
#include <string>
#include <unordered_map>
#include <utility>

#include "base/error.hpp"
#include "grid/brick_voxels.hpp"

namespace cumulet::scene {

namespace {

using glm::ivec3;

// Half the change of a brick's values between shutter open and close.
class BrickChange {
 public:
  BrickChange(const grid::DensityEnds* ends, float scale) : ends_(ends), scale_(0.5F * scale) {}
  // Looks up the brick at this corner. Returns whether its values change.
  bool look_up(const ivec3& corner) {
    if (ends_ == nullptr) return false;
    open_.look_up(ends_->open.statistics(), corner);
    close_.look_up(ends_->close.statistics(), corner);
    return !open_.uniform() || open_.uniform() != close_.uniform();
  }
  [[nodiscard]] float operator[](int i) const { return scale_ * (close_[i] - open_[i]); }

 private:
  const grid::DensityEnds* ends_;
  float scale_;
  grid::BrickVoxels open_;
  grid::BrickVoxels close_;
};

int voxels_per_slot(const MarchSource& source) {
  const int side = source.brick_side();
  return side * side * side;
}

// Appends a brick.
void add_brick(MarchSource& source, const grid::BrickVoxels& voxels, const BrickChange* change) {
  const float scale = source.density_a_value();
  for (int i = 0; i < voxels_per_slot(source); ++i) {
    source.brick_values.push_back(glm::packHalf1x16(voxels[i] * scale));
    if (source.channels.ends)
      source.brick_changes.push_back(glm::packHalf1x16(change != nullptr ? (*change)[i] : 0.0F));
  }
}

// Brick traversal stores voxel coordinates in 16 bits per axis, and a table of all bricks in the box.
void require_table(const ivec3& end, const ivec3& bricks) {
  constexpr int max_voxels = 1 << 16;
  constexpr std::int64_t max_bricks = std::int64_t{1} << 28U;
  if (const int widest = std::max({end.x, end.y, end.z}); widest > max_voxels) {
    throw Error(ErrorCode::unsupported,
                "the brick grid for " + std::to_string(widest) + " voxels: the limit is " + std::to_string(max_voxels));
  }
  if (const std::int64_t all = std::int64_t{bricks.x} * bricks.y * bricks.z; all > max_bricks) {
    throw Error(ErrorCode::unsupported, "the brick grid for a box of " + std::to_string(all) +
                                            " bricks: the limit is " + std::to_string(max_bricks));
  }
}

void pack_bricks(MarchSource& source) {
  const grid::Statistics& statistics = *source.statistics;
  const ivec3 first = source.box_low >> 3;
  source.brick_count = ((source.box_low + source.box_size + 7) >> 3) - first;
  require_table(source.box_low + source.box_size, source.brick_count);
  constexpr std::uint32_t empty = 0xfffffffeU;
  std::unordered_map<float, std::uint32_t> uniform_slots;
  std::uint32_t count = 0;
  grid::BrickVoxels voxels;
  BrickChange change(source.channels.ends.get(), source.density_a_value());
  const auto pack = [&](const ivec3& corner) {
    voxels.look_up(statistics, corner);
    const bool dark = !source.channels.emission || source.channels.emission->is_zero(corner);
    const bool changes = change.look_up(corner);
    if (voxels.uniform() == 0.0F && dark) return source.brick_slots.push_back(empty);
    if (voxels.uniform() && !changes) {
      const auto [found, added] = uniform_slots.emplace(*voxels.uniform(), count);
      source.brick_slots.push_back(found->second);
      if (!added) return;
    } else {
      source.brick_slots.push_back(count);
    }
    ++count;
    add_brick(source, voxels, changes ? &change : nullptr);
  };
  for (int z = 0; z < source.brick_count.z; ++z) {
    for (int y = 0; y < source.brick_count.y; ++y) {
      for (int x = 0; x < source.brick_count.x; ++x) pack((first + ivec3(x, y, z)) * 8);
    }
  }
  if (source.brick_values.empty()) source.brick_values.resize(static_cast<std::size_t>(voxels_per_slot(source)));
  if (source.channels.ends) source.brick_changes.resize(source.brick_values.size());
}

}  // namespace

MarchSource make_tet_source(std::shared_ptr<const grid::TetGrid> grid, bool linear, float max_value,
                            const Progress* progress) {
  MarchSource source;
  source.cube = grid->cube;
  source.max_value = max_value;
  source.emissive = emissive_table(*grid, progress);
  source.trilinear = !grid->corners.empty();
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
  source.linear = grid::has_fits(plan.lattice->cells);
  source.trilinear = plan.lattice->has_corners();
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
  source.linear = statistics->interpolates();
  ivec3 low = volume->bounds_min;
  ivec3 high = volume->bounds_max;
  if (volume->empty()) low = high = source.cube.origin;
  if (const grid::RgbField* emission = channels.emission.get()) {
    low = volume->empty() ? emission->bounds_min() : glm::min(low, emission->bounds_min());
    high = volume->empty() ? emission->bounds_max() : glm::max(high, emission->bounds_max());
  }
  // The field falls to 0 within a voxel. The emission's bounds are those of whole bricks, which may end at the cube.
  if (source.linear) low = glm::max(low - 1, source.cube.origin);
  source.box_low = low - source.cube.origin;
  source.box_size = high - low + 1;
  source.channels = std::move(channels);
  source.volume = std::move(volume);
  source.statistics = std::move(statistics);
  if (march == March::brick) pack_bricks(source);
  return source;
}

}  // namespace cumulet::scene
