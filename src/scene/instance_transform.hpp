#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace cumulet::scene {

/// Transforms at shutter open and close. In between, points move linearly.
struct ShutterTransforms {
  glm::dmat4 open{1.0};
  glm::dmat4 close{1.0};
  bool operator==(const ShutterTransforms&) const = default;
};

/// An instance transform.
struct InstanceTransform {
  glm::dmat4 to_world{1.0};                    ///< affine, from the world space of the object's source
  std::optional<ShutterTransforms> ends = {};  ///< empty: it does not move
  bool operator==(const InstanceTransform&) const = default;
};

}  // namespace cumulet::scene
