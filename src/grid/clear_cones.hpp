#pragma once

#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Gives empty cells their clear cones (glsl/clear_cones.glsl): no ray from there in such a cone meets density or
/// light. Of a whole grid, its content's box known. In parallel. O(cells + CM_CLEAR_SIDE^3).
void find_clear_cones(TetGrid& grid);

}  // namespace cumulet::grid
