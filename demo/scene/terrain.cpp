#include "terrain.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "noise.hpp"

namespace cumulet::scene {

using glm::vec2;
using glm::vec3;

namespace {

/// Musgrave's ridged multifractal (Texturing and Modeling, 1994), about 0 to 1.
float ridged(const vec2& p, std::uint32_t seed) {
  float sum = 0.0F;
  float weight = 1.0F;
  float frequency = 1.0F;
  float amplitude = 0.5F;
  for (std::uint32_t octave = 0; octave < 6; ++octave) {
    const float crest = 1.0F - std::abs(perlin(vec3(p.x * frequency, 0.37F, p.y * frequency), seed + octave));
    const float signal = crest * crest * weight;
    sum += amplitude * signal;
    weight = glm::clamp(1.6F * signal, 0.0F, 1.0F);
    frequency *= 2.07F;
    amplitude *= 0.52F;
  }
  return sum;
}

float flat_fbm(const vec2& p, std::uint32_t seed) { return fbm(vec3(p.x, 0.71F, p.y), 0.03F, seed); }

// A crest line: points with x, z and height. reach: width of the flanks.
struct Crest {
  std::array<vec3, 6> points;
  float reach;
};
constexpr std::array<Crest, 5> crests{{
    // The main ridge: from the west down to the saddle with the tower, up to the summit in the cloud, and on to the
    // east.
    {{{{-330, -190, 62}, {-190, -120, 38}, {-100, -44, 20}, {-44, 0, -12}, {-4, -6, -8}, {36, -16, 33}}}, 22.0F},
    {{{{36, -16, 33}, {72, -46, 14}, {122, -84, 22}, {180, -130, 40}, {250, -190, 30}, {330, -230, 60}}}, 30.0F},
    // The horizon.
    {{{{-340, -300, 40}, {-190, -330, 66}, {-60, -310, 30}, {60, -340, 58}, {190, -310, 40}, {340, -330, 70}}}, 60.0F},
    // A spur into the foreground on the left, and one on the right.
    {{{{-100, -44, 20}, {-98, 0, -2}, {-110, 40, -10}, {-104, 86, -24}, {-120, 130, -34}, {-150, 200, -30}}}, 24.0F},
    {{{{36, -16, 33}, {58, 10, 0}, {84, 34, -16}, {98, 74, -26}, {130, 120, -30}, {220, 170, -10}}}, 20.0F},
}};
constexpr float valley = -36.0F;

float relief(const vec2& p) {
  float height = 0.0F;
  for (const Crest& crest : crests) {
    float here = 0.0F;
    for (std::size_t i = 0; i + 1 < crest.points.size(); ++i) {
      const vec2 a(crest.points[i].x, crest.points[i].y);
      const vec2 b(crest.points[i + 1].x, crest.points[i + 1].y);
      const float t = glm::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0F, 1.0F);
      const float away = glm::distance(p, a + t * (b - a));
      const float top = glm::mix(crest.points[i].z, crest.points[i + 1].z, t) - valley;
      // Steep at the crest, flat towards the valley.
      here = std::max(here, top * std::exp(-away / crest.reach));
    }
    height = std::max(height, here) + 0.2F * std::min(height, here);
  }
  return height;
}

std::uint8_t byte(float value) {
  return static_cast<std::uint8_t>(std::lround(glm::clamp(value, 0.0F, 1.0F) * 255.0F));
}

}  // namespace

Terrain::Terrain(std::uint32_t seed) : seed_(seed * 7919U), heights_(std::size_t(side) * std::size_t(side)) {
  raise();
  crumble();
  erode();
  crumble();
}

void Terrain::raise() {
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const vec2 p = low + spacing * vec2(i, j);
      const vec2 bent = p + 20.0F * vec2(flat_fbm(p * 0.02F, seed_), flat_fbm(p * 0.02F, seed_ + 20)) +
                        6.0F * vec2(flat_fbm(p * 0.09F, seed_ + 40), flat_fbm(p * 0.09F, seed_ + 60));
      const float base = relief(bent);
      // Spurs and couloirs at high altitude, ripples in the valley.
      const float spurs = 0.65F * ridged(bent * 0.017F, seed_ + 80) + 0.35F * ridged(bent * 0.043F, seed_ + 90) - 0.55F;
      const float rough = 0.10F + 0.90F * glm::smoothstep(4.0F, 45.0F, base);
      at(i, j) = valley + base * (1.0F + 0.25F * flat_fbm(p * 0.03F, seed_ + 110)) + rough * 40.0F * spurs +
                 3.0F * flat_fbm(p * 0.05F, seed_ + 100);
    }
  }
}

// Hydraulic erosion by rain drops, which carry as much soil downhill as their speed and the slope allow (Beyer,
// "Implementation of a method for hydraulic erosion", 2015). Lengths are in units of the spacing.
void Terrain::erode() {
  constexpr int drops = 90000;
  constexpr int lifetime = 56;
  constexpr int radius = 2;
  for (float& h : heights_) h /= spacing;
  const auto gradient = [this](const vec2& p, float& height) {
    const glm::ivec2 c(p);
    const vec2 f = p - vec2(c);
    const float h00 = at(c.x, c.y);
    const float h10 = at(c.x + 1, c.y);
    const float h01 = at(c.x, c.y + 1);
    const float h11 = at(c.x + 1, c.y + 1);
    height = glm::mix(glm::mix(h00, h10, f.x), glm::mix(h01, h11, f.x), f.y);
    return vec2(glm::mix(h10 - h00, h11 - h01, f.y), glm::mix(h01 - h00, h11 - h10, f.x));
  };
  const auto inside = [](const vec2& p) {
    return p.x >= radius && p.y >= radius && p.x < side - 2 - radius && p.y < side - 2 - radius;
  };
  for (int drop = 0; drop < drops; ++drop) {
    vec2 p = vec2(unit(hash({drop, 0, 3}, seed_)), unit(hash({drop, 1, 3}, seed_))) * static_cast<float>(side - 1);
    vec2 direction(0.0F);
    float speed = 1.0F;
    float water = 1.0F;
    float soil = 0.0F;
    for (int step = 0; step < lifetime && inside(p); ++step) {
      float height = 0.0F;
      const vec2 slope = gradient(p, height);
      direction = 0.1F * direction - 0.9F * slope;
      const float length = glm::length(direction);
      if (length < 1e-6F) break;
      direction /= length;
      const vec2 next = p + direction;
      if (!inside(next)) break;
      float below = 0.0F;
      gradient(next, below);
      const float drop_height = below - height;
      const float capacity = std::clamp(-drop_height, 0.01F, 0.8F) * speed * water * 0.5F;
      const glm::ivec2 c(p);
      if (soil > capacity || drop_height > 0.0F) {
        // The drop fills the pit that it ran into, or deposits the soil that it cannot carry.
        const float amount = drop_height > 0.0F ? std::min(drop_height, soil) : 0.25F * (soil - capacity);
        soil -= amount;
        const vec2 f = p - vec2(c);
        at(c.x, c.y) += amount * (1.0F - f.x) * (1.0F - f.y);
        at(c.x + 1, c.y) += amount * f.x * (1.0F - f.y);
        at(c.x, c.y + 1) += amount * (1.0F - f.x) * f.y;
        at(c.x + 1, c.y + 1) += amount * f.x * f.y;
      } else {
        const float amount = std::min(0.15F * (capacity - soil), -0.5F * drop_height);
        // Erodes a disk with the weights of a cone, because erosion at a point would dig holes.
        for (int y = -radius; y <= radius; ++y) {
          for (int x = -radius; x <= radius; ++x) {
            const float weight = 2.2F - std::sqrt(static_cast<float>(x * x + y * y));
            if (weight > 0.0F) at(c.x + x, c.y + y) -= amount * weight / 11.36F;
          }
        }
        soil += amount;
      }
      speed = std::min(std::sqrt(std::max(speed * speed - drop_height, 0.01F)), 3.0F);
      water *= 0.98F;
      p = next;
    }
  }
  for (float& h : heights_) h *= spacing;
}

// Thermal erosion: rock above the talus angle falls to the lower neighbors (Musgrave et al., "The synthesis and
// rendering of eroded fractal terrains", 1989).
void Terrain::crumble() {
  constexpr float talus = 1.35F * spacing;
  constexpr std::array<glm::ivec2, 4> neighbours{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  for (int pass = 0; pass < 24; ++pass) {
    const std::vector<float> before = heights_;
    for (int j = 1; j + 1 < side; ++j) {
      for (int i = 1; i + 1 < side; ++i) {
        const float here = before[std::size_t(i) + std::size_t(side) * std::size_t(j)];
        for (const glm::ivec2& step : neighbours) {
          const float there = before[std::size_t(i + step.x) + std::size_t(side) * std::size_t(j + step.y)];
          const float fall = 0.2F * std::max(here - there - talus, 0.0F);
          at(i, j) -= fall;
          at(i + step.x, j + step.y) += fall;
        }
      }
    }
  }
}

float Terrain::height(float x, float z) const {
  const vec2 p = glm::clamp((vec2(x, z) - low) / spacing, vec2(0.0F), vec2(static_cast<float>(side) - 1.001F));
  const glm::ivec2 c(p);
  const vec2 f = p - vec2(c);
  return glm::mix(glm::mix(at(c.x, c.y), at(c.x + 1, c.y), f.x), glm::mix(at(c.x, c.y + 1), at(c.x + 1, c.y + 1), f.x),
                  f.y);
}

vec3 Terrain::normal(float x, float z) const {
  const float d = spacing;
  return glm::normalize(vec3(height(x - d, z) - height(x + d, z), 2.0F * d, height(x, z - d) - height(x, z + d)));
}

void Terrain::level(const vec2& centre, float height, float inner, float outer) {
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const float away = glm::distance(low + spacing * vec2(i, j), centre);
      at(i, j) = glm::mix(height, at(i, j), glm::smoothstep(inner, outer, away));
    }
  }
}

Mesh Terrain::ground() const {
  Mesh mesh;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const vec2 p = low + spacing * vec2(i, j);
      const float y = at(i, j);
      const vec3 n = normal(p.x, p.y);
      mesh.position.emplace_back(p.x, y, p.y);
      mesh.normal.push_back(n);
      // Distorted, so that tiles do not line up.
      mesh.uv.push_back(p / 17.0F + 0.4F * vec2(flat_fbm(p * 0.03F, seed_ + 200), flat_fbm(p * 0.03F, seed_ + 220)));

      const float blotch = flat_fbm(p * 0.06F, seed_ + 120);
      const float fine = flat_fbm(p * 0.25F, seed_ + 140);
      const float strata = 0.5F + 0.5F * std::sin(0.9F * y + 6.0F * blotch + 2.0F * fine);
      vec3 color = glm::mix(vec3(0.34F, 0.29F, 0.245F), vec3(0.52F, 0.45F, 0.38F), strata);
      color *= 0.85F + 0.5F * fine;
      const float flat = n.y + 0.10F * fine + 0.06F * blotch;
      // Scree below the cliffs, grass below the scree, snow on gentle slopes at the top.
      color = glm::mix(color, vec3(0.46F, 0.42F, 0.36F), glm::smoothstep(0.70F, 0.82F, flat));
      const float green = glm::smoothstep(0.60F, 0.80F, flat) * glm::smoothstep(8.0F, -8.0F, y + 12.0F * blotch);
      color = glm::mix(color, glm::mix(vec3(0.14F, 0.21F, 0.06F), vec3(0.30F, 0.29F, 0.10F), 0.5F + blotch), green);
      const float snow = glm::smoothstep(0.42F, 0.58F, flat) * glm::smoothstep(4.0F, 16.0F, y + 16.0F * blotch);
      color = glm::mix(color, vec3(0.86F, 0.88F, 0.92F), snow);
      color = glm::mix(vec3(0.10F, 0.09F, 0.075F), color, glm::smoothstep(lake_level, lake_level + 1.5F, y));
      // Gullies are darker than spurs.
      const int a = std::clamp(i, 2, side - 3);
      const int b = std::clamp(j, 2, side - 3);
      const float hollow = 0.25F * (at(a - 2, b) + at(a + 2, b) + at(a, b - 2) + at(a, b + 2)) - at(a, b);
      color *= glm::clamp(1.0F - 0.16F * hollow, 0.65F, 1.2F);
      mesh.color.emplace_back(byte(color.r), byte(color.g), byte(color.b), 255);
    }
  }
  for (std::uint32_t j = 0; j + 1 < side; ++j) {
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const std::uint32_t a = i + side * j;
      mesh.index.insert(mesh.index.end(), {a, a + side, a + 1, a + 1, a + side, a + side + 1});
    }
  }
  return mesh;
}

Mesh Terrain::forest() const {
  Mesh mesh;
  constexpr int tries = 45000;
  constexpr int sides = 6;
  for (int i = 0; i < tries; ++i) {
    const auto random = [&](int k) { return unit(hash({i, k, 5}, seed_)); };
    const vec2 p = low + 15.0F + (spacing * static_cast<float>(side) - 30.0F) * vec2(random(0), random(1));
    const float y = height(p.x, p.y);
    const vec3 n = normal(p.x, p.y);
    const float grove = flat_fbm(p * 0.035F, seed_ + 160);
    if (y < lake_level + 1.2F || y > -9.0F + 14.0F * grove || n.y < 0.58F || random(2) > 0.40F + 2.2F * grove) continue;
    const float tall = glm::mix(2.2F, 4.6F, random(3));
    const std::size_t first = mesh.position.size();
    // Two cones of branches.
    const vec3 foot(p.x, y - 0.3F, p.y);
    mesh.turned(foot, {{0.30F * tall, 0.12F * tall}, {0.10F * tall, 0.62F * tall}}, sides);
    mesh.turned(foot, {{0.21F * tall, 0.50F * tall}, {0.0F, tall}}, sides);
    const vec3 green = vec3(0.045F, 0.085F, 0.03F) * (0.7F + 0.7F * random(4));
    mesh.color.resize(first);
    mesh.color.resize(mesh.position.size(), glm::u8vec4(byte(green.r), byte(green.g), byte(green.b), 255));
  }
  return mesh;
}

Detail make_detail(std::uint32_t seed) {
  constexpr int size = 256;
  // Noise that tiles, made by blending four shifted copies.
  const auto tile = [&](const vec2& p) {
    const auto rock = [&](const vec2& q) {
      return 0.6F * ridged(q * 5.0F, seed + 300) +
             0.7F * (0.5F - std::abs(fbm(vec3(q * 12.0F, 0.2F), 0.05F, seed + 320)));
    };
    const vec2 w = glm::smoothstep(vec2(0.35F), vec2(1.0F), p);
    const float straight = glm::mix(rock(p), rock(p - vec2(1, 0)), w.x);
    const float shifted = glm::mix(rock(p - vec2(0, 1)), rock(p - vec2(1, 1)), w.x);
    return glm::mix(straight, shifted, w.y);
  };
  std::vector<float> height;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) height.push_back(tile(vec2(x, y) / static_cast<float>(size)));
  }
  const auto at = [&](int x, int y) {
    return height[std::size_t((x + size) % size) + std::size_t(size) * std::size_t((y + size) % size)];
  };
  Detail detail;
  detail.size = size;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float shade = 0.72F + 0.32F * at(x, y);
      // +Y is up in the image, but rows go down.
      const vec3 n =
          glm::normalize(vec3(9.0F * (at(x - 1, y) - at(x + 1, y)), 9.0F * (at(x, y + 1) - at(x, y - 1)), 1));
      for (int k = 0; k < 3; ++k) {
        detail.color.push_back(byte(shade));
        detail.normal.push_back(byte(0.5F + 0.5F * n[k]));
      }
    }
  }
  return detail;
}

}  // namespace cumulet::scene
