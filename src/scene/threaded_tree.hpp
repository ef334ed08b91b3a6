#pragma once

// Stackless BVHs over the boxes of a scene's objects, in depth-first order with skip links: glsl/common/tree_node.glsl.
// No GL.

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parameters.hpp"

namespace cumulet::core {
#include "common/tree_node.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// Upper limit for the absolute value of coordinates in these trees.
inline constexpr double farthest = 1e12;

/// A parallelepiped: middle + s * half[0] + t * half[1] + u * half[2], with s, t, u in [-1, 1].
struct Block {
  glm::dvec3 middle{0.0};
  std::array<glm::dvec3, 3> half{};

  /// Returns the half extent along an axis.
  [[nodiscard]] double reach(const glm::dvec3& axis) const {
    return std::abs(glm::dot(axis, half[0])) + std::abs(glm::dot(axis, half[1])) + std::abs(glm::dot(axis, half[2]));
  }
};
/// Returns the half extents along x, y and z.
glm::dvec3 reach_of(const Block& block);
/// Returns the box from low to high under an affine transform.
Block block_of(const glm::dmat4& map, const glm::dvec3& low, const glm::dvec3& high);

/// A box. If `solid` is false, rays never hit it.
struct TreeBox {
  glm::vec3 low;
  glm::vec3 high;
  bool solid = true;
};
/// Builds a tree. Leaves refer to boxes by index. At least one node; the box of the first contains all others. O(n log
/// n).
std::vector<core::CmInstanceNode> threaded_tree(std::span<const TreeBox> boxes);

}  // namespace cumulet::scene
