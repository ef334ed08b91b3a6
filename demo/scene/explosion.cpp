#include <array>
#include <cmath>
#include <stdexcept>

#include "lobes.hpp"
#include "noise.hpp"
#include "scene.hpp"

namespace cumulet::scene {

namespace {

using glm::vec3;

constexpr float turn = 6.2831853F;

// State of the explosion at `time`, from 0 (detonation) to 1.
struct Moment {
  float time;
  float spread;  // size of the expanding parts: first a blast, then slow drift
  float height;  // height of the ring's center
  float roll;    // rotation of the ring in radians: upwards in the middle, downwards outside
  float heat;

  explicit Moment(float t)
      : time(t),
        spread((1.0F - std::exp(-6.0F * t)) * (0.8F + 0.3F * t)),
        height(1.5F + 9.0F * t * t / (t + 0.3F)),
        roll(2.4F * t),
        heat(std::exp(-0.45F * t)) {}
};

/// Spheres with a gas temperature each, maximum 1.
struct Billows {
  std::vector<Sphere> spheres;
  std::vector<float> heats;

  void add(const vec3& centre, float radius, float heat) {
    spheres.push_back({centre, radius});
    heats.push_back(heat);
  }
};

struct Explosion {
  std::uint32_t seed;
  Moment now;

  /// Adds the spheres of the ring that the fireball rolls up into, with their children.
  void ring(Billows& big, Billows& all) const {
    Random random(seed);
    constexpr int count = 34;
    for (int i = 0; i < count; ++i) {
      const float theta = 2.3999632F * static_cast<float>(i);  // golden angle, so that positions do not repeat
      const float start = turn * random();
      const float phi = start - now.roll;
      const float out = random.between(0.55F, 1.0F);
      const float major = now.spread * (1.9F + 1.5F * now.time) * random.between(0.85F, 1.12F);
      const float minor = now.spread * 1.75F * out;
      const vec3 radial(std::cos(theta), 0.0F, std::sin(theta));
      const float ring_out = major + minor * std::cos(phi);
      const vec3 centre = radial * ring_out + vec3(0.0F, now.height + 0.85F * minor * std::sin(phi), 0.0F);
      const float radius = now.spread * random.between(1.05F, 1.75F);
      const float heat = now.heat * random.between(0.75F, 1.0F);
      big.add(centre, radius, heat);
      children(random, centre, radius, heat, radial, phi, 0, all);
    }
    // The dome, and the filling of the middle.
    for (int i = 0; i < 9; ++i) {
      const float theta = 2.3999632F * static_cast<float>(i);
      const float away = now.spread * 1.35F * std::sqrt(random());
      const vec3 radial(std::cos(theta), 0.0F, std::sin(theta));
      const vec3 centre = radial * away + vec3(0.0F, now.height + now.spread * random.between(-0.6F, 1.7F), 0.0F);
      const float radius = now.spread * random.between(1.3F, 1.8F);
      const float heat = now.heat * random.between(0.9F, 1.0F);
      big.add(centre, radius, heat);
      children(random, centre, radius, heat, radial, -0.5F * now.roll, 0, all);
    }
  }

  void children(Random& random, const vec3& centre, float radius, float heat, const vec3& radial, float phi,
                int generation, Billows& all) const {
    all.add(centre, radius, heat);
    if (generation == 2) return;
    const vec3 tangent(-radial.z, 0.0F, radial.x);
    const vec3 out = std::cos(phi) * radial + std::sin(phi) * vec3(0.0F, 1.0F, 0.0F);
    const vec3 up = glm::cross(tangent, out);
    const int count = generation == 0 ? 12 : 7;
    for (int c = 0; c < count; ++c) {
      const float y = random.between(-1.0F, 1.0F);
      const float angle = turn * random();
      const float circle = std::sqrt(1.0F - y * y);
      const vec3 way = circle * std::cos(angle) * out + y * up + circle * std::sin(angle) * tangent;
      const float size = radius * random.between(0.3F, 0.5F);
      const vec3 at = centre + way * (radius * random.between(0.78F, 1.0F));
      children(random, at, size, heat * 0.96F, radial, phi, generation + 1, all);
    }
  }

  /// Adds the stem below the ring, and the dust that spreads over the ground.
  void stem(Billows& big, Billows& all) const {
    Random random(seed + 1);
    const vec3 x(1.0F, 0.0F, 0.0F);
    for (int i = 0; i < 13; ++i) {
      const float h = (static_cast<float>(i) + 0.5F) / 13.0F;
      const float top = now.height - 0.4F * now.spread;
      const float waist = 1.0F - 0.55F * std::sin(0.5F * turn * h);
      const float radius = now.spread * (0.55F + 0.85F * waist) * random.between(0.7F, 1.0F);
      const float away = now.spread * random.between(0.1F, 0.7F);
      const float theta = turn * random() + 1.5F * now.time;
      const vec3 centre(away * std::cos(theta), 0.35F + h * top, away * std::sin(theta));
      const float heat = now.heat * (0.25F + 0.65F * h);
      big.add(centre, radius, heat);
      children(random, centre, radius, heat, x, 2.0F * h - now.roll, 0, all);
    }
    for (int i = 0; i < 26; ++i) {
      const float theta = 2.3999632F * static_cast<float>(i) + random.between(-0.2F, 0.2F);
      const float away = (0.6F + 4.6F * (1.0F - std::exp(-2.2F * now.time))) * random.between(0.55F, 1.1F);
      const float radius = (0.35F + 0.8F * (1.0F - std::exp(-3.0F * now.time))) * random.between(0.55F, 1.15F);
      const vec3 centre(away * std::cos(theta), 0.45F * radius, away * std::sin(theta));
      const float heat = 0.5F * now.heat * std::exp(-5.0F * now.time);
      big.add(centre, radius, heat);
      children(random, centre, radius, heat, vec3(std::cos(theta), 0.0F, std::sin(theta)), -now.roll, 1, all);
    }
  }

  /// Adds burning debris on parabolas with air drag, and its smoke.
  void debris(Billows& big, Billows& all) const {
    Random random(seed + 2);
    const vec3 x(1.0F, 0.0F, 0.0F);
    for (int i = 0; i < 13; ++i) {
      const float theta = 2.3999632F * static_cast<float>(i) + random.between(-0.3F, 0.3F);
      const float steep = random.between(0.35F, 1.25F);
      const vec3 way(std::cos(theta) * std::cos(steep), std::sin(steep), std::sin(theta) * std::cos(steep));
      const float range = random.between(7.5F, 12.5F);
      const float size = random.between(0.13F, 0.28F);
      constexpr int puffs = 70;
      for (int k = 0; k <= puffs; ++k) {
        const float then = static_cast<float>(k) / puffs;  // time at which the piece left the puff behind
        const float age = now.time - then;
        const vec3 drift(random.between(-1.0F, 1.0F), random.between(-0.3F, 1.3F), random.between(-1.0F, 1.0F));
        const float share = random.between(0.75F, 1.15F);
        const float along = range * (1.0F - std::exp(-3.6F * then));
        const vec3 centre = way * along + vec3(0.0F, 0.8F - 6.0F * then * then, 0.0F) + age * 0.7F * drift;
        // Puffs inside the fireball are invisible, so skip them.
        const bool hidden = glm::distance(centre, vec3(0.0F, now.height, 0.0F)) < 2.2F * now.spread;
        if (age < 0.0F || age > 0.8F * now.time || centre.y < 0.05F || hidden) continue;
        const float radius = size * (0.5F + 1.6F * std::sqrt(age)) * share;
        const float heat = std::exp(-1.0F * now.time - 12.0F * age);
        big.add(centre, radius, heat);
        Random own(seed + 1000U * static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(k));
        children(own, centre, radius, heat, x, 0.0F, 1, all);
      }
    }
  }
};

}  // namespace

std::vector<openvdb::FloatGrid::Ptr> make_explosion(const Settings& settings, int frame) {
  if (frame < 1 || frame > explosion_frames) throw std::runtime_error("the explosion has frames 1 to 20");
  const Explosion explosion{settings.seed * 131U + 5U, Moment(static_cast<float>(frame) / explosion_frames)};
  const Moment& now = explosion.now;
  // The last frame fills about 560 cubic meters.
  const double voxel_size = std::cbrt(560.0 / settings.voxels);
  const auto finest = static_cast<float>(2.2 * voxel_size);
  const std::uint32_t seed = explosion.seed;
  Billows big;
  Billows all;
  explosion.ring(big, all);
  explosion.stem(big, all);
  explosion.debris(big, all);
  const Lobes rough(big.spheres, 1.0F);
  const Lobes fine(all.spheres, 0.8F);

  const auto skip = [&](const vec3& centre, float radius) {
    return fine(centre) > std::min(radius + 0.75F, fine.reach() - 0.01F) || centre.y + radius < 0.0F;
  };
  const auto values = [&](const vec3& p, float* out) {
    if (p.y < 0.0F) return;
    // The detail moves with the rising gas and stretches as it expands.
    const vec3 own = (p - vec3(0.0F, now.height, 0.0F)) / (0.45F + 0.55F * now.spread) +
                     vec3(0.0F, 0.8F * now.time * std::exp(-0.2F * (p.x * p.x + p.z * p.z)), 0.0F);
    const vec3 bent =
        p + 0.22F * vec3(perlin(own * 0.8F, seed), perlin(own * 0.8F, seed + 1), perlin(own * 0.8F, seed + 2)) +
        0.09F * vec3(perlin(own * 2.3F, seed + 3), perlin(own * 2.3F, seed + 4), perlin(own * 2.3F, seed + 5));
    // Depth below the big spheres with smoothed seams: gas that sticks out has cooled.
    float depth = -1e9F;
    float sum = 1e-12F;
    float heat = 0.0F;
    rough.near(bent, [&](std::uint32_t i, float distance) {
      depth = std::max(depth, -distance);
      const float weight = std::exp(-5.0F * distance);
      sum += weight;
      heat += weight * big.heats[i];
    });
    heat /= sum;
    const float below = 0.2F * std::log(sum);

    float bump = 0.5F;
    if (depth < 0.7F) {  // near the boundary
      depth = -fine(bent);
      if (depth < -0.35F) return;
      bump = billows(own * 1.5F, finest * 1.5F, seed + 11);
      depth += 0.62F * (bump - 0.5F);
    }
    const float edge = glm::smoothstep(0.0F, 0.16F, depth);
    if (edge <= 0.0F) return;
    const float patches = fbm(own * 0.55F, std::max(finest * 0.55F, 0.1F), seed + 23);
    const float crust = -0.25F + 0.95F * now.time;
    const float hot = glm::smoothstep(-0.55F, 0.75F, below - crust + 1.1F * patches - 1.2F * (bump - 0.5F)) * heat;
    // Quantized in invisible steps, which compress better.
    const auto stepped = [](float value) { return std::round(value * 128.0F) / 128.0F; };
    out[0] = stepped(edge * (1.0F - 0.6F * glm::smoothstep(0.2F, 0.8F, hot)) *
                     glm::clamp(0.85F + 0.5F * patches, 0.4F, 1.0F));
    out[1] = stepped(1.6F * hot);
    out[2] = stepped(glm::smoothstep(0.35F, 0.75F, hot) * edge);
  };
  const vec3 low = glm::max(fine.low(), vec3(-1e9F, 0.0F, -1e9F));
  return sample({{"density", 0.01F}, {"temperature", 0.02F}, {"flame", 0.01F}}, voxel_size, low, fine.high(), skip,
                values);
}

}  // namespace cumulet::scene
