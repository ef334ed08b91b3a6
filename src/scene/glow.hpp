#pragma once

// Cells that give off light, as lights: which there are, and how often the path tracer picks each. No GL.

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress_part.hpp"
#include "grid/tet_grid.hpp"
#include "light/alias_table.hpp"

namespace cumulet::scene {

/// A cell that gives off light, as the shaders read it (glsl/light.glsl).
struct GlowingCell {
  light::Alias alias;  ///< of entries of the table
  glm::uvec2 place;    ///< x and y of the cell's record: its v0 and shape
  grid::EmissionRecord emission;
};
static_assert(sizeof(GlowingCell) == 32);

/// What all cells of a grid give off.
struct GlowSum {
  double power = 0.0;   ///< luminance that they give off a steradian: its integral over their volume in the world
  double length = 0.0;  ///< world: the cube root of the volume that would give off as much, were it even
};

/// Picks cells in proportion to the luminance of what they give off (light/alias_table.hpp).
struct GlowTable : GlowSum {
  std::vector<GlowingCell> cells;
};

/// Of those of these cells that give off light; what they have for an alias does not count. O(n). Throws
/// Error(cancelled).
GlowTable glow_table(std::vector<GlowingCell> cells, const grid::Cube& cube, const Progress* progress = nullptr);
GlowTable glow_table(const grid::TetGrid& grid, const Progress* progress = nullptr);

}  // namespace cumulet::scene
