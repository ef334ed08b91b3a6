#pragma once

#include "base/progress.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Gives empty cells their clear cones (glsl/clear_cones.glsl): no ray from there in such a cone meets density, at
/// whatever moment of the shutter's, or light. Of a grid that is whole, its content's box known, whose empty cells have
/// none yet. In parallel. progress: its last tenth. O(cells + CM_CLEAR_SIDE^3).
void find_clear_cones(TetGrid& grid, Progress* progress = nullptr);

}  // namespace cumulet::grid
