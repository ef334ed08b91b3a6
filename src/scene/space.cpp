#include "scene/space.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cumulet::scene {

namespace {

using glm::vec3;

// Returns a lower bound of the length of a transformed unit vector: 1 / (upper bound of the inverse's norm).
double min_stretch(const glm::dmat3& linear) {
  const glm::dmat3 inverse = glm::inverse(linear);
  const auto widest_column = [](const glm::dmat3& m) {
    const auto sum = [](const glm::dvec3& v) { return glm::dot(glm::abs(v), glm::dvec3(1.0)); };
    return std::max({sum(m[0]), sum(m[1]), sum(m[2])});
  };
  return 1.0 / std::sqrt(widest_column(inverse) * widest_column(glm::transpose(inverse)));
}

}  // namespace

core::CmSpace space_of(const glm::dmat4& cube_to_world, const vec3& low, const vec3& high) {
  const glm::dmat3 from_cube(cube_to_world);
  const glm::dmat3 to_cube(glm::inverse(cube_to_world));
  core::CmSpace space{};
  space.to_cube_x = vec3(to_cube[0]);
  space.to_cube_y = vec3(to_cube[1]);
  space.to_cube_z = vec3(to_cube[2]);
  space.from_cube_x = vec3(from_cube[0]);
  space.from_cube_y = vec3(from_cube[1]);
  space.from_cube_z = vec3(from_cube[2]);
  space.cube_origin = vec3(cube_to_world[3]);
  space.unit_volume = static_cast<float>(std::abs(glm::determinant(from_cube)));
  space.box_min = low;
  space.box_max = high;
  return space;
}

double mean_stretch(const glm::dmat4& transform) {
  return std::cbrt(std::abs(glm::determinant(glm::dmat3(transform))));
}

double max_extinction(double extent) {
  constexpr double max_depth = 0x1p23;
  return extent > 0.0 ? max_depth / extent : std::numeric_limits<double>::infinity();
}

bool stays_solid(const glm::dmat4& open, const glm::dmat4& close) {
  // The determinant is a cubic in t; its coefficients are sums of determinants with columns of the difference matrix.
  const glm::dmat3 from(open);
  const glm::dmat3 way = glm::dmat3(close) - from;
  const auto mixed = [](const glm::dmat3& base, const glm::dmat3& other) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      glm::dmat3 m = base;
      m[i] = other[i];
      sum += glm::determinant(m);
    }
    return sum;
  };
  const std::array<double, 4> c{glm::determinant(from), mixed(from, way), mixed(way, from), glm::determinant(way)};
  const auto volume = [&](double t) { return c[0] + t * (c[1] + t * (c[2] + t * c[3])); };
  // The extrema: at the ends, or where the derivative is 0.
  std::array<double, 4> at{0.0, 1.0, 0.0, 1.0};
  const double root = std::sqrt(std::max(0.0, c[2] * c[2] - 3.0 * c[1] * c[3]));
  const double q = -(c[2] + std::copysign(root, c[2]));
  if (c[3] != 0.0) at[2] = std::clamp(q / (3.0 * c[3]), 0.0, 1.0);
  if (q != 0.0) at[3] = std::clamp(c[1] / q, 0.0, 1.0);
  constexpr double least = 1e-6;  // relative to the smaller end's volume
  const double bound = least * std::min(std::abs(volume(0.0)), std::abs(volume(1.0)));
  const double side = volume(0.0) < 0.0 ? -1.0 : 1.0;
  return std::ranges::all_of(at, [&](double t) { return side * volume(t) > bound; });
}

InstanceEmissive emissive_of(const EmissiveSum& sum, const glm::dmat4& cube_to_world, const glm::dmat4& transform) {
  if (!(sum.power > 0.0)) return {};
  InstanceEmissive emissive{.power = sum.power * std::abs(glm::determinant(glm::dmat3(transform))),
                            .length = sum.length * mean_stretch(transform)};
  emissive.looks.density = static_cast<float>(1.0 / emissive.power);
  emissive.looks.extent = static_cast<float>(emissive.length);
  emissive.looks.min_stretch = static_cast<float>(min_stretch(glm::dmat3(transform * cube_to_world)));
  return emissive;
}

}  // namespace cumulet::scene
