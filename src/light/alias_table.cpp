#include "light/alias_table.hpp"

#include <utility>

namespace cumulet::light {

std::vector<Alias> alias_table(std::vector<double> weights, double sum, const Progress* progress) {
  const std::size_t n = weights.size();
  std::vector<Alias> table(n);
  std::vector<std::uint32_t> small;
  std::vector<std::uint32_t> large;
  for (std::uint32_t i = 0; i < n; ++i) {
    table[i].other = i;
    weights[i] *= static_cast<double>(n) / sum;  // relative to the mean
    (weights[i] < 1.0 ? small : large).push_back(i);
  }
  check(progress);
  // Entries that remain, because of rounding or because their weight is the mean, return themselves.
  while (!small.empty() && !large.empty()) {
    const std::uint32_t low = small.back();
    const std::uint32_t high = large.back();
    small.pop_back();
    table[low] = {static_cast<std::uint32_t>(weights[low] * Alias::certain), high};
    weights[high] -= 1.0 - weights[low];
    if (weights[high] < 1.0) {
      large.pop_back();
      small.push_back(high);
    }
  }
  check(progress);
  return table;
}

}  // namespace cumulet::light
