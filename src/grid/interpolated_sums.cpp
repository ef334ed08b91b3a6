// Sums of the interpolated field over the sixths of a brick's cells (docs/architecture/interpolation.md).

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "grid/sixth_means.hpp"
#include "grid/statistics.hpp"

namespace cumulet::grid {

using glm::ivec3;
using glm::vec3;

namespace {

constexpr std::size_t monomials = sixth_monomials;

// Coefficients of the monomials at all leaves.
using LeafCoefficients = std::array<std::array<float, 512>, monomials>;

void find_coefficients(const BrickCorners& corners, float reference, const BrickTree& tree, LeafCoefficients& c,
                       float* min, float* max) {
  for (std::size_t i = 0; i < 512; ++i) {
    const BrickTree::Leaf& leaf = tree.leaf[i];
    std::array<float, monomials> value{};
    for (std::size_t m = 0; m < monomials; ++m) {
      int at = leaf.first;
      for (unsigned axis = 0; axis < 3; ++axis) at += exponent_in(m, axis) != 0 ? leaf.step[axis] : 0;
      value[m] = corners[static_cast<std::size_t>(at)];
    }
    min[i] = *std::ranges::min_element(value);
    max[i] = *std::ranges::max_element(value);
    for (float& one : value) one -= reference;
    // From values at the corners of the unit cube to coefficients, axis by axis.
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (std::size_t m = 0; m < monomials; ++m) {
        if (exponent_in(m, axis) != 0) value[m] -= value[m - (std::size_t{1} << axis)];
      }
    }
    for (std::size_t m = 0; m < monomials; ++m) c[m][i] = value[m];
  }
}

// Means over a sixth, of each monomial and of its products with coordinates and monomials.
struct LeafMeans {
  std::array<float, monomials> one{};
  std::array<std::array<float, monomials>, 3> along{};         // with the coordinate along an axis of the frame
  std::array<std::array<float, monomials>, monomials> both{};  // for the square: with each monomial up to itself

  constexpr LeafMeans() {
    for (std::size_t i = 0; i < monomials; ++i) {
      one[i] = static_cast<float>(mean_of_product(i, 0));
      for (unsigned axis = 0; axis < 3; ++axis) along[axis][i] = static_cast<float>(mean_of_product(i, 0, axis));
      for (std::size_t j = 0; j <= i; ++j)
        both[i][j] = static_cast<float>((i == j ? 1.0 : 2.0) * mean_of_product(i, j));
    }
  }
};
constexpr LeafMeans leaf_means;

}  // namespace

void BrickSums::compute_between(const BrickCorners& corners, float of_brick, const BrickTree& tree) {
  reference = of_brick;
  LeafCoefficients c;
  find_coefficients(corners, reference, tree, c, &min[512], &max[512]);
  std::array<std::array<float, 512>, 3> along;  // first moments along the axes of each leaf's frame
  for (std::size_t leaf = 0; leaf < 512; ++leaf) {
    std::array<float, 5> sums{};
    for (std::size_t i = 0; i < monomials; ++i) {
      const float value = c[i][leaf];
      float product = 0.0F;
      for (std::size_t j = 0; j <= i; ++j) product += leaf_means.both[i][j] * c[j][leaf];
      sums[0] += leaf_means.one[i] * value;
      sums[1] += product * value;
      for (std::size_t axis = 0; axis < 3; ++axis) sums[2 + axis] += leaf_means.along[axis][i] * value;
    }
    mass[512 + leaf] = sums[0];
    square[512 + leaf] = sums[1];
    for (std::size_t axis = 0; axis < 3; ++axis) along[axis][leaf] = sums[2 + axis];
  }
  for (std::size_t i = 0; i < 512; ++i) {
    const BrickTree::Leaf& leaf = tree.leaf[i];
    const ivec3 v0(leaf.first / (brick_corners * brick_corners), leaf.first / brick_corners % brick_corners,
                   leaf.first % brick_corners);
    vec3 first = vec3(v0) * mass[512 + i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int to = leaf.axis[axis];
      first[to >= 0 ? to : ~to] += to >= 0 ? along[axis][i] : -along[axis][i];
    }
    x[512 + i] = first.x;
    y[512 + i] = first.y;
    z[512 + i] = first.z;
  }
  add_up();
}

}  // namespace cumulet::grid
