#include <algorithm>
#include <array>
#include <cmath>

#include "lobes.hpp"
#include "noise.hpp"
#include "scene.hpp"

namespace cumulet::scene {

namespace {

using glm::vec3;

// Returns the lobes of the cloud: a few thermals side by side, each a stack of big lobes, with smaller lobes on their
// outer and upper sides.
std::vector<Sphere> make_lobes(std::uint32_t seed) {
  Random random(seed);
  std::vector<Sphere> lobes;
  struct Tower {
    vec3 foot;
    float height, radius;
  };
  const std::array<Tower, 6> towers{{{{-4, 0, 0}, 52, 17},
                                     {{19, 0, 5}, 36, 15},
                                     {{-25, 0, 6}, 27, 13.5F},
                                     {{35, 0, -3}, 20, 10},
                                     {{5, 0, 17}, 24, 13},
                                     {{-9, 0, -17}, 33, 14}}};
  for (const Tower& t : towers) {
    const int floors = 3 + static_cast<int>(t.height / 14.0F);
    for (int i = 0; i < floors; ++i) {
      const float h = (static_cast<float>(i) + 0.35F) / static_cast<float>(floors);
      // The tower narrows with height, which rounds the top.
      const float width = t.radius * (1.05F - 0.55F * h * h) * random.between(0.85F, 1.1F);
      const vec3 lean(random.between(-0.3F, 0.3F) * t.radius, 0.0F, random.between(-0.3F, 0.3F) * t.radius);
      lobes.push_back({t.foot + lean + vec3(0.0F, h * t.height, 0.0F), width});
    }
  }
  std::size_t first = 0;
  for (int generation = 0; generation < 2; ++generation) {
    const std::size_t last = lobes.size();
    const int children = generation == 0 ? 11 : 9;
    for (std::size_t i = first; i < last; ++i) {
      const Sphere parent = lobes[i];
      for (int c = 0; c < children; ++c) {
        const float y = random.between(-0.25F, 1.0F);
        const float angle = random.between(0.0F, 6.2831853F);
        const float ring = std::sqrt(std::max(0.0F, 1.0F - y * y));
        const vec3 direction(ring * std::cos(angle), y, ring * std::sin(angle));
        const float radius = parent.radius * random.between(0.26F, 0.5F);
        const Sphere child{parent.centre + direction * (parent.radius * random.between(0.8F, 1.02F)), radius};
        if (child.centre.y > 0.3F * radius) lobes.push_back(child);
      }
    }
    first = last;
  }
  return lobes;
}

}  // namespace

openvdb::FloatGrid::Ptr make_cumulus(const Settings& settings) {
  const Lobes field(make_lobes(settings.seed), 6.0F);
  // The cloud fills about 92,000 cubic meters.
  const double voxel_size = std::cbrt(92000.0 / settings.voxels);
  const auto finest = static_cast<float>(2.2 * voxel_size);
  const std::uint32_t seed = settings.seed * 977U;

  const auto skip = [&](const vec3& centre, float radius) {
    return field(centre) > std::min(radius + 4.5F, field.reach() - 0.01F) || centre.y + radius < -1.5F;
  };
  const auto value = [&](const vec3& p) -> float {
    const float rough = field(p);
    if (rough >= 4.6F) return 0.0F;
    // Distorts space slightly, so that lobes are not spherical.
    const vec3 q = p + 1.6F * vec3(perlin(p * 0.13F, seed), perlin(p * 0.13F, seed + 1), perlin(p * 0.13F, seed + 2)) +
                   0.55F * vec3(perlin(p * 0.42F, seed + 3), perlin(p * 0.42F, seed + 4), perlin(p * 0.42F, seed + 5));
    const float height = glm::clamp(p.y / 55.0F, 0.0F, 1.0F);
    float distance = -field(q);
    if (distance < 4.5F) {
      // Near the boundary: bumps on the upper parts, wisps below.
      const float crisp = glm::smoothstep(0.02F, 0.25F, height);
      const float bumps = billows(q * 0.26F, finest * 0.26F, seed + 11);
      const float wisps = fbm(q * 0.34F, finest * 0.34F, seed + 7);
      distance += glm::mix(3.2F * (bumps - 0.62F) + 2.6F * wisps, 4.4F * (bumps - 0.45F) + 0.8F * wisps, crisp);
    }
    // A flat base with some hanging shreds.
    const float base = p.y - 1.2F * fbm(vec3(p.x * 0.11F, p.y * 0.22F, p.z * 0.11F), finest * 0.11F, seed + 19);
    distance = std::min(distance, 0.9F * base);
    const float softness = glm::mix(1.9F, 0.55F, glm::smoothstep(0.0F, 0.35F, height));
    const float edge = glm::smoothstep(0.0F, softness, distance);
    if (edge <= 0.0F) return 0.0F;
    // Liquid water increases with height above the base; the core varies a little.
    const float inside = 0.62F + 0.3F * height + 0.22F * fbm(p * 0.09F, std::max(finest * 0.09F, 0.12F), seed + 23);
    return edge * glm::clamp(inside, 0.2F, 1.0F);
  };
  return sample({{"density", 0.004F}}, voxel_size, field.low(), field.high(), skip,
                [&](const vec3& p, float* values) { *values = value(p); })
      .front();
}

}  // namespace cumulet::scene
