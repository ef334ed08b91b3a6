#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "base/progress_part.hpp"

namespace cumulet::light {

/// Entry of an alias table. After an entry is drawn uniformly, the result is the entry itself if a random word is at
/// most `stays`, else `other`.
struct Alias {
  static constexpr std::uint32_t certain = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t stays = certain;
  std::uint32_t other = 0;
};

/// Builds an alias table that samples in proportion to the weights, which must be >= 0 and sum to `sum` > 0 (Walker's
/// alias method: Vose, "A Linear Algorithm for Generating Random Numbers with a Given Distribution", IEEE Transactions
/// on Software Engineering 17(9), 1991). O(n). Throws Error(cancelled).
std::vector<Alias> alias_table(std::vector<double> weights, double sum, const Progress* progress = nullptr);

}  // namespace cumulet::light
