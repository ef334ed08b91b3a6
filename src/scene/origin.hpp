#pragma once

// A scene counts from an origin of its own, so that floats hold its places wherever it is in the world. No GL.

#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "scene/snapshot.hpp"

namespace cumulet::scene {

/// World bounds of one thing of a scene.
struct Extent {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
};

/// Where the scene counts from, in the world: a point near the middle of all, and exactly 0 for a scene that is within
/// 256 times its own size of 0. It depends on the content, and so stays where it is while a camera moves. Where the
/// content is so wide that this point is useless for a thing near the eye, it is a point near that thing. eye: nothing
/// where nothing is seen. O(things).
glm::dvec3 origin_of_scene(std::span<const Extent> things, const std::optional<glm::dvec3>& eye);

/// Things of the world, counted from that origin.
Place counted_from(Place place, const glm::dvec3& origin);
Volume counted_from(Volume volume, const glm::dvec3& origin);
Model counted_from(Model model, const glm::dvec3& origin);
light::Lamps counted_from(light::Lamps lamps, const glm::dvec3& origin);
std::optional<Viewpoint> counted_from(std::optional<Viewpoint> view, const glm::dvec3& origin);
std::optional<ViewEnds> counted_from(std::optional<ViewEnds> ends, const glm::dvec3& origin);
std::optional<Ground> counted_from(std::optional<Ground> ground, const glm::dvec3& origin);

}  // namespace cumulet::scene
