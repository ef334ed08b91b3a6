#pragma once

// Procedural meshes for the parts of the sample scene.

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::scene {

/// Triangles, counter-clockwise as seen from outside. uv and color are empty or have one element per vertex.
struct Mesh {
  std::vector<glm::vec3> position;
  std::vector<glm::vec3> normal;  ///< unit vectors
  std::vector<glm::vec2> uv;
  std::vector<glm::u8vec4> color;  ///< linear
  std::vector<std::uint32_t> index;

  /// Adds a flat quadrilateral a, b, c, d. c and d may be the same point.
  void quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d);
  /// Adds a box around `centre`, rotated about +Y by `turn` radians.
  void box(const glm::vec3& centre, const glm::vec3& half, float turn = 0.0F);
  /// Adds a square bar between two points.
  void bar(const glm::vec3& from, const glm::vec3& to, float half);
  /// Adds a surface of revolution about the vertical axis through `foot`. profile: (radius, height) pairs from bottom
  /// to top. Edges are sharp where the profile bends by more than 30 degrees.
  void turned(const glm::vec3& foot, const std::vector<glm::vec2>& profile, int sides);
};

}  // namespace cumulet::scene
