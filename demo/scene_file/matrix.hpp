#pragma once

#include <array>
#include <cstddef>

namespace cumulet::demo {

using Matrix = std::array<double, 16>;  ///< 4x4, column by column

/// Returns a * b: applies b, then a.
[[nodiscard]] inline Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t i = 0; i < 4; ++i) c[4 * column + row] += a[4 * i + row] * b[4 * column + i];
    }
  }
  return c;
}

}  // namespace cumulet::demo
