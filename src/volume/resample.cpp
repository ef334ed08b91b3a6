#include "volume/resample.hpp"

#include <algorithm>
#include <cmath>

#include "volume/gathering.hpp"

namespace cumulet::volume::detail {

namespace {

// If the field's voxels are smaller by more than this factor, a voxel of the lattice is the average of several samples.
constexpr double much_finer = 1.5;
constexpr double max_samples = 8.0;  // per axis
// Beyond the coordinates of any voxel that is used.
constexpr double far_off = double{max_coordinate} + max_extent;
// Beyond this factor, the input of one brick would need too much memory.
constexpr double max_finer = 64.0;

/// Some of a field's bricks.
class OwnLeaves final : public HeldLeaves {
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

/// The bounding box of a box under an affine transform.
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

class Resampling final : Gathering {
 public:
  Resampling(const ScalarVolume& field, const glm::dmat4& lattice, const std::optional<Box>& within, Progress* progress,
             Portion portion)
      : Gathering({&field}, 1, progress, portion),
        within_(within),
        to_field_(glm::inverse(field.index_to_world) * lattice) {
    for (int axis = 0; axis < 3; ++axis) {
      const double step = glm::length(glm::dvec3(to_field_[axis]));
      if (!(step <= max_finer)) fail("has voxels that are too small compared with the file's other grids");
      const double wanted = step > much_finer ? std::ceil(step - alike) : 1.0;
      samples_[axis] = static_cast<int>(std::min(wanted, max_samples));
      // Distance from a voxel's center to its outermost sample.
      reach_[axis] = 0.5 * (1.0 - 1.0 / samples_[axis]);
    }
  }

  SourceGrid run() {
    const ScalarVolume& field = source(0);
    // Non-zero values extend to the neighboring centers around the field's voxels.
    const Span span =
        image(glm::inverse(to_field_), glm::dvec3(field.bounds_min) - 1.0, glm::dvec3(field.bounds_max) + 1.0);
    glm::dvec3 min = glm::floor(span.min - reach_);
    glm::dvec3 max = glm::ceil(span.max + reach_);
    if (within_) {
      min = glm::max(min, glm::dvec3(within_->min));
      max = glm::min(max, glm::dvec3(within_->max));
    }
    if (glm::any(glm::greaterThan(min, max))) return std::move(gather({})[0]);
    if (!glm::all(glm::lessThan(glm::max(glm::abs(min), glm::abs(max)), glm::dvec3(max_coordinate))) ||
        !glm::all(glm::lessThan(max - min, glm::dvec3(max_extent)))) {
      fail("is too far from the file's other grids or too large");
    }
    const Box box{glm::ivec3(min), glm::ivec3(max)};
    // Each brick of the field fills as many bricks as its relative size, and all together at most those in the box.
    const double larger = 1.0 / std::abs(glm::determinant(glm::dmat3(to_field_)));
    const glm::dvec3 bricks((box.max >> 3) - (box.min >> 3) + 1);
    if (std::min(static_cast<double>(field.brick_origins.size()) * larger, bricks.x * bricks.y * bricks.z) >
        static_cast<double>(max_bricks)) {
      too_large();
    }
    return std::move(gather(box)[0]);
  }

 private:
  [[noreturn]] void too_large() const override {
    fail("has voxels that are too large compared with the file's other grids");
  }

  [[nodiscard]] Box support(std::size_t /*source*/, const Box& box) const override {
    const Span span = image(to_field_, glm::dvec3(box.min) - reach_, glm::dvec3(box.max) + reach_);
    // A cube of the lattice may be of any size, so coordinates are clamped.
    const auto voxel = [](const glm::dvec3& p) { return glm::ivec3(glm::clamp(p, -far_off, far_off)); };
    return {voxel(glm::floor(span.min - alike)), voxel(glm::ceil(span.max + alike))};
  }

  void sample(const glm::ivec3& origin, std::span<const Window> windows, std::span<const std::size_t> /*wanted*/,
              std::span<Brick> bricks) const override {
    for (int i = 0; i < brick_voxels; ++i) {
      const glm::ivec3 voxel = origin + glm::ivec3(i >> 6, (i >> 3) & 7, i & 7);
      const std::optional<double> known = windows[0].constant(support(0, {voxel, voxel}));
      const double value = known ? *known : average(windows[0], glm::dvec3(voxel));
      bricks[0][static_cast<std::size_t>(i)] = static_cast<float>(value);
    }
  }

  [[nodiscard]] double average(const Window& window, const glm::dvec3& voxel) const {
    const glm::dvec3 step = 1.0 / glm::dvec3(samples_);
    double sum = 0.0;
    for (glm::ivec3 s(0); s.x < samples_.x; ++s.x) {
      for (s.y = 0; s.y < samples_.y; ++s.y) {
        for (s.z = 0; s.z < samples_.z; ++s.z) {
          const glm::dvec3 position = voxel - 0.5 + step * (glm::dvec3(s) + 0.5);
          sum += window.at(glm::dvec3(to_field_ * glm::dvec4(position, 1.0)));
        }
      }
    }
    return sum * step.x * step.y * step.z;
  }

  const std::optional<Box> within_;
  glm::dmat4 to_field_;
  glm::ivec3 samples_{1};
  glm::dvec3 reach_{0.0};
};

}  // namespace

bool same_positions(const glm::dmat4& a, const glm::dmat4& b, const Box& voxels) {
  const glm::dmat4 to_a = glm::inverse(a) * b;
  // The deviation of an affine map is largest at a corner.
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
