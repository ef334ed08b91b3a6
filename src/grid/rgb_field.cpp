#include "grid/rgb_field.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::grid {

RgbField::RgbField(Components components, const Cube& cube, Progress* progress) : components_(std::move(components)) {
  for (std::size_t i = 0; i < statistics_.size(); ++i)
    statistics_[i] = std::make_unique<const Statistics>(components_[i], cube, progress);
}

glm::dvec3 RgbField::mean_depth() const {
  return {statistics_[0]->mean_optical_depth(), statistics_[1]->mean_optical_depth(),
          statistics_[2]->mean_optical_depth()};
}

float RgbField::max_value() const {
  return std::max({components_[0].max_value, components_[1].max_value, components_[2].max_value});
}

bool RgbField::is_zero(const glm::ivec3& corner) const {
  return std::ranges::all_of(statistics_, [&](const auto& statistics) {
    const Statistics::Node& node = statistics->node_at(corner);
    return node.is_uniform() && node.uniform == 0.0F;
  });
}

}  // namespace cumulet::grid
