#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "assets/bounds.hpp"

namespace cumulet::viewer {

/// The objects that a camera is fitted to, in world space.
struct Subject {
  /// Returns the extent of the objects along each of these normals: the maximum of the dot products of their points.
  using Reach = std::function<std::vector<double>(const glm::dvec3& direction, std::span<const glm::dvec3> normals)>;

  Subject(const Bounds& all) : bounds(all) {}  // a box is a subject

  Bounds bounds;  ///< of all objects
  Reach reach;    ///< extent of the visible parts for a view direction (unit); if it is empty or returns nothing,
                  ///< `bounds` is used
};

}  // namespace cumulet::viewer
