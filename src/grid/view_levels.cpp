#include "grid/view_levels.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "grid/cell.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

namespace {

using glm::dvec3;
using glm::ivec3;

// Largest singular value, by power iteration. Slow convergence is harmless: then other singular values are as large.
double largest_stretch(const glm::dmat3& linear) {
  const glm::dmat3 square = glm::transpose(linear) * linear;
  dvec3 v = glm::normalize(dvec3(1.0, 0.9, 0.8));
  for (int i = 0; i < 64; ++i) v = glm::normalize(square * v);
  return glm::length(linear * v);
}

// The longest refinement edge of cells of a class, of unit 1.
double longest_edge(const glm::dmat3& linear, std::uint32_t cell_class) {
  double longest = 0.0;
  for (unsigned signs = 0; signs < 8; ++signs) {
    const ivec3 corner(signs & 1U, (signs >> 1U) & 1U, signs >> 2U);
    for (std::uint32_t permutation = 0; permutation < 6; ++permutation) {
      const std::uint32_t shape = kuhn_frame(corner, 1, permutation) | (cell_class << 9U);
      longest = std::max(longest, glm::length(linear * dvec3(core::cm_cell_vertex(glm::vec3(0.0F), shape, 1))));
    }
  }
  return longest;
}

}  // namespace

unsigned level_of(std::uint32_t shape, int log2_size) {
  constexpr std::array<int, 3> within{0, 1, -1};  // level within an octave
  const int octave = log2_size - 1 - static_cast<int>(core::cm_shape_exponent(shape));
  return static_cast<unsigned>(3 * octave + within[core::cm_shape_class(shape)]);
}

ViewLevels::ViewLevels(const Cube& cube, const RefineSettings& settings) : log2_size_(cube.log2_size) {
  if (!settings.camera) return;
  const RefineCamera& camera = *settings.camera;
  const glm::dmat3 linear(cube.to_world);
  for (const glm::dmat4& transform : camera.transforms)
    instances_.push_back({transform * cube.to_world, largest_stretch(glm::dmat3(transform))});
  const auto side = [&](const dvec3& axis, double tangent) {
    planes_.push_back(glm::normalize(camera.forward * tangent - axis));
  };
  side(camera.right, camera.tan_half_x);
  side(-camera.right, camera.tan_half_x);
  side(camera.up, camera.tan_half_y);
  side(-camera.up, camera.tan_half_y);
  eye_ = camera.eye;
  angle_ = settings.pixel_size / camera.pixels_per_radian;
  // Half the world diagonal, the longest of four.
  for (int i = 0; i < 4; ++i) {
    const dvec3 diagonal(1.0, (i & 1) != 0 ? -1.0 : 1.0, (i & 2) != 0 ? -1.0 : 1.0);
    unit_radius_ = std::max(unit_radius_, 0.5 * glm::length(linear * diagonal));
  }
  // Level 3 n has edges of cubes (A), 3 n + 1 their diagonals (B), 3 n + 2 face diagonals of cubes of half the size.
  const std::array<double, 3> edge{longest_edge(linear, 0), longest_edge(linear, 1), 0.5 * longest_edge(linear, 2)};
  longest_.resize(splitting_levels(log2_size_));
  double finer = 0.0;
  for (std::size_t level = longest_.size(); level-- > 0;) {
    const int exponent = log2_size_ - 1 - static_cast<int>(level / 3);
    finer = std::max(finer, edge[level % 3] * static_cast<double>(1 << exponent));
    longest_[level] = finer;
  }
}

unsigned ViewLevels::in(const ivec3& corner, int node_size) const {
  if (longest_.empty()) return splitting_levels(log2_size_);
  const double size = 1 << node_size;
  const dvec3 centre = dvec3(corner) + 0.5 * size;
  double shortest = std::numeric_limits<double>::infinity();
  for (const Instance& instance : instances_) {
    shortest = std::min(shortest, shortest_edge(instance, centre, unit_radius_ * size));
    if (shortest <= 0.0) break;
  }
  const auto end =
      std::partition_point(longest_.begin(), longest_.end(), [&](double edge) { return edge >= shortest; });
  return static_cast<unsigned>(end - longest_.begin());
}

RefineSettings with_slack(const RefineSettings& settings) {
  constexpr double aside = 1.15;
  constexpr double smaller = 0.75;
  RefineSettings slack = settings;
  slack.pixel_size *= smaller;
  if (slack.camera) {
    slack.camera->tan_half_x *= aside;
    slack.camera->tan_half_y *= aside;
  }
  return slack;
}

// Infinity: outside the frustum.
double ViewLevels::shortest_edge(const Instance& instance, const dvec3& centre, double radius) const {
  const dvec3 to = dvec3(instance.to_camera * glm::dvec4(centre, 1.0)) - eye_;
  radius *= instance.stretch;
  for (const dvec3& plane : planes_) {
    if (glm::dot(plane, to) < -radius) return std::numeric_limits<double>::infinity();
  }
  return angle_ * std::max(0.0, glm::length(to) - radius) / instance.stretch;
}

}  // namespace cumulet::grid
