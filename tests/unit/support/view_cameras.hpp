#pragma once

// Small volumes of every kind that a grid has to handle, and cameras around them.

#include <random>
#include <string>
#include <vector>

#include "grid/refine.hpp"
#include "support/volumes.hpp"

namespace cumulet::test {

struct SmallVolume {
  std::string name;
  volume::ScalarVolume volume;
  grid::RefineSettings settings;  ///< without a camera
};

/// Volumes: noise (low density, high density, stretched), a wall, tiles, a background that ends within bricks, a full
/// cube, a single voxel, an empty volume.
inline std::vector<SmallVolume> small_volumes() {
  using glm::ivec3;
  grid::RefineSettings deviation;
  deviation.threshold = 0.02;
  grid::RefineSettings seen;
  seen.criterion = grid::Criterion::transmittance;
  seen.threshold = 0.1;
  seen.density_scale = 0.3;
  grid::RefineSettings everything;
  everything.threshold = -1.0;
  grid::RefineSettings paper;
  paper.criterion = grid::Criterion::range_mean;
  paper.threshold = 1.0;
  std::vector<SmallVolume> all;
  all.push_back({"noise", noise_volume({60, 45, 50}, ivec3(0), 1), deviation});
  all.push_back({"off the lattice", noise_volume({75, 30, 41}, {-13, 5, 100}, 2), seen});
  volume::ScalarVolume stretched = noise_volume({40, 70, 33}, {3, -8, 0}, 3);
  stretched.index_to_world[0] = {0.2, 0.0, 0.1, 0.0};
  stretched.index_to_world[1] = {0.1, 1.7, 0.0, 0.0};
  stretched.index_to_world[2] = {0.0, 0.3, 0.6, 0.0};
  all.push_back({"stretched", std::move(stretched), deviation});
  all.push_back({"slab", slab(), deviation});
  all.push_back({"all of it", noise_volume({16, 16, 16}, ivec3(0), 4), everything});
  all.push_back({"fills its cube",
                 make_volume({32, 32, 32}, ivec3(0),
                             [](const ivec3& p) {
                               return 0.2F + 0.01F * static_cast<float>((p.x * 7 + p.y * 3 + p.z * p.z) % 17);
                             }),
                 paper});
  volume::ScalarVolume tiled = noise_volume({120, 100, 90}, ivec3(0), 5);
  tiled.tiles.push_back({.min = {64, 64, 64}, .max = {79, 79, 79}, .value = 0.5F});
  std::erase_if(tiled.brick_origins, [](const ivec3& o) {
    return glm::all(glm::greaterThanEqual(o, ivec3(64))) && glm::all(glm::lessThan(o, ivec3(80)));
  });
  tiled.brick_values = volume::BrickValues(std::vector<float>());
  for (const ivec3& o : tiled.brick_origins) {
    for (int i = 0; i < 512; ++i) {
      const ivec3 p = o + ivec3(i / 64, i / 8 % 8, i % 8);
      tiled.brick_values.as_floats().push_back(glm::any(glm::greaterThan(p, tiled.bounds_max))
                                                   ? 0.0F
                                                   : 0.25F * static_cast<float>(1 + (p.x ^ p.y ^ p.z) % 4));
    }
  }
  tiled.background = 0.125F;
  all.push_back({"tiles and background", std::move(tiled), deviation});
  all.push_back({"one voxel", make_volume({1, 1, 1}, {5, 5, 5}, [](const ivec3& /*p*/) { return 2.0F; }), deviation});
  all.push_back({"nothing", make_volume({9, 9, 9}, ivec3(0), [](const ivec3& /*p*/) { return 0.0F; }), deviation});
  return all;
}

/// Generates an endless series of random cameras: near, inside and far. Some see only a part of the cube, and some have
/// an instance transform.
class Cameras {
 public:
  explicit Cameras(unsigned seed) : engine_(seed) {}
  grid::RefineCamera about(const grid::Cube& cube) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    const glm::dvec3 centre(cube.to_world * glm::dvec4(glm::dvec3(0.5 * cube.size()), 1.0));
    const double radius = 0.5 * glm::length(glm::dmat3(cube.to_world) * glm::dvec3(cube.size()));
    const auto direction = [&] {
      return glm::normalize(glm::dvec3(normal(engine_), normal(engine_), normal(engine_)));
    };
    grid::RefineCamera camera;
    camera.eye = centre + radius * std::exp2(4.0 * uniform(engine_) - 2.0) * direction();
    camera.forward = glm::normalize(centre - camera.eye + 0.5 * radius * uniform(engine_) * direction());
    camera.right = glm::normalize(glm::cross(camera.forward, direction()));
    camera.up = glm::cross(camera.right, camera.forward);
    camera.tan_half_x = 0.05 + uniform(engine_);
    camera.tan_half_y = 0.05 + uniform(engine_);
    camera.pixels_per_radian = std::exp2(1.0 + 8.0 * uniform(engine_));
    if (uniform(engine_) < 0.25) {
      glm::dmat4 transform(0.5 + uniform(engine_));
      transform[3] = glm::dvec4(radius * direction(), 1.0);
      camera.transforms.push_back(transform);
    }
    return camera;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace cumulet::test
