#pragma once

// Where a volume stands, as shaders are told. No GL.

#include <glm/glm.hpp>

#include "base/parameters.hpp"
#include "scene/glow.hpp"

namespace cumulet::scene {

/// Of a cube of this place in the world, in which all there is to march through is inside low to high (cube space).
core::CmSpace space_of(const glm::dmat4& cube_to_world, const glm::vec3& low, const glm::vec3& high);

/// How much a length grows by it, on average: the cube root of how much a volume does.
double mean_stretch(const glm::dmat4& place);

/// The most extinction that paths are traced with, where all volumes together have this extent: on average they go as
/// far as floats resolve positions there. With more they would never leave. Infinite for an extent of 0.
double max_extinction(double extent);

/// Whether what goes straight from one affine place to the other is solid all the way: it is not where it turns halfway
/// round, or is mirrored.
bool stays_solid(const glm::dmat4& open, const glm::dmat4& close);

/// A volume's own table, of it as it stands at that place: what it gives off, and how much of a ray that takes.
struct PlacedGlow {
  double power = 0.0;  ///< as GlowSum has both
  double length = 0.0;
  core::CmGlow looks{};
};
PlacedGlow glow_of(const GlowSum& sum, const glm::dmat4& cube_to_world, const glm::dmat4& place);

}  // namespace cumulet::scene
