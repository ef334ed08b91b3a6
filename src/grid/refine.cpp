#include "grid/refine.hpp"

#include <tbb/blocked_range.h>
#include <tbb/combinable.h>
#include <tbb/concurrent_unordered_map.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/evaluation.hpp"
#include "grid/priorities.hpp"
#include "grid/view_levels.hpp"

namespace cumulet::grid {

using glm::ivec3;

// Priorities of 8^3 lattice points. Octaves 3m to 3m + 2 of h share the lattice of spacing 8^m.
struct DiamondSet::Block {
  int scale = 0;
  ivec3 corner{0};  // in units of 8 lattice points
  std::array<std::atomic<std::uint16_t>, 512> priority{};
};

namespace {

struct Address {
  std::uint64_t key;
  unsigned local;
  int scale;
  ivec3 corner;
};

Address address_of(const ivec3& vertex) {
  const int scale = static_cast<int>(core::cm_octave(vertex)) / 3;
  const ivec3 lattice = vertex >> (3 * scale);
  const ivec3 corner = lattice >> 3;
  const std::uint64_t key = (std::uint64_t(scale) << 60U) | (std::uint64_t(std::uint32_t(corner.x)) << 40U) |
                            (std::uint64_t(std::uint32_t(corner.y)) << 20U) | std::uint32_t(corner.z);
  return {key, core::cm_in_block(lattice), scale, corner};
}

// Keys differ in few bits; the map's buckets need all of them mixed (MurmurHash3's finalizer).
struct Hash {
  std::size_t operator()(std::uint64_t key) const {
    key = (key ^ (key >> 33U)) * 0xff51afd7ed558ccdULL;
    key = (key ^ (key >> 33U)) * 0xc4ceb9fe1a85ec53ULL;
    return key ^ (key >> 33U);
  }
};

}  // namespace

struct DiamondSet::Blocks {
  tbb::concurrent_unordered_map<std::uint64_t, std::unique_ptr<Block>, Hash> by_key;
};

// Raises the priorities of vertices. Caches the last block.
class DiamondSet::Raiser {
 public:
  explicit Raiser(DiamondSet& set) : blocks_(set.blocks_.get()) {}
  void operator()(const ivec3& vertex, std::uint16_t priority);

 private:
  Blocks* blocks_;
  std::uint64_t key_ = ~std::uint64_t{0};
  Block* block_ = nullptr;
};

void DiamondSet::Raiser::operator()(const ivec3& vertex, std::uint16_t priority) {
  const Address a = address_of(vertex);
  if (a.key != key_) {
    auto found = blocks_->by_key.find(a.key);
    if (found == blocks_->by_key.end()) {
      auto block = std::make_unique<Block>();
      block->scale = a.scale;
      block->corner = a.corner;
      found = blocks_->by_key.emplace(a.key, std::move(block)).first;
    }
    key_ = a.key;
    block_ = found->second.get();
  }
  std::atomic<std::uint16_t>& slot = block_->priority[a.local];
  std::uint16_t old = slot.load(std::memory_order_relaxed);
  while (old < priority && !slot.compare_exchange_weak(old, priority, std::memory_order_relaxed)) {
  }
}

bool DiamondCursor::is_split(const ivec3& vertex) {
  const Address a = address_of(vertex);
  if (a.key != key_) {
    const auto& blocks = set_->blocks_->by_key;
    const auto found = blocks.find(a.key);
    key_ = a.key;
    block_ = found == blocks.end() ? nullptr : found->second.get();
  }
  return block_ != nullptr && block_->priority[a.local].load(std::memory_order_relaxed) >= set_->cut_;
}

namespace {

// Returns a lower bound for the threshold that max_cells will cause: the brick cells above it would exceed max_cells on
// their own. It is estimated from every 16th brick; the closure only adds cells. It avoids evaluating and storing cells
// that the limit removes anyway.
double estimate_floor(const Evaluation& evaluation, const ViewLevels& view, std::uint64_t max_cells,
                      double threshold_squared, const Progress* progress) {
  constexpr std::size_t stride = 16;
  const Statistics& statistics = evaluation.statistics();
  const auto& bricks = statistics.nodes_of_size(3);
  if (bricks.size() < 64 * stride) return threshold_squared;
  tbb::combinable<std::vector<std::uint64_t>> partial([] { return std::vector<std::uint64_t>(65536); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bricks.size() / stride, 4), [&](const auto& range) {
    check(progress);
    const auto sums = std::make_unique<BrickSums>();
    std::vector<std::uint64_t>& histogram = partial.local();
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Statistics::Node& node = statistics.nodes()[bricks[i * stride]];
      evaluation.node(node, view.in(node.corner, node.log2_size), *sums, static_cast<float>(threshold_squared),
                      [&](const ivec3& /*vertex*/, float squared) { ++histogram[quantize(squared)]; });
    }
  });
  std::vector<std::uint64_t> histogram(65536);
  partial.combine_each([&](const std::vector<std::uint64_t>& p) {
    for (std::size_t i = 0; i < histogram.size(); ++i) histogram[i] += p[i];
  });
  std::uint64_t cells = 0;
  for (std::size_t i = 0xffff; i > 0; --i) {
    cells += stride * histogram[i];
    if (cells > max_cells) {
      const auto bits = static_cast<std::uint32_t>(i) << 16U;
      return std::max(threshold_squared, 0.5 * double(std::bit_cast<float>(bits)));
    }
  }
  return threshold_squared;
}

}  // namespace

DiamondSet::DiamondSet(const Statistics& statistics, const Channels& channels, const RefineSettings& settings,
                       Progress* progress)
    : log2_size_(statistics.cube().log2_size), blocks_(std::make_unique<Blocks>()) {
  check(progress);
  const Evaluations evaluations(statistics, channels, settings, progress);
  const ViewLevels view(statistics.cube(), settings);
  const double threshold = std::max(settings.threshold, 0.0);
  double floor = 0.0;
  for (const Evaluation& evaluation : evaluations)
    floor = std::max(floor, estimate_floor(evaluation, view, settings.max_cells, threshold * threshold, progress));
  evaluate(evaluations, view, floor, progress, 0.02, 0.5);
  choose_cut(settings.max_cells, progress);
  if (!limited_ && floor > threshold * threshold) {
    // The estimate was too high.
    blocks_->by_key.clear();
    evaluate(evaluations, view, threshold * threshold, progress, 0.5, progress_part);
    choose_cut(settings.max_cells, progress);
  }
}

DiamondSet::DiamondSet(const OwnPriorities& own, std::span<const std::uint8_t> levels, std::uint64_t max_cells,
                       Progress* progress)
    : log2_size_(own.log2_size), blocks_(std::make_unique<Blocks>()) {
  ProgressPart part(progress, 0.0, 0.4, own.nodes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, own.nodes.size(), 64), [&](const auto& range) {
    Raiser raise(*this);
    for (std::size_t i = range.begin(); i != range.end(); ++i) own.for_each(own.nodes[i], levels[i], raise);
    part.add(range.size());
  });
  close(progress, 0.4, progress_part);
  choose_cut(max_cells, progress);
}

DiamondSet::DiamondSet(DiamondSet&&) noexcept = default;
DiamondSet& DiamondSet::operator=(DiamondSet&&) noexcept = default;
DiamondSet::~DiamondSet() = default;

std::vector<glm::uvec2> DiamondSet::blocks(const Progress* progress) const {
  std::vector<glm::uvec2> blocks;
  blocks.reserve(blocks_->by_key.size());
  for (const auto& [key, block] : blocks_->by_key) {
    if (blocks.size() % 1024 == 0) check(progress);
    const glm::uvec3 corner(block->corner);
    blocks.emplace_back(corner.x | (corner.y << 16U), corner.z | (static_cast<std::uint32_t>(block->scale) << 16U));
  }
  return blocks;
}

void DiamondSet::evaluate(const Evaluations& evaluations, const ViewLevels& view, double floor_squared,
                          Progress* progress, double from, double to) {
  std::uint64_t nodes = 0;
  for (const Evaluation& evaluation : evaluations) {
    for (int size = 3; size <= log2_size_; ++size) nodes += evaluation.statistics().nodes_of_size(size).size();
  }
  const double closing = from + 0.8 * (to - from);
  ProgressPart part(progress, from, closing, nodes);
  const auto floor = static_cast<float>(floor_squared);
  for (const Evaluation& evaluation : evaluations) {
    for (int size = 3; size <= log2_size_; ++size) evaluate(evaluation, view, size, floor, part);
  }
  close(progress, closing, to);
}

void DiamondSet::evaluate(const Evaluation& evaluation, const ViewLevels& view, int size, float floor,
                          ProgressPart& part) {
  const Statistics& statistics = evaluation.statistics();
  const auto& nodes = statistics.nodes_of_size(size);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nodes.size(), 16), [&](const auto& range) {
    const auto sums = std::make_unique<BrickSums>();
    Raiser raise(*this);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Statistics::Node& node = statistics.nodes()[nodes[i]];
      evaluation.node(node, view.in(node.corner, size), *sums, floor,
                      [&](const ivec3& vertex, float squared) { raise(vertex, quantize(squared)); });
    }
    part.add(range.size());
  });
}

std::vector<DiamondSet::Block*> DiamondSet::blocks_of(int scale, const Progress* progress) const {
  std::vector<Block*> blocks;
  for (const auto& [key, block] : blocks_->by_key) {
    check(progress);
    if (block->scale == scale) blocks.push_back(block.get());
  }
  return blocks;
}

void DiamondSet::close(Progress* progress, double from, double to) {
  ProgressPart part(progress, from, to, static_cast<std::uint64_t>(3 * log2_size_));
  // From the finest level up: edge middles (A), face middles (C), cube middles (B), then twice the spacing.
  for (int octave = 0; octave < log2_size_; ++octave) {
    for (int odd = 1; odd <= 3; ++odd) {
      if (octave == log2_size_ - 1) break;  // edges of the control cube: their cells are the roots
      close_octave(octave, odd, blocks_of(octave / 3, progress), progress);
      part.add(1);
    }
  }
}

void DiamondSet::close_octave(int octave, int odd_coordinates, const std::vector<Block*>& blocks,
                              const Progress* progress) {
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    check(progress);
    close_block(*blocks[b], octave, odd_coordinates);
  });
}

void DiamondSet::close_block(const Block& block, int octave, int odd_coordinates) {
  const int step = 1 << (octave % 3);
  Raiser raise(*this);
  for (int x = 0; x < 8; x += step) {
    for (int y = 0; y < 8; y += step) {
      for (int z = 0; z < 8; z += step) {
        const ivec3 local(x, y, z);
        const ivec3 odd = (local / step) & 1;
        if (odd.x + odd.y + odd.z != odd_coordinates) continue;
        const std::uint16_t priority =
            block.priority[static_cast<unsigned>(x * 64 + y * 8 + z)].load(std::memory_order_relaxed);
        if (priority == 0) continue;
        const ivec3 v = (block.corner * 8 + local) << (3 * block.scale);
        raise_parents(raise, v, odd, octave, priority);
      }
    }
  }
}

void DiamondSet::raise_parents(Raiser& raise, const ivec3& v, const ivec3& odd, int octave,
                               std::uint16_t priority) const {
  const int h = 1 << octave;
  if (odd == ivec3(1)) {
    // Cube middle: of its corners, low is a multiple of 4 h and high is the opposite one.
    ivec3 low;
    ivec3 high;
    for (int axis = 0; axis < 3; ++axis) {
      const bool even = ((v[axis] - h) & (4 * h - 1)) == 0;
      low[axis] = even ? v[axis] - h : v[axis] + h;
      high[axis] = even ? v[axis] + h : v[axis] - h;
    }
    raise({high.x, low.y, low.z}, priority);
    raise({low.x, high.y, low.z}, priority);
    raise({low.x, low.y, high.z}, priority);
    return;
  }
  const int size = 1 << log2_size_;
  for (int axis = 0; axis < 3; ++axis) {
    if (odd[axis] != 0) continue;
    for (const int offset : {h, -h}) {
      ivec3 parent = v;
      parent[axis] += offset;
      if (parent[axis] >= 0 && parent[axis] <= size) raise(parent, priority);
    }
  }
}

void DiamondSet::choose_cut(std::uint64_t max_cells, const Progress* progress) {
  // Histogram of the cells that each priority adds. Splitting a diamond adds one cell for each cell that it has.
  std::vector<Block*> blocks;
  blocks.reserve(blocks_->by_key.size());
  for (const auto& [key, block] : blocks_->by_key) blocks.push_back(block.get());
  tbb::combinable<std::vector<std::uint64_t>> partial([] { return std::vector<std::uint64_t>(65536); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size()), [&](const auto& range) {
    std::vector<std::uint64_t>& histogram = partial.local();
    for (std::size_t b = range.begin(); b != range.end(); ++b) {
      check(progress);
      const Block& block = *blocks[b];
      for (unsigned i = 0; i < 512; ++i) {
        const std::uint16_t priority = block.priority[i].load(std::memory_order_relaxed);
        if (priority == 0) continue;
        const ivec3 local(i / 64, (i / 8) % 8, i % 8);
        const ivec3 v = (block.corner * 8 + local) << (3 * block.scale);
        histogram[priority] += core::cm_cells_around(v, core::cm_octave(v), static_cast<std::uint32_t>(log2_size_));
      }
    }
  });
  std::vector<std::uint64_t> histogram(65536);
  partial.combine_each([&](const std::vector<std::uint64_t>& p) {
    for (std::size_t i = 0; i < histogram.size(); ++i) histogram[i] += p[i];
  });
  cells_ = 24;
  limited_ = false;
  cut_ = 0xffff;
  for (std::size_t i = 0xffff; i >= 1; --i) {
    if (cells_ + histogram[i] > std::max<std::uint64_t>(max_cells, 24)) {
      limited_ = true;
      break;
    }
    cells_ += histogram[i];
    cut_ = static_cast<std::uint16_t>(i);
  }
}

}  // namespace cumulet::grid
