#include "grid/transmittance.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "base/progress_part.hpp"
#include "volume/bricks.hpp"

namespace cumulet::grid {

namespace {

using glm::ivec3;

// Index of a non-uniform node. Bricks come first, in the order of nodes_of_size(3).
std::size_t index_of(const Statistics::Node& node) { return node.moments / 6; }

// Index of a block by its position along an axis and across it.
std::size_t block_at(int axis, int along, int u, int v) {
  ivec3 block;
  block[axis] = along;
  block[(axis + 1) % 3] = u;
  block[(axis + 2) % 3] = v;
  const int index = (block.x * 4 + block.y) * 4 + block.z;
  return static_cast<std::size_t>(index);
}

}  // namespace

Transmittance::Transmittance(const Statistics& statistics, double extinction, const Progress* progress)
    : statistics_(&statistics) {
  for (int axis = 0; axis < 3; ++axis) {
    voxel_depth_[axis] = static_cast<float>(extinction * glm::length(glm::dvec3(statistics.cube().to_world[axis])));
  }
  sum_blocks(progress);
  resize(transmittance_, sums_.size(), progress, 0.0F);
  for (int axis = 0; axis < 3; ++axis) sweep(axis, progress);
  sums_ = {};
  for (float& one : transmittance_) one = std::min(one / 3.0F, 1.0F);
  fill_pyramid();
}

const float* Transmittance::blocks(const ivec3& corner) const {
  const Statistics::Node& node = statistics_->node_at(corner);
  return node.values < 0 ? nullptr : transmittance_.data() + index_of(node) * blocks_per_brick;
}

float Transmittance::most(const ivec3& corner, int log2_size) const {
  const Statistics::Node& node = statistics_->node_at(corner, log2_size);
  return node.is_uniform() ? 1.0F : most_[index_of(node)];
}

void Transmittance::sum_blocks(const Progress* progress) {
  const auto& bricks = statistics_->nodes_of_size(3);
  resize(sums_, bricks.size() * blocks_per_brick, progress, 0.0F);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size(), 64), [&](const auto& range) {
    check(progress);
    volume::BrickValues::Brick room;
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Statistics::Node& brick = statistics_->nodes()[bricks[i]];
      float* sums = sums_.data() + i * blocks_per_brick;
      if (const volume::BrickSummary* known = statistics_->summary(brick)) {
        std::ranges::copy(known->blocks, sums);
        continue;
      }
      const float* values = statistics_->values(brick, room);
      for (unsigned v = 0; v < volume::brick_voxels; ++v) sums[volume::block_of_voxel(v)] += values[v];
    }
  });
}

void Transmittance::sweep(int axis, const Progress* progress) {
  std::vector<ivec3> columns;  // corner of each column on the cube's face
  for (const std::uint32_t n : statistics_->nodes_of_size(3)) {
    columns.push_back(statistics_->nodes()[n].corner);
    columns.back()[axis] = 0;
  }
  std::ranges::sort(columns, volume::lexicographic);
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  tbb::parallel_for(std::size_t{0}, columns.size(), [&](std::size_t i) {
    check(progress);
    sweep_column(axis, columns[i]);
  });
}

void Transmittance::sweep_column(int axis, ivec3 at) {
  // Optical depth in front of a brick, for each of its 4 x 4 rows of blocks.
  struct Passed {
    std::size_t brick;
    std::array<float, 16> before;
  };
  std::vector<Passed> bricks;
  std::array<float, 16> depth{};
  const float to_depth = 0.25F * voxel_depth_[axis];  // from a block's sum: a block has four rows of voxels
  while (at[axis] < statistics_->cube().size()) {
    const Statistics::Node& node = statistics_->node_at(at);
    at[axis] = node.corner[axis] + (1 << node.log2_size);
    if (node.is_uniform()) {
      const float all = node.uniform * voxel_depth_[axis] * static_cast<float>(1 << node.log2_size);
      for (float& row : depth) row += all;
      continue;
    }
    bricks.push_back({index_of(node), depth});
    const float* sums = sums_.data() + index_of(node) * blocks_per_brick;
    for (int row = 0; row < 16; ++row) {
      for (int along = 0; along < 4; ++along)
        depth[static_cast<std::size_t>(row)] += to_depth * sums[block_at(axis, along, row / 4, row % 4)];
    }
  }
  for (const Passed& passed : bricks) {
    const std::size_t first = passed.brick * blocks_per_brick;
    for (int row = 0; row < 16; ++row) {
      float before = passed.before[static_cast<std::size_t>(row)];
      for (int along = 0; along < 4; ++along) {
        const std::size_t block = first + block_at(axis, along, row / 4, row % 4);
        const float behind = before + to_depth * sums_[block];
        const float after = std::max(0.0F, depth[static_cast<std::size_t>(row)] - behind);
        transmittance_[block] += 1.0F / (1.0F + before) + 1.0F / (1.0F + after);
        before = behind;
      }
    }
  }
}

void Transmittance::fill_pyramid() {
  std::size_t nodes = 0;
  for (int size = 3; size <= statistics_->cube().log2_size; ++size) nodes += statistics_->nodes_of_size(size).size();
  most_.resize(nodes, 0.0F);
  for (std::size_t i = 0; i < statistics_->nodes_of_size(3).size(); ++i) {
    const auto first = transmittance_.begin() + static_cast<std::ptrdiff_t>(i * blocks_per_brick);
    most_[i] = *std::max_element(first, first + blocks_per_brick);
  }
  for (int size = 4; size <= statistics_->cube().log2_size; ++size) {
    for (const std::uint32_t n : statistics_->nodes_of_size(size)) {
      const Statistics::Node& node = statistics_->nodes()[n];
      for (std::uint32_t i = 0; i < 8; ++i) {
        const Statistics::Node& child = statistics_->nodes()[node.child + i];
        if (!child.is_uniform()) most_[index_of(node)] = std::max(most_[index_of(node)], most_[index_of(child)]);
      }
    }
  }
}

void BrickTransmittance::compute(const float* blocks, const BrickTree& tree) {
  for (unsigned i = 0; i < 512; ++i) most[512 + i] = blocks[volume::block_of_voxel(tree.voxel[i])];
  for (unsigned h = 511; h >= 1; --h) most[h] = std::max(most[2 * h], most[2 * h + 1]);
}

}  // namespace cumulet::grid
