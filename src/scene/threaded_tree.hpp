#pragma once

// Trees over the boxes of what stands in a scene, in the order that needs no stack: glsl/tree_node.glsl. No GL.

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parameters.hpp"

namespace cumulet::core {
#include "tree_node.glsl"
}  // namespace cumulet::core

namespace cumulet::scene {

/// What trees of boxes take: no coordinate is as large.
inline constexpr double farthest = 1e12;

/// A box that stands anywhere: middle + the edges' halves, each times -1 to 1.
struct Block {
  glm::dvec3 middle{0.0};
  std::array<glm::dvec3, 3> half{};

  /// Along an axis, how far it reaches from its middle.
  [[nodiscard]] double reach(const glm::dvec3& axis) const {
    return std::abs(glm::dot(axis, half[0])) + std::abs(glm::dot(axis, half[1])) + std::abs(glm::dot(axis, half[2]));
  }
};
/// Along x, y and z.
glm::dvec3 reach_of(const Block& block);
/// The box from low to high, under an affine map.
Block block_of(const glm::dmat4& map, const glm::dvec3& low, const glm::dvec3& high);

/// One that is solid is met, another never.
struct TreeBox {
  glm::vec3 low;
  glm::vec3 high;
  bool solid = true;
};
/// Leaves name boxes by their number. At least one node; the first's box holds all there is. O(n log n).
std::vector<core::CmInstanceNode> threaded_tree(std::span<const TreeBox> boxes);

}  // namespace cumulet::scene
