#pragma once

#include <cstdint>

namespace cumulet::surface {

/// Limits on the size of a file's contents. Larger requests are refused before allocation.
struct GltfLimits {
  std::uint64_t memory = std::uint64_t{16} << 30U;   ///< bytes, total of all decoded data
  std::uint64_t unbacked = std::uint64_t{1} << 24U;  ///< elements of an accessor that has no buffer view
  std::uint32_t image_side = 16384;                  ///< pixels
};

}  // namespace cumulet::surface
