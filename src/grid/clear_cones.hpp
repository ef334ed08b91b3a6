#pragma once

#include "base/progress.hpp"
#include "grid/tet_grid.hpp"

namespace cumulet::grid {

/// Computes the clear cones of empty cells, for empty-space termination (glsl/grid/clear_cones.glsl). A ray that leaves
/// such a cell within a clear cone hits no density and no emission at any shutter time. grid: complete, with
/// content_min and content_max set and no clear cones yet. progress: receives the last tenth. Runs in parallel. O(cells
/// + CM_CLEAR_SIDE^3).
void find_clear_cones(TetGrid& grid, Progress* progress = nullptr);

}  // namespace cumulet::grid
