#pragma once

// Private to surface/: checks whether triangles of closed shapes face outward.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace cumulet::surface::detail {

/// Winding of the closed shapes among some triangles: components in which each edge has two triangles, and which
/// enclose a volume.
struct Winding {
  double area = 0.0;    ///< total area
  double inward = 0.0;  ///< area of triangles whose fronts (counter-clockwise) face into their shape
};

/// Vertices at the same position count as one vertex. Shapes within the box of a larger closed shape may face either
/// way, so they are ignored. O(n log n).
Winding winding_of(std::span<const glm::vec3> positions, std::span<const std::uint32_t> indices);

}  // namespace cumulet::surface::detail
