#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "viewer/bounds.hpp"

namespace cumulet::viewer {

/// What a camera fits, all in world space.
struct Subject {
  /// How far the points of a body reach along each of these normals: the greatest of their scalar products.
  using Reach = std::function<std::vector<double>(const glm::dvec3& direction, std::span<const glm::dvec3> normals)>;

  Subject(const Bounds& all) : bounds(all) {}  // a box is a subject

  Bounds bounds;  ///< of all there is
  Reach reach;    ///< of what is seen along a direction (unit); none, or no answer: of the bounds
};

}  // namespace cumulet::viewer
