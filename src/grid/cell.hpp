#pragma once

// Compiles the shared shader code for cells as C++: shapes, records, children and faces (cell.glsl), linear fits
// (cell_fit.glsl), faces of split cells (cell_split.glsl), channels (channels.glsl, cell_emission.glsl), empty-space
// termination (clear_cones.glsl) and the lattice of split vertices (lattice.glsl).

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "cell.glsl"
#include "cell_emission.glsl"
#include "cell_fit.glsl"
#include "cell_split.glsl"
#include "clear_cones.glsl"
#include "lattice.glsl"
}  // namespace cumulet::core
