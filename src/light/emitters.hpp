#pragma once

// Emissive triangles as lights: which there are, and how often the path tracer picks each. No GL.

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "surface/scene.hpp"

namespace cumulet::light {

/// A triangle whose material emits.
struct EmissiveTriangle {
  std::uint32_t triangle = 0;
  std::uint32_t draw = 0;
  float luminance =
      0.0F;  ///< of its radiance, the mean over the triangle as far as a few texels of its texture tell; > 0
};

/// The scene's emissive triangles in a pose, in ascending order; those of unlit materials are not among them, nor those
/// that are hidden. They serve for all poses with its materials and draws. O(n), and over the texels of emissive
/// images, on TBB's threads. Throws Error(cancelled).
std::vector<EmissiveTriangle> emissive_triangles(const surface::Scene& scene, const surface::Pose& pose,
                                                 const Progress* progress = nullptr);

/// Picks triangles in proportion to their power (light/alias_table.hpp).
struct EmitterTable {
  /// One a triangle that has an area, in ascending order of x: x: triangle, from the first; y: entry i, drawn evenly,
  /// stands for itself where a random word is at most y, z: else for this entry; w: a float, the chance to be picked
  /// per area, negative where the triangle's front is where its vertices turn clockwise.
  std::vector<glm::uvec4> entries;
  double flux = 0.0;  ///< luminance of all that they emit: pi x radiance x area x sides
};

/// The table of a pose, of those of its emissive triangles that are given; first: the number of what they count from.
/// O(n). Throws Error(cancelled).
EmitterTable emitter_table(std::span<const EmissiveTriangle> triangles, const surface::Scene& scene,
                           const surface::Pose& pose, const Progress* progress = nullptr, std::uint32_t first = 0);

}  // namespace cumulet::light
