#pragma once

// glsl/common/bindings.glsl as C++: the binding points that shaders and C++ share.

namespace cumulet::core {
#include "common/bindings.glsl"
}  // namespace cumulet::core
