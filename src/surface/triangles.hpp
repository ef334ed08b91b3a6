#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>

#include "surface/scene.hpp"

namespace cumulet::surface {

/// Triangles of one material, as a host has them in memory.
struct TriangleMesh {
  std::span<const float> positions;        ///< 3 a vertex
  std::span<const float> normals;          ///< 3 a vertex, of any length; empty: the triangles' own
  std::span<const float> colors;           ///< 4 a vertex, linear, times the material's; empty: white
  std::span<const std::uint32_t> indices;  ///< 3 a triangle; empty: every three vertices are one
  std::span<const float> velocities;       ///< 3 a vertex, a second; empty: it stands still
  glm::dmat4 to_world{1.0};
  Material material;
};

/// A scene of meshes that move by their velocities alone, while a shutter is open, checked as a glTF file's. Copies all
/// it needs. Throws Error(invalid_argument), one line that begins with `name`.
ScenePtr import_triangles(std::span<const TriangleMesh> meshes, const std::string& name);

}  // namespace cumulet::surface
