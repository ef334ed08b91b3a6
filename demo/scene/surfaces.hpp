#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>

namespace cumulet::scene {

/// Camera of the sample scene, for the .glb and the scene file.
struct View {
  glm::vec3 eye{-26.0F, 30.0F, 178.0F};
  glm::vec3 target{2.0F, 12.0F, 0.0F};
  double fovy_degrees = 37.0;
};

/// Position of the tower, on the saddle below the cumulus.
constexpr glm::vec3 tower_foot{-26.0F, -12.0F, 13.0F};

/// Returns the surroundings of make_cumulus as a .glb: a mountain ridge with a lake, a forest, an observation tower
/// with lit windows and a rotating beacon, and a camera. The tower is the same for every seed; the mountains differ.
/// Equal seeds give equal bytes. Throws std::runtime_error.
std::string make_surfaces(std::uint32_t seed);

}  // namespace cumulet::scene
