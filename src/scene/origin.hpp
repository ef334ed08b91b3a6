#pragma once

// A scene has its own origin, so that floats can represent its positions anywhere in the world. No GL.

#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "scene/snapshot.hpp"

namespace cumulet::scene {

/// World bounds of one object of a scene.
struct Extent {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};
};

/// Returns the scene's origin in world space: a point near the center of everything, and exactly 0 if the scene is
/// within 256 times its own size of 0. It depends on the content, so it does not change while a camera moves.
/// Exception: if the content is so large that floats lack precision for an object near the eye, the origin is near that
/// object. eye: empty if there is no view. O(things).
glm::dvec3 origin_of_scene(std::span<const Extent> things, const std::optional<glm::dvec3>& eye);

/// Converts objects from world space to coordinates relative to the origin.
InstanceTransform counted_from(InstanceTransform transform, const glm::dvec3& origin);
Volume counted_from(Volume volume, const glm::dvec3& origin);
Model counted_from(Model model, const glm::dvec3& origin);
light::AnalyticLights counted_from(light::AnalyticLights analytic_lights, const glm::dvec3& origin);
std::optional<Viewpoint> counted_from(std::optional<Viewpoint> view, const glm::dvec3& origin);
std::optional<ViewEnds> counted_from(std::optional<ViewEnds> ends, const glm::dvec3& origin);
std::optional<Ground> counted_from(std::optional<Ground> ground, const glm::dvec3& origin);

}  // namespace cumulet::scene
