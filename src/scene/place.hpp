#pragma once

#include <glm/glm.hpp>
#include <optional>

namespace cumulet::scene {

/// Where something is as the shutter opens, and as it closes. In between all goes straight.
struct PlaceEnds {
  glm::dmat4 open{1.0};
  glm::dmat4 close{1.0};
  bool operator==(const PlaceEnds&) const = default;
};

/// Where something stands.
struct Place {
  glm::dmat4 to_world{1.0};            ///< affine, from the world that it was made in
  std::optional<PlaceEnds> ends = {};  ///< nothing: it stands still
  bool operator==(const Place&) const = default;
};

}  // namespace cumulet::scene
