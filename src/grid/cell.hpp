#pragma once

// What glsl/ has of cells as C++: shapes, records, children and faces (cell.glsl), linear fits over them
// (cell_fit.glsl), their faces when they split (cell_split.glsl), what they give off (channels.glsl), and the lattice
// of their splits (lattice.glsl), and where nothing is met any more (clear_cones.glsl).

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "cell.glsl"
#include "cell_fit.glsl"
#include "cell_split.glsl"
#include "channels.glsl"
#include "clear_cones.glsl"
#include "lattice.glsl"
}  // namespace cumulet::core
