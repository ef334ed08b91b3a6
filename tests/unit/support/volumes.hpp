#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/noise.hpp>
#include <random>
#include <tuple>

#include "volume/volume.hpp"

namespace cumulet::test {

/// mt19937 with 32-bit results on every platform.
class Random {
 public:
  using result_type = std::uint32_t;
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  result_type operator()() { return static_cast<result_type>(engine_()); }
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return 0xffffffffU; }

 private:
  std::mt19937 engine_;
};

/// The value of a voxel by definition: 0 outside the bounds, else brick, tile or background.
inline float value_at(const volume::ScalarVolume& v, const glm::ivec3& p) {
  if (glm::any(glm::lessThan(p, v.bounds_min)) || glm::any(glm::greaterThan(p, v.bounds_max))) return 0.0F;
  const glm::ivec3 origin = p & ~7;
  const auto less = [](const glm::ivec3& a, const glm::ivec3& b) {
    return std::make_tuple(a.x, a.y, a.z) < std::make_tuple(b.x, b.y, b.z);
  };
  const auto found = std::lower_bound(v.brick_origins.begin(), v.brick_origins.end(), origin, less);
  if (found != v.brick_origins.end() && *found == origin) {
    const auto brick = static_cast<std::size_t>(found - v.brick_origins.begin());
    return v.brick_values[brick * 512 + static_cast<std::size_t>((p.x & 7) * 64 + (p.y & 7) * 8 + (p.z & 7))];
  }
  for (const volume::Tile& tile : v.tiles) {
    if (glm::all(glm::greaterThanEqual(p, tile.min)) && glm::all(glm::lessThanEqual(p, tile.max))) return tile.value;
  }
  return v.background;
}

/// Compares everything except index_to_world.
inline void expect_same_voxels(const volume::ScalarVolume& a, const volume::ScalarVolume& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.bounds_min, b.bounds_min);
  EXPECT_EQ(a.bounds_max, b.bounds_max);
  EXPECT_EQ(a.background, b.background);
  EXPECT_EQ(a.max_value, b.max_value);
  EXPECT_EQ(a.active_voxels, b.active_voxels);
  EXPECT_EQ(a.brick_origins, b.brick_origins);
  EXPECT_EQ(a.brick_values, b.brick_values);
  ASSERT_EQ(a.tiles.size(), b.tiles.size());
  for (std::size_t i = 0; i < a.tiles.size(); ++i) {
    EXPECT_EQ(a.tiles[i].min, b.tiles[i].min);
    EXPECT_EQ(a.tiles[i].max, b.tiles[i].max);
    EXPECT_EQ(a.tiles[i].value, b.tiles[i].value);
  }
}
inline void expect_identical(const volume::ScalarVolume& a, const volume::ScalarVolume& b) {
  EXPECT_EQ(a.index_to_world, b.index_to_world);
  expect_same_voxels(a, b);
}

/// Fills bounds with function(index), brick by brick. Bricks that are all zero are left out.
template <class Function>
volume::ScalarVolume make_volume(const glm::ivec3& size, const glm::ivec3& low, Function function) {
  volume::ScalarVolume v;
  v.name = "density";
  v.bounds_min = low;
  v.bounds_max = low + size - 1;
  const glm::ivec3 first = v.bounds_min & ~7;
  for (int x = first.x; x <= v.bounds_max.x; x += 8) {
    for (int y = first.y; y <= v.bounds_max.y; y += 8) {
      for (int z = first.z; z <= v.bounds_max.z; z += 8) {
        std::array<float, 512> values{};
        bool any = false;
        for (int i = 0; i < 512; ++i) {
          const glm::ivec3 p(x + i / 64, y + (i / 8) % 8, z + i % 8);
          if (glm::any(glm::lessThan(p, v.bounds_min)) || glm::any(glm::greaterThan(p, v.bounds_max))) continue;
          values[static_cast<std::size_t>(i)] = function(p);
          any = any || values[static_cast<std::size_t>(i)] > 0.0F;
          v.max_value = std::max(v.max_value, values[static_cast<std::size_t>(i)]);
          ++v.active_voxels;
        }
        if (!any) continue;
        v.brick_origins.emplace_back(x, y, z);
        std::vector<float>& all = v.brick_values.as_floats();
        all.insert(all.end(), values.begin(), values.end());
      }
    }
  }
  return v;
}

/// 64 x 8 x 64 voxels of one value.
inline volume::ScalarVolume slab(float value = 1.0F) {
  return make_volume({64, 8, 64}, glm::ivec3(0), [=](const glm::ivec3& /*p*/) { return value; });
}

/// Calls f(voxel, a point inside it) for each of the six tetrahedra of every voxel of a cube with origin 0. Cells
/// consist of such tetrahedra.
template <class Function>
void for_each_sixth(int size, Function f) {
  for (int i = 0; i < size * size * size; ++i) {
    const glm::ivec3 p(i / (size * size), i / size % size, i % size);
    const glm::ivec3 odd = p & 1;
    for (const glm::ivec3& order : {glm::ivec3(0, 1, 2), glm::ivec3(0, 2, 1), glm::ivec3(1, 0, 2), glm::ivec3(1, 2, 0),
                                    glm::ivec3(2, 0, 1), glm::ivec3(2, 1, 0)}) {
      glm::vec3 middle(p + odd);
      for (int k = 0; k < 3; ++k) {
        const float along = 0.25F * static_cast<float>(3 - k);
        middle[order[k]] += odd[order[k]] != 0 ? -along : along;
      }
      f(p, middle);
    }
  }
}

/// Three puffs that fill only a small part of their bounds.
inline volume::ScalarVolume puffs(const glm::ivec3& size, const glm::ivec3& low) {
  constexpr std::array<std::array<float, 4>, 3> balls{
      {{0.3F, 0.35F, 0.4F, 0.17F}, {0.55F, 0.5F, 0.3F, 0.12F}, {0.7F, 0.75F, 0.8F, 0.1F}}};
  return make_volume(size, low, [=](const glm::ivec3& p) {
    const glm::vec3 at = (glm::vec3(p - low) + 0.5F) / glm::vec3(size);
    float density = 0.0F;
    for (const auto& [x, y, z, radius] : balls)
      density += std::max(0.0F, radius - glm::distance(at, glm::vec3(x, y, z)));
    return density;
  });
}

/// A lumpy ball with empty parts, deterministic.
inline volume::ScalarVolume noise_volume(const glm::ivec3& size, const glm::ivec3& low, int seed) {
  const glm::vec3 centre = glm::vec3(low) + 0.5F * glm::vec3(size);
  return make_volume(size, low, [=](const glm::ivec3& p) {
    const glm::vec3 x(p);
    const float radius = glm::length((x - centre) / (0.5F * glm::vec3(size)));
    const float noise = glm::simplex(glm::vec3(0.11F * x) + 17.3F * static_cast<float>(seed));
    return std::max(0.0F, 1.1F - radius + 0.5F * noise);
  });
}

}  // namespace cumulet::test
