#pragma once

// Private to surface/: whether triangles show their fronts to those who stand outside.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace cumulet::surface::detail {

/// Of the closed shapes among some triangles: pieces in which each edge has two triangles, and a volume.
struct Winding {
  double area = 0.0;    ///< of them all
  double inward = 0.0;  ///< of those of their triangles whose fronts (counter-clockwise) face into their shape
};

/// Vertices at one place are one vertex. Inner walls, which lie within the box of a larger closed shape, may face
/// either way: they count for nothing. O(n log n).
Winding winding_of(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices);

}  // namespace cumulet::surface::detail
