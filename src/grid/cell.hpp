#pragma once

// glsl/cell.glsl and channels.glsl as C++: shapes, records, children and faces of cells, and what they give off.

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "cell.glsl"
#include "channels.glsl"
}  // namespace cumulet::core
