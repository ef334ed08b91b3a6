#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>

#include "surface/scene.hpp"

namespace cumulet::surface {

/// Triangles of one material in a host's memory.
struct TriangleMesh {
  std::span<const float> positions;        ///< 3 per vertex
  std::span<const float> normals;          ///< 3 per vertex, of any length; empty: computed per triangle
  std::span<const float> colors;           ///< 4 per vertex, linear, multiplied with the material's; empty: white
  std::span<const std::uint32_t> indices;  ///< 3 per triangle; empty: every three vertices form a triangle
  std::span<const float> velocities;       ///< 3 per vertex, units per second; empty: no motion
  glm::dmat4 to_world{1.0};
  Material material;
};

/// Returns a scene of meshes that move only by their velocities while the shutter is open. Input is checked like a glTF
/// file. All data is copied. Throws Error(invalid_argument), one line that begins with `name`.
ScenePtr import_triangles(std::span<const TriangleMesh> meshes, const std::string& name);

}  // namespace cumulet::surface
