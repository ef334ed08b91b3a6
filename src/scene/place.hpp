#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace cumulet::scene {

/// Transforms at shutter open and close. In between, points move linearly.
struct PlaceEnds {
  glm::dmat4 open{1.0};
  glm::dmat4 close{1.0};
  bool operator==(const PlaceEnds&) const = default;
};

/// An instance transform.
struct Place {
  glm::dmat4 to_world{1.0};            ///< affine, from the world space of the object's source
  std::optional<PlaceEnds> ends = {};  ///< empty: it does not move
  bool operator==(const Place&) const = default;
};

}  // namespace cumulet::scene
