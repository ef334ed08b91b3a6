#pragma once

// The shapes of clouds: spheres on spheres of decreasing size, stored in a uniform grid for fast lookup.

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "noise.hpp"

namespace cumulet::scene {

struct Sphere {
  glm::vec3 centre;
  float radius;
};

/// Random numbers that are the same on every machine.
class Random {
 public:
  explicit Random(std::uint32_t seed) : state_(seed) {}
  float operator()() { return unit(hash({static_cast<int>(++count_), 0, 0}, state_)); }
  float between(float low, float high) { return low + (high - low) * (*this)(); }

 private:
  std::uint32_t state_;
  std::uint32_t count_ = 0;
};

/// The union of spheres.
class Lobes {
 public:
  /// reach: maximum distance outside that is computed. Requires at least one sphere.
  Lobes(std::vector<Sphere> spheres, float reach);

  [[nodiscard]] glm::vec3 low() const { return low_; }
  [[nodiscard]] glm::vec3 high() const { return high_; }
  [[nodiscard]] float reach() const { return reach_; }

  /// Calls visit(index, signed distance) for each sphere within reach, and for some others.
  template <class Visit>
  void near(const glm::vec3& p, Visit&& visit) const {
    const glm::ivec3 c(glm::floor((p - low_) / cell_));
    if (glm::any(glm::lessThan(c, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(c, size_))) return;
    for (const std::uint32_t i : cells_[index(c)]) {
      visit(i, glm::distance(p, spheres_[i].centre) - spheres_[i].radius);
    }
  }

  /// Returns the signed distance to the union; exact up to `reach` outside, otherwise `reach`.
  [[nodiscard]] float operator()(const glm::vec3& p) const {
    float nearest = reach_;
    near(p, [&](std::uint32_t /*index*/, float distance) { nearest = std::min(nearest, distance); });
    return nearest;
  }

 private:
  [[nodiscard]] std::size_t index(const glm::ivec3& c) const {
    return std::size_t(c.x) + std::size_t(size_.x) * (std::size_t(c.y) + std::size_t(size_.y) * std::size_t(c.z));
  }
  std::vector<Sphere> spheres_;
  float reach_;
  float cell_;
  glm::vec3 low_, high_;
  glm::ivec3 size_{0};
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace cumulet::scene
