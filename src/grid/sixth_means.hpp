#pragma once

#include <cstddef>

namespace cumulet::grid {

// Means over a sixth of a cell, 1 >= u >= v >= w >= 0 along the axes of its frame (docs/architecture/interpolation.md).

/// Monomials u^a v^b w^c of the trilinear function, and corners of the cell (a, b, c), by three bits.
inline constexpr std::size_t sixth_monomials = 8;

constexpr unsigned exponent_in(std::size_t monomial, unsigned axis) {
  return static_cast<unsigned>(monomial >> axis) & 1U;
}

/// Mean of a product of two monomials and, with axis 0 to 2, of the coordinate along this axis.
constexpr double mean_of_product(std::size_t i, std::size_t j, unsigned axis = 3) {
  const auto exponent = [&](unsigned of) { return exponent_in(i, of) + exponent_in(j, of) + (axis == of ? 1U : 0U); };
  const unsigned a = exponent(0);
  const unsigned b = exponent(1);
  const unsigned c = exponent(2);
  return 6.0 / ((c + 1.0) * (b + c + 2.0) * (a + b + c + 3.0));
}

/// Mean weight of a corner in the trilinear interpolation, with axis 0 to 2 times the coordinate along this axis.
constexpr double mean_of_weight(std::size_t corner, unsigned axis = 3) {
  double mean = 0.0;
  for (std::size_t i = 0; i < sixth_monomials; ++i) {
    if ((i & corner) != corner) continue;
    double sign = 1.0;
    for (unsigned other = 0; other < 3; ++other) sign = exponent_in(i ^ corner, other) != 0 ? -sign : sign;
    mean += sign * mean_of_product(i, 0, axis);
  }
  return mean;
}

}  // namespace cumulet::grid
