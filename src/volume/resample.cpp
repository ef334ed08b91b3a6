#include "volume/resample.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>

namespace cumulet::volume::detail {

namespace {

// Where the field's voxels are smaller by more than this, a voxel of the lattice is an average of samples.
constexpr double much_finer = 1.5;
constexpr double most_samples = 8.0;  // an axis
// Of a voxel: transforms that differ by rounding alone give the field's own values.
constexpr double alike = 1e-4;
// Farther than what any voxel is made of.
constexpr double far_off = double{max_coordinate} + max_extent;
// Beyond that much finer, what a brick is made of fills memory.
constexpr double most_finer = 64.0;
// Of the lattice; 4 GiB of values.
constexpr std::uint64_t most_bricks = std::uint64_t{1} << 21U;

struct Brick {
  glm::ivec3 origin;
  std::array<float, brick_voxels> values;
};

/// Those voxels are active that are not zero.
class BrickLeaves final : public LeafSource {
 public:
  using Bricks = tbb::enumerable_thread_specific<std::deque<Brick>>;

  explicit BrickLeaves(Bricks bricks) : bricks_(std::move(bricks)) {
    for (const std::deque<Brick>& some : bricks_) {
      for (const Brick& brick : some) order_.push_back(&brick);
    }
  }
  [[nodiscard]] std::size_t count() const override { return order_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return order_[leaf]->origin; }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override { return not_zero(order_[leaf]->values); }
  void values(std::size_t leaf, float* out) const override { std::ranges::copy(order_[leaf]->values, out); }

 private:
  Bricks bricks_;
  std::vector<const Brick*> order_;
};

/// Some of a field's own bricks.
class OwnLeaves final : public LeafSource {
 public:
  OwnLeaves(const ScalarVolume& field, std::vector<std::size_t> bricks) : field_(field), bricks_(std::move(bricks)) {}
  [[nodiscard]] std::size_t count() const override { return bricks_.size(); }
  [[nodiscard]] glm::ivec3 origin(std::size_t leaf) const override { return field_.brick_origins[bricks_[leaf]]; }
  [[nodiscard]] ActiveMask active(std::size_t leaf) const override {
    BrickValues::Brick room;
    return not_zero(std::span<const float, brick_voxels>(field_.brick_values.brick(bricks_[leaf], room), brick_voxels));
  }
  void values(std::size_t leaf, float* out) const override {
    BrickValues::Brick room;
    std::copy_n(field_.brick_values.brick(bricks_[leaf], room), brick_voxels, out);
  }

 private:
  const ScalarVolume& field_;
  std::vector<std::size_t> bricks_;
};

/// The field's bricks and tiles that meet a box of its voxels: places in brick_origins, then in tiles.
using Items = std::vector<std::uint32_t>;

/// The field's values within a box, by cells of the bricks' size.
class Window {
 public:
  Window(const ScalarVolume& field, const Box& box, const Items& items)
      : field_(&field), low_(box.min >> 3), size_((box.max >> 3) - low_ + 1) {
    cells_.assign(place(size_ - 1) + 1, {std::nullopt, field.background});
    for (const std::uint32_t item : items) {
      if (item < field.brick_origins.size()) {
        const glm::ivec3 cell = (field.brick_origins[item] >> 3) - low_;
        cells_[place(cell)].first = std::size_t{item} * brick_voxels;
        continue;
      }
      // Within bounds a cell has one tile, or none.
      const Tile& tile = field.tiles[item - field.brick_origins.size()];
      const glm::ivec3 min = glm::max((tile.min >> 3) - low_, 0);
      const glm::ivec3 max = glm::min((tile.max >> 3) - low_, size_ - 1);
      for (glm::ivec3 c = min; c.x <= max.x; ++c.x) {
        for (c.y = min.y; c.y <= max.y; ++c.y) {
          for (c.z = min.z; c.z <= max.z; ++c.z) cells_[place(c)].constant = tile.value;
        }
      }
    }
  }

  [[nodiscard]] double voxel(glm::ivec3 p) const {
    if (glm::any(glm::lessThan(p, field_->bounds_min)) || glm::any(glm::greaterThan(p, field_->bounds_max))) return 0.0;
    const Cell& cell = cells_[place((p >> 3) - low_)];
    if (!cell.first) return cell.constant;
    const int within = ((p.x & 7) * brick_size + (p.y & 7)) * brick_size + (p.z & 7);
    return field_->brick_values[*cell.first + static_cast<std::size_t>(within)];
  }

  /// The value all over a box within the window's, if cells alone tell it.
  [[nodiscard]] std::optional<double> constant(const Box& box) const {
    const glm::ivec3 min = (box.min >> 3) - low_;
    const glm::ivec3 max = (box.max >> 3) - low_;
    const float value = cells_[place(min)].constant;
    if (value != 0.0F && !Box{field_->bounds_min, field_->bounds_max}.contains(box)) return std::nullopt;
    for (glm::ivec3 c = min; c.x <= max.x; ++c.x) {
      for (c.y = min.y; c.y <= max.y; ++c.y) {
        for (c.z = min.z; c.z <= max.z; ++c.z) {
          const Cell& cell = cells_[place(c)];
          if (cell.first || cell.constant != value) return std::nullopt;
        }
      }
    }
    return value;
  }

  /// Trilinear between the centres of voxels.
  [[nodiscard]] double at(glm::dvec3 p) const {
    const glm::dvec3 nearest = glm::round(p);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(p[axis] - nearest[axis]) < alike) p[axis] = nearest[axis];
    }
    const glm::dvec3 low = glm::floor(p);
    const glm::dvec3 part = p - low;
    const glm::ivec3 voxel_low(low);
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 offset(corner & 1, (corner >> 1) & 1, corner >> 2);
      const glm::dvec3 weights = glm::mix(1.0 - part, part, glm::dvec3(offset));
      const double weight = weights.x * weights.y * weights.z;
      if (weight > 0.0) sum += weight * voxel(voxel_low + offset);
    }
    return sum;
  }

 private:
  struct Cell {
    std::optional<std::size_t> first;  // place of its brick's values
    float constant;
  };

  [[nodiscard]] std::size_t place(glm::ivec3 cell) const {
    return (static_cast<std::size_t>(cell.x) * static_cast<std::size_t>(size_.y) + static_cast<std::size_t>(cell.y)) *
               static_cast<std::size_t>(size_.z) +
           static_cast<std::size_t>(cell.z);
  }

  const ScalarVolume* field_;
  glm::ivec3 low_, size_;
  std::vector<Cell> cells_;
};

/// A box's image under an affine transform, the smallest box that holds it.
struct Span {
  glm::dvec3 min, max;
};

Span image(const glm::dmat4& transform, const glm::dvec3& min, const glm::dvec3& max) {
  const glm::dvec3 centre(transform * glm::dvec4(0.5 * (min + max), 1.0));
  const glm::dvec3 half = 0.5 * (max - min);
  glm::dvec3 reach(0.0);
  for (int axis = 0; axis < 3; ++axis) reach += glm::abs(glm::dvec3(transform[axis])) * half[axis];
  return {centre - reach, centre + reach};
}

class Resampling {
 public:
  Resampling(const ScalarVolume& field, const glm::dmat4& lattice, const std::optional<Box>& within, Progress* progress,
             Portion portion)
      : field_(field),
        within_(within),
        to_field_(glm::inverse(field.index_to_world) * lattice),
        part_(progress, portion.from, portion.to, pieces(0)) {
    for (int axis = 0; axis < 3; ++axis) {
      const double step = glm::length(glm::dvec3(to_field_[axis]));
      if (!(step <= most_finer)) fail("has voxels too small for the lattice of the file's other fields");
      const double wanted = step > much_finer ? std::ceil(step - alike) : 1.0;
      samples_[axis] = static_cast<int>(std::min(wanted, most_samples));
      // From a voxel's centre to its outermost sample.
      reach_[axis] = 0.5 * (1.0 - 1.0 / samples_[axis]);
    }
  }

  SourceGrid run() {
    // What is not zero reaches to the next centres around the field's voxels.
    const Span span =
        image(glm::inverse(to_field_), glm::dvec3(field_.bounds_min) - 1.0, glm::dvec3(field_.bounds_max) + 1.0);
    glm::dvec3 min = glm::floor(span.min - reach_);
    glm::dvec3 max = glm::ceil(span.max + reach_);
    if (within_) {
      min = glm::max(min, glm::dvec3(within_->min));
      max = glm::min(max, glm::dvec3(within_->max));
    }
    SourceGrid out;
    if (glm::any(glm::greaterThan(min, max))) {
      out.leaves = std::make_unique<BrickLeaves>(std::move(bricks_));
      return out;
    }
    if (!glm::all(glm::lessThan(glm::max(glm::abs(min), glm::abs(max)), glm::dvec3(max_coordinate))) ||
        !glm::all(glm::lessThan(max - min, glm::dvec3(max_extent)))) {
      fail("is too far off or too large for the lattice of the file's other fields");
    }
    box_ = {glm::ivec3(min), glm::ivec3(max)};
    const glm::ivec3 low = box_.min & ~(brick_size - 1);
    // Each of the field's bricks fills as many as it is larger by, all of them no more than there are.
    const double larger = 1.0 / std::abs(glm::determinant(glm::dmat3(to_field_)));
    const glm::dvec3 bricks((box_.max >> 3) - (low >> 3) + 1);
    if (std::min(static_cast<double>(field_.brick_origins.size()) * larger, bricks.x * bricks.y * bricks.z) >
        static_cast<double>(most_bricks)) {
      too_large();
    }
    int size = brick_size;
    for (const glm::ivec3 extent = box_.max - low; size <= std::max({extent.x, extent.y, extent.z});) size *= 2;
    Items items(field_.brick_origins.size() + field_.tiles.size());
    for (std::uint32_t i = 0; i < items.size(); ++i) items[i] = i;
    refine(low, size, 0, items);

    for (const std::vector<SourceTile>& tiles : tiles_) out.tiles.insert(out.tiles.end(), tiles.begin(), tiles.end());
    out.leaves = std::make_unique<BrickLeaves>(std::move(bricks_));
    return out;
  }

 private:
  static constexpr int told_depth = 3;  ///< progress is told of cubes of this depth

  [[noreturn]] static void too_large() { fail("has voxels too large for the lattice of the file's other fields"); }

  static std::uint64_t pieces(int depth) { return std::uint64_t{1} << (3 * std::max(told_depth - depth, 0)); }

  /// The field's voxels that a box of the lattice is made of.
  [[nodiscard]] Box support(const Box& box) const {
    const Span span = image(to_field_, glm::dvec3(box.min) - reach_, glm::dvec3(box.max) + reach_);
    // A cube of the lattice may be of any size.
    const auto voxel = [](const glm::dvec3& p) { return glm::ivec3(glm::clamp(p, -far_off, far_off)); };
    return {voxel(glm::floor(span.min - alike)), voxel(glm::ceil(span.max + alike))};
  }

  [[nodiscard]] Box box_of(std::uint32_t item) const {
    const std::size_t bricks = field_.brick_origins.size();
    if (item >= bricks) return {field_.tiles[item - bricks].min, field_.tiles[item - bricks].max};
    return {field_.brick_origins[item], field_.brick_origins[item] + (brick_size - 1)};
  }

  /// The value all over a box of the field, if that is known without looking at voxels.
  [[nodiscard]] std::optional<float> constant(const Box& box, const Items& items) const {
    const Box bounds{field_.bounds_min, field_.bounds_max};
    if (items.empty()) {
      if (bounds.contains(box)) return field_.background;
      if (field_.background == 0.0F || bounds.clipped(box).empty()) return 0.0F;
    }
    const std::size_t bricks = field_.brick_origins.size();
    if (items.size() == 1 && items[0] >= bricks && box_of(items[0]).contains(box))
      return field_.tiles[items[0] - bricks].value;
    return std::nullopt;
  }

  /// A cube of the lattice, of the items that may meet what it is made of.
  void refine(glm::ivec3 origin, int size, int depth, const Items& candidates) {
    part_.check();
    const Box cube{origin, origin + (size - 1)};
    const Box needed = support(cube);
    Items items;
    std::ranges::copy_if(candidates, std::back_inserter(items),
                         [&](std::uint32_t item) { return !box_of(item).clipped(needed).empty(); });
    const std::optional<float> known = box_.clipped(cube).empty() ? 0.0F : constant(needed, items);
    if (known) {
      if (*known != 0.0F) tiles_.local().push_back({{cube.min, cube.max, *known}, true});
    } else if (size == brick_size) {
      sample(origin, needed, items);
    } else {
      tbb::parallel_for(0, 8, [&](int child) {
        const int half = size / 2;
        refine(origin + half * glm::ivec3(child >> 2, (child >> 1) & 1, child & 1), half, depth + 1, items);
      });
      if (depth < told_depth) return;
    }
    if (depth <= told_depth) part_.add(pieces(depth));
  }

  void sample(glm::ivec3 origin, const Box& needed, const Items& items) {
    if (sampled_.fetch_add(1, std::memory_order_relaxed) >= most_bricks) too_large();
    const Window window(field_, needed, items);
    Brick brick{origin, {}};
    bool any = false;
    for (int i = 0; i < brick_voxels; ++i) {
      const glm::ivec3 voxel = origin + glm::ivec3(i >> 6, (i >> 3) & 7, i & 7);
      const std::optional<double> known = window.constant(support({voxel, voxel}));
      const double value = known ? *known : average(window, glm::dvec3(voxel));
      brick.values[static_cast<std::size_t>(i)] = static_cast<float>(value);
      any = any || value > 0.0;
    }
    if (any) bricks_.local().push_back(brick);
  }

  [[nodiscard]] double average(const Window& window, const glm::dvec3& voxel) const {
    const glm::dvec3 step = 1.0 / glm::dvec3(samples_);
    double sum = 0.0;
    for (glm::ivec3 s(0); s.x < samples_.x; ++s.x) {
      for (s.y = 0; s.y < samples_.y; ++s.y) {
        for (s.z = 0; s.z < samples_.z; ++s.z) {
          const glm::dvec3 place = voxel - 0.5 + step * (glm::dvec3(s) + 0.5);
          sum += window.at(glm::dvec3(to_field_ * glm::dvec4(place, 1.0)));
        }
      }
    }
    return sum * step.x * step.y * step.z;
  }

  const ScalarVolume& field_;
  const std::optional<Box> within_;
  glm::dmat4 to_field_;
  glm::ivec3 samples_{1};
  glm::dvec3 reach_{0.0};
  Box box_;
  ProgressPart part_;
  std::atomic<std::uint64_t> sampled_ = 0;
  BrickLeaves::Bricks bricks_;
  tbb::enumerable_thread_specific<std::vector<SourceTile>> tiles_;
};

}  // namespace

bool same_places(const glm::dmat4& a, const glm::dmat4& b, const Box& voxels) {
  const glm::dmat4 to_a = glm::inverse(a) * b;
  // An affine map is farthest off at a corner.
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 upper(corner & 1, (corner >> 1) & 1, corner >> 2);
    const glm::dvec4 p(glm::mix(glm::dvec3(voxels.min), glm::dvec3(voxels.max), upper), 1.0);
    const glm::dvec3 off = glm::abs(glm::dvec3(to_a * p - p));
    if (!(std::max({off.x, off.y, off.z}) < 1e-3)) return false;
  }
  return true;
}

SourceGrid resample(const ScalarVolume& field, const glm::dmat4& lattice, const std::optional<Box>& within,
                    Progress* progress, Portion portion) {
  SourceGrid out = Resampling(field, lattice, within, progress, portion).run();
  out.index_to_world = lattice;
  return out;
}

SourceGrid bricks_within(const ScalarVolume& field, const Box& box) {
  const Box whole{box.min & ~(brick_size - 1), box.max | (brick_size - 1)};
  SourceGrid out;
  out.index_to_world = field.index_to_world;
  std::vector<std::size_t> bricks;
  for (std::size_t i = 0; i < field.brick_origins.size(); ++i) {
    if (const glm::ivec3 origin = field.brick_origins[i]; whole.contains({origin, origin})) bricks.push_back(i);
  }
  for (const Tile& tile : field.tiles) {
    const Box part = whole.clipped({tile.min, tile.max});
    if (!part.empty()) out.tiles.push_back({{part.min, part.max, tile.value}, true});
  }
  out.leaves = std::make_unique<OwnLeaves>(field, std::move(bricks));
  return out;
}

}  // namespace cumulet::volume::detail
