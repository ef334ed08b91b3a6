#pragma once

// Compiles the shared shader code for cells as C++: shapes, records, children and faces (cell.glsl), linear fits
// (cell_fit.glsl), faces of split cells (cell_split.glsl), channels (channels.glsl, cell_emission.glsl), empty-space
// termination (clear_cones.glsl) and the lattice of split vertices (lattice.glsl).

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "grid/cell.glsl"
#include "grid/cell_fit.glsl"
#include "grid/cell_split.glsl"
#include "grid/clear_cones.glsl"
#include "grid/lattice.glsl"
#include "traversal/cell_emission.glsl"
}  // namespace cumulet::core
