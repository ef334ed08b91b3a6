#pragma once

// Emissive triangles as lights: which triangles there are, and the alias table by which the path tracer samples them.
// No GL.

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
  float luminance = 0.0F;  ///< of the radiance, > 0: mean over the triangle, estimated from a few texels
};

/// Returns the emissive triangles of a scene in a pose, in ascending order, without hidden ones and without those of
/// unlit materials. The list is valid for all poses with the same materials and visible draws. O(n), and over the
/// texels of emissive images, on TBB threads. Throws Error(cancelled).
std::vector<EmissiveTriangle> emissive_triangles(const surface::Scene& scene, const surface::Pose& pose,
                                                 const Progress* progress = nullptr);

/// Samples triangles in proportion to their power (light/alias_table.hpp).
struct EmitterTable {
  /// One entry per triangle with an area, in ascending order of x. x: triangle number, relative to `first`. y, z: the
  /// alias: entry i, drawn uniformly, returns itself if a random word is at most y, else entry z. w: a float, the
  /// sampling pdf by area; it is negative if the triangle's front side is the one with clockwise vertices.
  std::vector<glm::uvec4> entries;
  double flux = 0.0;  ///< luminance of the total emitted power: pi x radiance x area x sides
};

/// Builds the table of the given emissive triangles in a pose. first: number of the triangle that entries count from.
/// O(n). Throws Error(cancelled).
EmitterTable emitter_table(std::span<const EmissiveTriangle> triangles, const surface::Scene& scene,
                           const surface::Pose& pose, const Progress* progress = nullptr, std::uint32_t first = 0);

}  // namespace cumulet::light
