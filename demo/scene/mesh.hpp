#pragma once

// Meshes by code: what the parts of the sample scene are put together from.

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace cumulet::scene {

/// Triangles, counter-clockwise seen from outside. uv and color are empty, or one a vertex.
struct Mesh {
  std::vector<glm::vec3> position;
  std::vector<glm::vec3> normal;  ///< unit
  std::vector<glm::vec2> uv;
  std::vector<glm::u8vec4> color;  ///< linear
  std::vector<std::uint32_t> index;

  /// A flat quadrilateral a, b, c, d; c and d may be one point.
  void quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d);
  /// A box around `centre`, turned about +Y by `turn` radians.
  void box(const glm::vec3& centre, const glm::vec3& half, float turn = 0.0F);
  /// A square bar between two points.
  void bar(const glm::vec3& from, const glm::vec3& to, float half);
  /// A profile of (radius, height) pairs, from below, turned about the axis through `foot`. Its creases are sharp
  /// where it bends by more than 30 degrees.
  void turned(const glm::vec3& foot, const std::vector<glm::vec2>& profile, int sides);
};

}  // namespace cumulet::scene
