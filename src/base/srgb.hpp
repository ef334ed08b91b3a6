#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace cumulet {

/// The linear value of each 8-bit sRGB value.
inline std::array<float, 256> srgb_decoding() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double v = static_cast<double>(i) / 255.0;
    table[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return table;
}

}  // namespace cumulet
