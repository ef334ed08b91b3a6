#include "volume/optical_depth.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>

#include "base/corners.hpp"
#include "base/number_parsing.hpp"
#include "base/progress_part.hpp"
#include "volume/value_unit.hpp"

namespace cumulet::volume {

namespace {

constexpr int cell_limit = 96;
constexpr double wanted_depth = 8.0;
constexpr double visible_share = 0.05;
constexpr double extreme_share = 0.005;
constexpr double visible_depth = 0.05129;  // optical depth of an opacity of 5 %
constexpr int directions = 24;
constexpr int rays_a_side = 64;
constexpr int rays_a_side_of_view = 128;
constexpr double max_density_scale = 1e60;  // limit of the setting

/// Returns directions evenly distributed over a hemisphere; opposite directions are equivalent.
glm::dvec3 direction_of(int i) {
  const double z = 1.0 - (i + 0.5) / directions;
  const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Returns the number of voxels in the intersection of two inclusive ranges.
int shared(int a0, int a1, int b0, int b1) { return std::max(0, std::min(a1, b1) - std::max(a0, b0) + 1); }

/// A slab of coarse cells, perpendicular to x.
class Slab {
 public:
  Slab(const ScalarVolume& volume, int slab, int block, const glm::ivec3& size)
      : low_(volume.bounds_min),
        x0_(low_.x + slab * block),
        x1_(std::min(x0_ + block - 1, volume.bounds_max.x)),
        block_(block),
        cells_a_row_(static_cast<std::size_t>(size.y)),
        sums_(cells_a_row_ * static_cast<std::size_t>(size.z)),
        covered_(sums_.size()) {
    add_bricks(volume);
    for (const Tile& tile : volume.tiles) {
      for_cells(tile.min, tile.max, [&](std::size_t cell, double voxels) {
        sums_[cell] += voxels * tile.value;
        covered_[cell] += voxels;
      });
    }
    if (!(volume.background > 0.0F)) return;
    for_cells(volume.bounds_min, volume.bounds_max, [&](std::size_t cell, double voxels) {
      sums_[cell] += std::max(0.0, voxels - covered_[cell]) * volume.background;
    });
  }
  /// Returns the sum over all voxels of a cell.
  [[nodiscard]] double sum(int j, int k) const { return sums_[cell(j, k)]; }

 private:
  [[nodiscard]] std::size_t cell(int j, int k) const {
    return static_cast<std::size_t>(k) * cells_a_row_ + static_cast<std::size_t>(j);
  }

  void add_bricks(const ScalarVolume& volume) {
    const auto& origins = volume.brick_origins;
    BrickValues::Brick room;
    auto first = std::lower_bound(origins.begin(), origins.end(), x0_ - (brick_size - 1),
                                  [](const glm::ivec3& origin, int x) { return origin.x < x; });
    for (; first != origins.end() && first->x <= x1_; ++first) {
      const auto brick = static_cast<std::size_t>(first - origins.begin());
      if (volume.on_device) volume.on_device->fill_means(brick, room);
      const float* values = volume.on_device ? room.data() : volume.brick_values.brick(brick, room);
      add(*first, values, volume.bounds_max);
    }
  }

  void add(const glm::ivec3& origin, const float* values, const glm::ivec3& high) {
    const glm::ivec3 from = glm::max(origin, glm::ivec3(x0_, low_.y, low_.z));
    const glm::ivec3 to = glm::min(origin + (brick_size - 1), glm::ivec3(x1_, high.y, high.z));
    std::array<std::size_t, brick_size> columns;  // cell index for each z
    for (int z = from.z; z <= to.z; ++z) columns[static_cast<std::size_t>(z & 7)] = cell(0, (z - low_.z) / block_);
    for (int x = from.x; x <= to.x; ++x) {
      for (int y = from.y; y <= to.y; ++y) {
        const std::size_t row = cell((y - low_.y) / block_, 0);
        for (int z = from.z; z <= to.z; ++z) {
          const std::size_t at = row + columns[static_cast<std::size_t>(z & 7)];
          sums_[at] += values[((x & 7) * brick_size + (y & 7)) * brick_size + (z & 7)];
          covered_[at] += 1.0;
        }
      }
    }
  }

  template <class Each>
  void for_cells(const glm::ivec3& min, const glm::ivec3& max, Each&& each) const {
    const int wide = shared(min.x, max.x, x0_, x1_);
    if (wide == 0) return;
    for (int j = (min.y - low_.y) / block_; j <= (max.y - low_.y) / block_; ++j) {
      const int y0 = low_.y + j * block_;
      const double area = double(wide) * shared(min.y, max.y, y0, y0 + block_ - 1);
      for (int k = (min.z - low_.z) / block_; k <= (max.z - low_.z) / block_; ++k) {
        const int z0 = low_.z + k * block_;
        each(cell(j, k), area * shared(min.z, max.z, z0, z0 + block_ - 1));
      }
    }
  }

  glm::ivec3 low_;
  int x0_;
  int x1_;
  int block_;
  std::size_t cells_a_row_;
  std::vector<double> sums_;
  std::vector<double> covered_;  // number of voxels in bricks and tiles
};

}  // namespace

CoarseVolume::CoarseVolume(const ScalarVolume& volume, const Progress* progress) {
  if (volume.empty()) return;
  const glm::ivec3 low = volume.bounds_min;
  const glm::ivec3 extent = volume.bounds_max - low + 1;
  const int block = (std::max({extent.x, extent.y, extent.z}) - 1) / cell_limit + 1;
  size_ = (extent - 1) / block + 1;
  means_.resize(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                static_cast<std::size_t>(size_.z));
  to_world_ = volume.index_to_world * glm::translate(glm::dmat4(1.0), glm::dvec3(low) - 0.5) *
              glm::scale(glm::dmat4(1.0), glm::dvec3(block));

  // Each slab is processed by one thread, so that sums do not depend on threads.
  unit_ = value_unit(volume.max_value);
  const double whole = unit_ * block * block * block;
  tbb::parallel_for(0, size_.x, [&](int x) {
    check(progress);
    const Slab slab(volume, x, block, size_);
    for (int k = 0; k < size_.z; ++k) {
      for (int j = 0; j < size_.y; ++j) means_[index({x, j, k})] = static_cast<float>(slab.sum(j, k) / whole);
    }
  });
}

template <class Visit>
void CoarseVolume::walk(const glm::dvec3& origin, const glm::dvec3& direction, Visit&& visit) const {
  // Enters the box of cells, then advances from cell wall to cell wall (DDA). t is in units of `direction`.
  double t = std::numeric_limits<double>::lowest();
  double end = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (origin[axis] < 0.0 || origin[axis] >= size_[axis]) return;
      continue;
    }
    const double a = -origin[axis] / direction[axis];
    const double b = (size_[axis] - origin[axis]) / direction[axis];
    t = std::max(t, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(t < end)) return;
  glm::ivec3 cell;
  glm::ivec3 step;
  glm::dvec3 next(std::numeric_limits<double>::max());
  glm::dvec3 stride(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(std::floor(origin[axis] + t * direction[axis])), 0, size_[axis] - 1);
    step[axis] = direction[axis] < 0.0 ? -1 : 1;
    if (direction[axis] == 0.0) continue;
    next[axis] = (cell[axis] + (step[axis] > 0 ? 1 : 0) - origin[axis]) / direction[axis];
    stride[axis] = 1.0 / std::abs(direction[axis]);
  }
  for (;;) {
    const int axis = next.x < next.y ? (next.x < next.z ? 0 : 2) : (next.y < next.z ? 1 : 2);
    const double to = std::min(next[axis], end);
    visit(t, std::max(t, to), double(means_[index(cell)]));
    if (next[axis] >= end) return;
    t = std::max(t, to);
    cell[axis] += step[axis];
    if (cell[axis] < 0 || cell[axis] >= size_[axis]) return;
    next[axis] += stride[axis];
  }
}

double CoarseVolume::depth_along(const glm::dvec3& origin, const glm::dvec3& direction) const {
  double depth = 0.0;
  walk(origin, direction, [&](double from, double to, double mean) { depth += (to - from) * mean; });
  return depth;
}

std::optional<CoarseVolume::Box> CoarseVolume::occupied() const {
  Box box{size_, glm::ivec3(-1)};
  for (glm::ivec3 c(0); c.z < size_.z; ++c.z) {
    for (c.y = 0; c.y < size_.y; ++c.y) {
      for (c.x = 0; c.x < size_.x; ++c.x) {
        if (!(means_[index(c)] > 0.0F)) continue;
        box.low = glm::min(box.low, c);
        box.high = glm::max(box.high, c);
      }
    }
  }
  if (box.high.x < 0) return std::nullopt;
  return box;
}

CoarseVolume::Sheet CoarseVolume::sheet(const Box& box, const glm::dvec3& direction, int rays) const {
  Sheet sheet;
  sheet.u = glm::normalize(
      glm::cross(direction, std::abs(direction.y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0)));
  sheet.v = glm::cross(direction, sheet.u);
  sheet.least = glm::dvec2(std::numeric_limits<double>::max());
  glm::dvec2 most(std::numeric_limits<double>::lowest());
  for (const glm::dvec3& p : corners_of(box.low, box.high + 1)) {
    const glm::dvec3 world(to_world_ * glm::dvec4(p, 1.0));
    const glm::dvec2 at(glm::dot(world, sheet.u), glm::dot(world, sheet.v));
    sheet.least = glm::min(sheet.least, at);
    most = glm::max(most, at);
  }
  sheet.pixel = (most - sheet.least) / double(rays);
  return sheet;
}

std::vector<CoarseVolume::Ray> CoarseVolume::rays() const {
  const std::optional<Box> box = occupied();
  if (!box) return {};
  const glm::dmat4 from_world = glm::inverse(to_world_);
  std::vector<Ray> all(std::size_t{directions} * rays_a_side * rays_a_side);
  tbb::parallel_for(0, directions, [&](int d) {
    const glm::dvec3 direction = direction_of(d);
    const Sheet from = sheet(*box, direction, rays_a_side);
    const glm::dvec3 along(from_world * glm::dvec4(direction, 0.0));
    for (int i = 0; i < rays_a_side * rays_a_side; ++i) {
      const glm::dvec3 origin(from_world * glm::dvec4(from.centre(i % rays_a_side, i / rays_a_side), 1.0));
      all[static_cast<std::size_t>(d) * rays_a_side * rays_a_side + static_cast<std::size_t>(i)] = {
          depth_along(origin, along), from.pixel.x * from.pixel.y};
    }
  });
  std::erase_if(all, [](const Ray& ray) { return !(ray.depth > 0.0); });
  return all;
}

std::optional<double> CoarseVolume::suggest_density_scale() const {
  std::vector<Ray> all = rays();
  if (all.empty()) return std::nullopt;
  std::stable_sort(all.begin(), all.end(), [](const Ray& a, const Ray& b) { return a.depth > b.depth; });
  double area = 0.0;
  for (const Ray& ray : all) area += ray.area;
  double most = all.front().depth;
  double extreme = 0.0;
  for (const Ray& ray : all) {
    most = ray.depth;
    extreme += ray.area;
    if (extreme >= extreme_share * area) break;
  }
  double mass = 0.0;
  double seen = 0.0;
  for (const Ray& ray : all) {
    const double depth = std::min(ray.depth, most);
    mass += ray.area * depth;
    seen += ray.area * depth * depth;
  }
  double visible_area = 0.0;
  double visible_mass = 0.0;
  for (const Ray& ray : all) {
    const double depth = std::min(ray.depth, most);
    if (depth < visible_share * seen / mass) break;
    visible_area += ray.area;
    visible_mass += ray.area * depth;
  }
  const double scale = wanted_depth * visible_area / visible_mass / unit_;
  // Rounded, because users read and retype it.
  std::array<char, 32> digits{};
  const char* end =
      std::to_chars(digits.data(), digits.data() + digits.size(), scale, std::chars_format::scientific, 2).ptr;
  double rounded = scale;
  number_from_chars(digits.data(), end, rounded);
  return std::clamp(rounded, std::numeric_limits<double>::min(), max_density_scale);
}

std::vector<glm::dvec3> CoarseVolume::visible(const glm::dvec3& direction, double density_scale) const {
  const std::optional<Box> box = occupied();
  if (!box || !(density_scale > 0.0)) return {};
  const glm::dmat4 from_world = glm::inverse(to_world_);
  const glm::dvec3 along(from_world * glm::dvec4(direction, 0.0));
  const Sheet from = sheet(*box, direction, rays_a_side_of_view);
  const double least = visible_depth / (density_scale * unit_);
  const glm::dvec3 u = 0.5 * from.pixel.x * from.u;
  const glm::dvec3 v = 0.5 * from.pixel.y * from.v;
  std::array<std::vector<glm::dvec3>, rays_a_side_of_view> rows;
  tbb::parallel_for(0, rays_a_side_of_view, [&](int y) {
    for (int x = 0; x < rays_a_side_of_view; ++x) {
      const glm::dvec3 centre = from.centre(x, y);
      const glm::dvec3 origin(from_world * glm::dvec4(centre, 1.0));
      const double depth = depth_along(origin, along);
      if (!(depth >= least)) continue;
      // The points at half of the minimum depth from either end: matter beyond them is too thin to be visible.
      std::array<double, 2> ends{};
      double sum = 0.0;
      walk(origin, along, [&](double t0, double t1, double mean) {
        const double next = sum + (t1 - t0) * mean;
        for (int end = 0; end < 2; ++end) {
          const double wanted = end == 0 ? 0.5 * least : depth - 0.5 * least;
          if (sum < wanted && next >= wanted) ends.at(static_cast<std::size_t>(end)) = t0 + (wanted - sum) / mean;
        }
        sum = next;
      });
      for (const double t : ends) {
        const glm::dvec3 p = centre + t * direction;
        rows.at(static_cast<std::size_t>(y))
            .insert(rows.at(static_cast<std::size_t>(y)).end(), {p - u - v, p + u - v, p - u + v, p + u + v});
      }
    }
  });
  std::vector<glm::dvec3> points;
  for (const auto& row : rows) points.insert(points.end(), row.begin(), row.end());
  return points;
}

double CoarseVolume::most(const Quantity& quantity) const {
  double most = 0.0;
  for (const float mean : means_) {
    if (mean > 0.0F) most = std::max(most, quantity(static_cast<float>(unit_ * double{mean})));
  }
  return most;
}

std::vector<glm::dvec3> CoarseVolume::points_where(const Quantity& quantity, double least) const {
  std::vector<glm::dvec3> points;
  for (int k = 0; k < size_.z; ++k) {
    for (int j = 0; j < size_.y; ++j) {
      int first = 0;
      int last = size_.x - 1;
      while (first <= last && !(of(quantity, {first, j, k}) >= least)) ++first;
      while (first <= last && !(of(quantity, {last, j, k}) >= least)) --last;
      if (first > last) continue;
      // The cells between them are within their hull.
      for (const glm::dvec3& p : corners_of(glm::dvec3(first, j, k), glm::dvec3(last + 1, j + 1, k + 1)))
        points.emplace_back(to_world_ * glm::dvec4(p, 1.0));
    }
  }
  return points;
}

}  // namespace cumulet::volume
