#pragma once

// Transforms of volumes for shaders. No GL.

#include <glm/glm.hpp>

#include "base/parameters.hpp"
#include "scene/emissive_cells.hpp"

namespace cumulet::scene {

/// Returns the space of a cube with this transform; everything to traverse is between low and high (cube space).
core::CmSpace space_of(const glm::dmat4& cube_to_world, const glm::vec3& low, const glm::vec3& high);

/// Returns the mean length scale of a transform: the cube root of its volume scale.
double mean_stretch(const glm::dmat4& transform);

/// Returns the maximum extinction that paths are traced with, for the extent of all volumes together. At this
/// extinction the mean free path equals the float resolution of positions; with more, paths would never leave. Infinite
/// for an extent of 0.
double max_extinction(double extent);

/// Whether linear motion between two affine transforms stays non-singular. It does not if it rotates by half a turn or
/// mirrors.
bool stays_solid(const glm::dmat4& open, const glm::dmat4& close);

/// The emissive-cell table of one volume instance: its emission, and the sampling parameters for shaders.
struct InstanceEmissive {
  double power = 0.0;  ///< see EmissiveSum for both
  double length = 0.0;
  core::CmEmissive looks{};
};
InstanceEmissive emissive_of(const EmissiveSum& sum, const glm::dmat4& cube_to_world, const glm::dmat4& transform);

}  // namespace cumulet::scene
