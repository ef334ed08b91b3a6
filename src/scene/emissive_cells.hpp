#pragma once

// Emissive cells as lights: which cells there are, and the alias table by which the path tracer samples them. No GL.

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/tet_grid.hpp"
#include "light/alias_table.hpp"

namespace cumulet::scene {

/// An emissive cell, as the shaders read it (glsl/light/light.glsl).
struct GlowingCell {
  light::Alias alias;   ///< entry of the alias table; `other` indexes the same table
  glm::uvec2 v0_shape;  ///< x and y of the cell record: its v0 and shape
  grid::EmissionRecord emission;
};
static_assert(sizeof(GlowingCell) == 32);

/// Total emission of the cells of a grid.
struct EmissiveSum {
  double power = 0.0;   ///< luminance emitted per steradian: the integral of L over the volume, in world units
  double length = 0.0;  ///< world: cube root of power^2 / integral of L^2, the volume of a uniform emitter with the
                        ///< same two integrals
};

/// Samples cells in proportion to the luminance that they emit (light/alias_table.hpp).
struct EmissiveTable : EmissiveSum {
  std::vector<GlowingCell> cells;
};

/// Keeps the emissive cells and builds their alias table; the aliases of the input are ignored. O(n). Throws
/// Error(cancelled).
EmissiveTable emissive_table(std::vector<GlowingCell> cells, const grid::Cube& cube,
                             const Progress* progress = nullptr);
EmissiveTable emissive_table(const grid::TetGrid& grid, const Progress* progress = nullptr);

}  // namespace cumulet::scene
