#include "lobes.hpp"

#include <cmath>
#include <utility>

namespace cumulet::scene {

Lobes::Lobes(std::vector<Sphere> spheres, float reach)
    : spheres_(std::move(spheres)), reach_(reach), cell_(reach / 1.5F), low_(1e9F), high_(-1e9F) {
  for (const Sphere& s : spheres_) {
    low_ = glm::min(low_, s.centre - s.radius);
    high_ = glm::max(high_, s.centre + s.radius);
  }
  low_ -= reach_;
  high_ += reach_;
  size_ = glm::ivec3(glm::ceil((high_ - low_) / cell_)) + 1;
  cells_.resize(std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z));
  for (std::uint32_t i = 0; i < spheres_.size(); ++i) {
    const Sphere& s = spheres_[i];
    const glm::ivec3 a((s.centre - s.radius - reach_ - low_) / cell_);
    const glm::ivec3 b((s.centre + s.radius + reach_ - low_) / cell_);
    for (int x = std::max(a.x, 0); x <= std::min(b.x, size_.x - 1); ++x) {
      for (int y = std::max(a.y, 0); y <= std::min(b.y, size_.y - 1); ++y) {
        for (int z = std::max(a.z, 0); z <= std::min(b.z, size_.z - 1); ++z) cells_[index({x, y, z})].push_back(i);
      }
    }
  }
}

}  // namespace cumulet::scene
