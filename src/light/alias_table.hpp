#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "base/progress_part.hpp"

namespace cumulet::light {

/// Of an entry, drawn evenly: it stands for itself where a random word is at most `stays`, else for `other`.
struct Alias {
  static constexpr std::uint32_t certain = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t stays = certain;
  std::uint32_t other = 0;
};

/// Picks in proportion to weights, which are not negative and sum to `sum`, above 0 (Walker's alias method: Vose, "A
/// Linear Algorithm for Generating Random Numbers with a Given Distribution", IEEE Transactions on Software Engineering
/// 17(9), 1991). O(n). Throws Error(cancelled).
std::vector<Alias> alias_table(std::vector<double> weights, double sum, const Progress* progress = nullptr);

}  // namespace cumulet::light
