#include "grid/emission.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::grid {

Emission::Emission(Radiance radiance, const Cube& cube, Progress* progress) : radiance_(std::move(radiance)) {
  for (std::size_t i = 0; i < statistics_.size(); ++i)
    statistics_[i] = std::make_unique<const Statistics>(radiance_[i], cube, progress);
}

double Emission::mean_radiance() const {
  double most = 0.0;
  for (const auto& statistics : statistics_) most = std::max(most, statistics->mean_optical_depth());
  return most;
}

float Emission::max_radiance() const {
  return std::max({radiance_[0].max_value, radiance_[1].max_value, radiance_[2].max_value});
}

bool Emission::is_zero(const glm::ivec3& corner) const {
  return std::ranges::all_of(statistics_, [&](const auto& statistics) {
    const Statistics::Node& node = statistics->node_at(corner);
    return node.is_uniform() && node.uniform == 0.0F;
  });
}

}  // namespace cumulet::grid
