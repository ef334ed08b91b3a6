#include "render/pacing/grid_pace.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace cumulet::render {

double GridPace::ms(const gl::ProgramKey& key, double cost) const {
  const auto known = known_.find(key);
  return known == known_.end() ? cost : known->second;
}

void GridPace::learn(const std::vector<Sent>& sent, double ms, Measured measured) {
  double expected = 0.0;
  bool first = false;
  for (const Sent& s : sent) {
    expected += this->ms(s.key, s.cost) * s.weight * s.items;
    first = known_.try_emplace(s.key, s.cost).second || first;
  }
  if (first) return;
  // Late measurements must not slow down the build much.
  const double most = measured == Measured::exactly ? 64.0 : 4.0;
  constexpr double least = 1.0 / 64.0;
  constexpr double min_items = 64.0;
  const double step = std::sqrt(std::clamp(ms / std::max(expected, 1e-6), 0.25, 4.0));
  std::set<gl::ProgramKey> known;
  for (const Sent& s : sent) {
    // A dispatch of few items mostly measures its overhead. Several dispatches of a kernel count as one measurement.
    if (s.items < min_items || !known.insert(s.key).second) continue;
    double& of = known_.at(s.key);
    of = std::clamp(of * step, least * s.cost, most * s.cost);
  }
}

}  // namespace cumulet::render
