#pragma once

// glsl/parameters.glsl as C++: the uniform block of every pass.

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "parameters.glsl"
static_assert(sizeof(CmParameters) == 30 * 16);
}  // namespace cumulet::core
