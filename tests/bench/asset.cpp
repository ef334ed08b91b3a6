#include "asset.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <glm/glm.hpp>
#include <glm/gtc/noise.hpp>

#include "grid/statistics.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::bench {

namespace {

/// A ball eroded by four octaves of noise; deterministic.
float noise_density(const glm::vec3& p) {
  float noise = 0.0F;
  float weight = 0.5F;
  float frequency = 2.1F;
  for (int octave = 0; octave < 4; ++octave, weight *= 0.55F, frequency *= 2.3F) {
    noise += weight * glm::simplex(p * frequency + 7.7F * static_cast<float>(octave));
  }
  return std::clamp(1.5F * (0.75F - glm::length(p) + 0.6F * noise), 0.0F, 1.0F);
}

volume::ScalarVolume noise_volume(int size) {
  volume::ScalarVolume v;
  v.name = "density";
  v.index_to_world = glm::dmat4(1.0 / size);
  v.index_to_world[3][3] = 1.0;
  v.bounds_min = glm::ivec3(0);
  v.bounds_max = glm::ivec3(size - 1);
  const int bricks = (size + 7) / 8;
  const auto across = static_cast<std::size_t>(bricks);
  struct Brick {
    glm::ivec3 origin;
    std::array<float, volume::brick_voxels> values;
  };
  std::vector<std::vector<Brick>> columns(across * across);
  tbb::parallel_for(std::size_t{0}, columns.size(), [&](std::size_t column) {
    const auto x = static_cast<int>(column / across) * 8;
    const auto y = static_cast<int>(column % across) * 8;
    for (int z = 0; z < size; z += 8) {
      Brick brick{{x, y, z}, {}};
      bool any = false;
      for (int i = 0; i < volume::brick_voxels; ++i) {
        const glm::ivec3 p = brick.origin + glm::ivec3(i / 64, (i / 8) % 8, i % 8);
        if (std::max({p.x, p.y, p.z}) >= size) continue;
        const float value = noise_density((glm::vec3(p) + 0.5F) * (2.0F / static_cast<float>(size)) - 1.0F);
        brick.values[static_cast<std::size_t>(i)] = value;
        any = any || value > 0.0F;
      }
      if (any) columns[column].push_back(brick);
    }
  });
  std::vector<float>& values = v.brick_values.as_floats();
  for (const std::vector<Brick>& column : columns) {
    for (const Brick& brick : column) {
      v.brick_origins.push_back(brick.origin);
      values.insert(values.end(), brick.values.begin(), brick.values.end());
      for (const float value : brick.values) {
        v.active_voxels += value > 0.0F ? 1 : 0;
        v.max_value = std::max(v.max_value, value);
      }
    }
  }
  return v;
}

}  // namespace

Asset load_asset(const Input& input, bool all_fields) {
  Asset asset;
  asset.name = input.name;
  if (input.noise_size > 0) {
    asset.volume = std::make_shared<const viewer::VolumeAsset>(noise_volume(input.noise_size));
  } else {
    const auto start = std::chrono::steady_clock::now();
    asset.volume =
        all_fields ? std::make_shared<const viewer::VolumeAsset>(volume::import_frame(input.file, {input.grid}, Log()))
                   : std::make_shared<const viewer::VolumeAsset>(volume::import_volume(input.file, input.grid, Log()));
    asset.load_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  asset.mean_optical_depth =
      grid::Statistics(asset.volume->volume(), grid::fit_cube(asset.volume->volume())).mean_optical_depth();
  return asset;
}

}  // namespace cumulet::bench
