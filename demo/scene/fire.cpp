#include <algorithm>
#include <cmath>

#include "noise.hpp"
#include "scene.hpp"

namespace cumulet::scene {

namespace {

using glm::vec3;

struct Fire {
  std::uint32_t seed;
  float finest;

  // The air rises and curls: everything is looked up where it came from.
  [[nodiscard]] vec3 warp(const vec3& p) const {
    const float turbulence = 0.12F + 0.1F * std::max(p.y, 0.0F);
    const vec3 q(p.x * 0.9F, p.y * 0.55F, p.z * 0.9F);
    return p + turbulence *
                   vec3(fbm(q, finest * 0.9F, seed), 0.6F * fbm(q, finest * 0.9F, seed + 40),
                        fbm(q, finest * 0.9F, seed + 80)) *
                   2.4F;
  }

  // Depth inside a tongue of flame, negative outside.
  [[nodiscard]] float flame(const vec3& p) const {
    const vec3 q = warp(p);
    float depth = -1.0F;
    for (int i = 0; i < 7; ++i) {
      const std::uint32_t h = hash({i, 7, 1}, seed);
      const float angle = 6.2831853F * unit(h);
      const float away = i == 0 ? 0.0F : 0.35F + 0.55F * unit(h * 0x9e3779b1U);
      const vec3 foot(away * std::cos(angle), 0.0F, away * std::sin(angle));
      const float tall = i == 0 ? 5.2F : 2.4F + 2.0F * unit(h * 0x85ebca77U);
      const float up = q.y / tall;
      if (up > 1.15F || up < -0.1F) continue;
      // A tongue: swells over the fuel, then tapers to a tip.
      const float width =
          0.55F * std::sqrt(std::max(0.0F, up + 0.06F)) * std::pow(std::max(0.0F, 1.12F - up), 1.1F) * 2.0F;
      depth = std::max(depth, width - glm::length(vec3(q.x - foot.x, 0.0F, q.z - foot.z)));
    }
    return depth;
  }
};

}  // namespace

std::vector<openvdb::FloatGrid::Ptr> make_fire(const Settings& settings) {
  const double voxel_size = std::cbrt(30.0 / settings.voxels);
  const Fire fire{settings.seed * 131U + 5U, static_cast<float>(2.2 * voxel_size)};
  const vec3 low(-2.6F, -0.1F, -2.6F);
  const vec3 high(2.6F, 8.5F, 2.6F);
  const auto never = [](const vec3& /*centre*/, float /*radius*/) { return false; };
  const auto temperature = [&](const vec3& p) -> float {
    const float depth = fire.flame(p);
    if (depth <= 0.0F) return 0.0F;
    const float hot = glm::smoothstep(0.0F, 0.45F, depth);
    return 700.0F + 1250.0F * hot * (1.0F - 0.06F * std::max(0.0F, p.y));
  };
  const auto smoke = [&](const vec3& p) -> float {
    const vec3 q = fire.warp(p);
    const float rise = glm::smoothstep(1.2F, 4.0F, q.y) * (1.0F - glm::smoothstep(6.2F, 8.2F, q.y));
    if (rise <= 0.0F) return 0.0F;
    const float radius = 0.45F + 0.2F * q.y;
    const float plume = radius - glm::length(vec3(q.x, 0.0F, q.z)) +
                        0.9F * (billows(q * 1.1F, fire.finest * 1.1F, fire.seed + 200) - 0.5F);
    return 3.0F * rise * glm::smoothstep(0.0F, 0.5F, plume);
  };
  return {sample("density", voxel_size, low, high, 0.01F, never, smoke),
          sample("temperature", voxel_size, low, high, 1.0F, never, temperature)};
}

}  // namespace cumulet::scene
