#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cumulet::bench {

/// A median with its spread.
struct Spread {
  double median = 0.0;
  double min = 0.0;
  double max = 0.0;
};

inline Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back()};
}

/// Ratios element by element: repeats are interleaved, so neighbors had the same machine load.
inline Spread ratio_of(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) ratios.push_back(a[i] / b[i]);
  return spread_of(std::move(ratios));
}

}  // namespace cumulet::bench
