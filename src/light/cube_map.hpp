#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "light/environment.hpp"

namespace cumulet::light {

/// Six square faces below each other: +X, -X, +Y, -Y, +Z and -Z, oriented as in OpenEXR cube maps (ImfEnvmap.h). The
/// centers of a face's outer pixels are on the edges of the cube.
struct CubeMap {
  static constexpr std::uint32_t max_side = Environment::max_side / 4;

  std::uint32_t side = 0;
  std::vector<glm::vec3> values;  ///< side x 6 side
};

/// Resamples to an equirectangular image of 4 x 2 sides. Throws Error(cancelled).
EnvironmentPixels resample(const CubeMap& cube, Progress* progress);

}  // namespace cumulet::light
