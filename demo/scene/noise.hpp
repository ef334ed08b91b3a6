#pragma once

// Noise from integer hashes: the same values on every machine and for any number of threads.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>

namespace cumulet::scene {

/// Mixes a lattice point and a seed, similar to PCG.
inline std::uint32_t hash(glm::ivec3 p, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9U + 0x85ebca6bU;
  for (const int c : {p.x, p.y, p.z}) {
    h ^= static_cast<std::uint32_t>(c);
    h *= 0xcc9e2d51U;
    h = (h ^ (h >> 15U)) * 0x2c1b3c6dU;
    h ^= h >> 12U;
  }
  return h * 0x297a2d39U ^ (h >> 16U);
}

/// Converts a hash to [0, 1).
inline float unit(std::uint32_t h) { return static_cast<float>(h >> 8U) * (1.0F / 16777216.0F); }

/// Perlin's gradient noise (2002), about -1 to 1, wavelength 1.
inline float perlin(const glm::vec3& p, std::uint32_t seed) {
  const glm::ivec3 cell(glm::floor(p));
  const glm::vec3 f = p - glm::vec3(cell);
  const glm::vec3 u = f * f * f * (f * (f * 6.0F - 15.0F) + 10.0F);
  const auto corner = [&](int x, int y, int z) {
    const glm::ivec3 o(x, y, z);
    const glm::vec3 d = f - glm::vec3(o);
    const std::uint32_t h = hash(cell + o, seed) & 15U;
    const float a = h < 8 ? d.x : d.y;
    const float b = h < 4 ? d.y : (h == 12 || h == 14 ? d.x : d.z);
    return ((h & 1U) != 0 ? -a : a) + ((h & 2U) != 0 ? -b : b);
  };
  const float x0 =
      glm::mix(glm::mix(corner(0, 0, 0), corner(1, 0, 0), u.x), glm::mix(corner(0, 1, 0), corner(1, 1, 0), u.x), u.y);
  const float x1 =
      glm::mix(glm::mix(corner(0, 0, 1), corner(1, 0, 1), u.x), glm::mix(corner(0, 1, 1), corner(1, 1, 1), u.x), u.y);
  return glm::mix(x0, x1, u.z);
}

/// Worley's cellular noise (1996): distance to the nearest point of a jittered lattice, 0 to about 1.
inline float worley(const glm::vec3& p, std::uint32_t seed) {
  const glm::ivec3 cell(glm::floor(p));
  const glm::vec3 f = p - glm::vec3(cell);
  float nearest = 4.0F;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const glm::ivec3 o(x, y, z);
        const std::uint32_t h = hash(cell + o, seed);
        const glm::vec3 point(unit(h), unit(h * 0x9e3779b1U), unit(h * 0x85ebca77U));
        const glm::vec3 d = glm::vec3(o) + point - f;
        nearest = std::min(nearest, glm::dot(d, d));
      }
    }
  }
  return std::sqrt(nearest);
}

/// Sum of octaves of Perlin noise from wavelength 1 down to `finest`, each with half the amplitude. The last octave
/// fades in, so that detail increases continuously with resolution.
inline float fbm(const glm::vec3& p, float finest, std::uint32_t seed) {
  float sum = 0.0F;
  float frequency = 1.0F;
  float amplitude = 0.5F;
  for (std::uint32_t octave = 0; octave < 12; ++octave) {
    const float weight = glm::clamp(std::log2(1.0F / (frequency * finest)) + 1.0F, 0.0F, 1.0F);
    if (weight <= 0.0F) break;
    sum += weight * amplitude * perlin(p * frequency, seed + octave);
    frequency *= 2.03F;
    amplitude *= 0.5F;
  }
  return sum;
}

/// Rounded bumps at several scales: octaves of 1 - Worley, 0 to about 1. Gives the cauliflower shape of a cumulus.
inline float billows(const glm::vec3& p, float finest, std::uint32_t seed) {
  float sum = 0.0F;
  float frequency = 1.0F;
  float amplitude = 0.5F;
  for (std::uint32_t octave = 0; octave < 8; ++octave) {
    const float weight = glm::clamp(std::log2(1.0F / (frequency * finest)) + 1.0F, 0.0F, 1.0F);
    if (weight <= 0.0F) break;
    const float w = worley(p * frequency, seed + 31 * octave);
    sum += weight * amplitude * (1.0F - w);
    frequency *= 2.1F;
    amplitude *= 0.5F;
  }
  return sum;
}

}  // namespace cumulet::scene
