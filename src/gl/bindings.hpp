#pragma once

// glsl/bindings.glsl as C++: the binding points that shaders and C++ share.

namespace cumulet::core {
#include "bindings.glsl"
}  // namespace cumulet::core
