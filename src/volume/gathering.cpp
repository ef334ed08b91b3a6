#include "volume/gathering.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

namespace cumulet::volume::detail {

namespace {

constexpr int reported_depth = 3;  // progress is reported for cubes of this depth

std::uint64_t pieces(int depth) { return std::uint64_t{1} << (3 * std::max(reported_depth - depth, 0)); }

}  // namespace

// ---- a window ----

Window::Window(const ScalarVolume& field, const Box& box, const Items& items)
    : field_(&field), low_(box.min >> 3), size_((box.max >> 3) - low_ + 1) {
  cells_.assign(index_of(size_ - 1) + 1, {std::nullopt, field.background});
  for (const std::uint32_t item : items) {
    if (item < field.brick_origins.size()) {
      const glm::ivec3 cell = (field.brick_origins[item] >> 3) - low_;
      cells_[index_of(cell)].first = std::size_t{item} * brick_voxels;
      continue;
    }
    // Within bounds, a cell is covered by at most one tile.
    const Tile& tile = field.tiles[item - field.brick_origins.size()];
    const glm::ivec3 min = glm::max((tile.min >> 3) - low_, 0);
    const glm::ivec3 max = glm::min((tile.max >> 3) - low_, size_ - 1);
    for (glm::ivec3 c = min; c.x <= max.x; ++c.x) {
      for (c.y = min.y; c.y <= max.y; ++c.y) {
        for (c.z = min.z; c.z <= max.z; ++c.z) cells_[index_of(c)].constant = tile.value;
      }
    }
  }
}

std::size_t Window::index_of(glm::ivec3 cell) const {
  return (static_cast<std::size_t>(cell.x) * static_cast<std::size_t>(size_.y) + static_cast<std::size_t>(cell.y)) *
             static_cast<std::size_t>(size_.z) +
         static_cast<std::size_t>(cell.z);
}

double Window::voxel(glm::ivec3 p) const {
  if (glm::any(glm::lessThan(p, field_->bounds_min)) || glm::any(glm::greaterThan(p, field_->bounds_max))) return 0.0;
  const Cell& cell = cells_[index_of((p >> 3) - low_)];
  if (!cell.first) return cell.constant;
  const int within = ((p.x & 7) * brick_size + (p.y & 7)) * brick_size + (p.z & 7);
  return field_->brick_values[*cell.first + static_cast<std::size_t>(within)];
}

std::optional<double> Window::constant(const Box& box) const {
  const glm::ivec3 min = (box.min >> 3) - low_;
  const glm::ivec3 max = (box.max >> 3) - low_;
  const float value = cells_[index_of(min)].constant;
  if (value != 0.0F && !Box{field_->bounds_min, field_->bounds_max}.contains(box)) return std::nullopt;
  for (glm::ivec3 c = min; c.x <= max.x; ++c.x) {
    for (c.y = min.y; c.y <= max.y; ++c.y) {
      for (c.z = min.z; c.z <= max.z; ++c.z) {
        const Cell& cell = cells_[index_of(c)];
        if (cell.first || cell.constant != value) return std::nullopt;
      }
    }
  }
  return value;
}

double Window::at(const glm::dvec3& p) const {
  double sum = 0.0;
  for_each_corner(p, [&](const glm::ivec3& corner, double weight) { sum += weight * voxel(corner); });
  return sum;
}

// ---- fields ----

/// The bricks of a field; voxels that are not 0 are active.
class Gathering::Leaves final : public HeldLeaves {
 public:
  explicit Leaves(std::vector<std::deque<LatticeBrick>> bricks) : bricks_(std::move(bricks)) {
    for (const std::deque<LatticeBrick>& some : bricks_) {
      for (const LatticeBrick& brick : some) order_.push_back(&brick);
    }
  }
  [[nodiscard]] std::size_t count() const override { return order_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return order_[leaf]->origin; }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override { return not_zero(order_[leaf]->values); }
  void values(std::size_t leaf, float* out) const override { std::ranges::copy(order_[leaf]->values, out); }

 private:
  std::vector<std::deque<LatticeBrick>> bricks_;
  std::vector<const LatticeBrick*> order_;
};

Gathering::Gathering(std::vector<const ScalarVolume*> sources, std::size_t made, Progress* progress, Portion portion)
    : sources_(std::move(sources)),
      made_(made),
      part_(progress, portion.from, portion.to, pieces(0)),
      bricks_(Bricks(made)),
      tiles_(std::vector<std::vector<SourceTile>>(made)) {}

std::vector<SourceGrid> Gathering::gather(const Box& box) {
  box_ = box;
  if (!box.empty()) {
    const glm::ivec3 low = box.min & ~(brick_size - 1);
    int size = brick_size;
    for (const glm::ivec3 extent = box.max - low; size <= std::max({extent.x, extent.y, extent.z});) size *= 2;
    std::vector<Items> items;
    for (const ScalarVolume* source : sources_) {
      items.emplace_back(source->brick_origins.size() + source->tiles.size());
      std::iota(items.back().begin(), items.back().end(), std::uint32_t{0});
    }
    refine(low, size, 0, items);
  }
  std::vector<SourceGrid> fields(made_);
  for (std::size_t i = 0; i < made_; ++i) {
    for (const auto& tiles : tiles_) fields[i].tiles.insert(fields[i].tiles.end(), tiles[i].begin(), tiles[i].end());
    std::vector<std::deque<LatticeBrick>> bricks;
    for (Bricks& some : bricks_) bricks.push_back(std::move(some[i]));
    fields[i].leaves = std::make_unique<Leaves>(std::move(bricks));
  }
  return fields;
}

Box Gathering::box_of(std::size_t i, std::uint32_t item) const {
  const ScalarVolume& field = source(i);
  const std::size_t bricks = field.brick_origins.size();
  if (item >= bricks) return {field.tiles[item - bricks].min, field.tiles[item - bricks].max};
  return {field.brick_origins[item], field.brick_origins[item] + (brick_size - 1)};
}

std::optional<float> Gathering::value_all_over(std::size_t i, const Box& box, const Items& items) const {
  const ScalarVolume& field = source(i);
  const Box bounds{field.bounds_min, field.bounds_max};
  if (items.empty()) {
    if (bounds.contains(box)) return field.background;
    if (field.background == 0.0F || bounds.clipped(box).empty()) return 0.0F;
  }
  const std::size_t bricks = field.brick_origins.size();
  if (items.size() == 1 && items[0] >= bricks && box_of(i, items[0]).contains(box))
    return field.tiles[items[0] - bricks].value;
  return std::nullopt;
}

void Gathering::refine(glm::ivec3 origin, int size, int depth, std::span<const Items> candidates) {
  part_.check();
  const Box cube{origin, origin + (size - 1)};
  std::vector<Box> needed;
  std::vector<Items> items(sources_.size());
  std::vector<std::optional<float>> values;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    needed.push_back(support(i, cube));
    std::ranges::copy_if(candidates[i], std::back_inserter(items[i]),
                         [&](std::uint32_t item) { return !box_of(i, item).clipped(needed[i]).empty(); });
    values.push_back(value_all_over(i, needed[i], items[i]));
  }
  std::vector<std::optional<float>> known;
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < made_; ++i) {
    known.push_back(box_.clipped(cube).empty() ? 0.0F : constant(i, values));
    if (!known[i]) wanted.push_back(i);
  }
  if (!wanted.empty() && size > brick_size) {
    tbb::parallel_for(0, 8, [&](int child) {
      const int half = size / 2;
      refine(origin + half * glm::ivec3(child >> 2, (child >> 1) & 1, child & 1), half, depth + 1, items);
    });
    if (depth < reported_depth) return;
  } else {
    for (std::size_t i = 0; i < made_; ++i) {
      if (known[i] && *known[i] != 0.0F) tiles_.local()[i].push_back({{cube.min, cube.max, *known[i]}, true});
    }
    if (!wanted.empty()) make_brick(origin, needed, items, wanted);
  }
  if (depth <= reported_depth) part_.add(pieces(depth));
}

void Gathering::make_brick(const glm::ivec3& origin, std::span<const Box> needed, std::span<const Items> items,
                           std::span<const std::size_t> wanted) {
  if (sampled_.fetch_add(1, std::memory_order_relaxed) >= max_bricks) too_large();
  std::vector<Window> windows;
  windows.reserve(sources_.size());
  for (std::size_t i = 0; i < sources_.size(); ++i) windows.emplace_back(source(i), needed[i], items[i]);
  std::vector<Brick> bricks(wanted.size());
  sample(origin, windows, wanted, bricks);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (std::ranges::any_of(bricks[i], [](float value) { return value > 0.0F; }))
      bricks_.local()[wanted[i]].push_back({origin, bricks[i]});
  }
}

void assemble_in_place_of(std::span<const ScalarVolume* const> before, std::vector<SourceGrid> gathered,
                          std::span<ScalarVolume* const> out, Progress* progress, Portion portion) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto share = [&](std::size_t index) { return static_cast<double>(index) / static_cast<double>(out.size()); };
    gathered[i].index_to_world = before[i]->index_to_world;
    *out[i] = assemble(std::move(gathered[i]), {}, {}, progress, portion.part(share(i), share(i + 1)));
    // Warnings about its values were already logged.
    out[i]->name = before[i]->name;
    out[i]->negative_voxels = before[i]->negative_voxels;
    out[i]->non_finite_voxels = before[i]->non_finite_voxels;
    out[i]->huge_voxels = before[i]->huge_voxels;
  }
}

}  // namespace cumulet::volume::detail
