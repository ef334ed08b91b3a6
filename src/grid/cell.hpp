#pragma once

// glsl/cell.glsl as C++: shapes, records, children and faces of cells.

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "cell.glsl"
}  // namespace cumulet::core
