#pragma once

// glsl/common/parameters.glsl as C++: the uniform block of every kernel that renders images.

#include "base/shared_code.hpp"

namespace cumulet::core {
#include "common/parameters.glsl"
}  // namespace cumulet::core
