#pragma once

// glsl/bindings.glsl as C++: the places that shaders and the calls that bind for them share.

namespace cumulet::core {
#include "bindings.glsl"
}  // namespace cumulet::core
