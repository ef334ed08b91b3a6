#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>

namespace cumulet::scene {

/// How the sample scene is looked at: the camera of the .glb and of the scene file.
struct View {
  glm::vec3 eye{-26.0F, 30.0F, 178.0F};
  glm::vec3 target{2.0F, 12.0F, 0.0F};
  double fovy_degrees = 37.0;
};

/// Where the tower of the sample scene stands, on the saddle under the cumulus.
constexpr glm::vec3 tower_foot{-26.0F, -12.0F, 13.0F};

/// What stands in and around the cumulus of make_cumulus, as a .glb: a mountain ridge with a lake, a forest and an
/// observation tower with lit windows, a beacon that turns, a camera. The tower is the same for every seed, the
/// mountains are not. The same bytes for the same seed. Throws std::runtime_error.
std::string make_surfaces(std::uint32_t seed);

}  // namespace cumulet::scene
