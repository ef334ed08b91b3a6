#pragma once

// Makes the GLSL files that C++ shares with the shaders compile through GLM. Include this, then the
// .glsl files, inside namespace cumulet::core.

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

#define CM_FN inline
#define CM_INOUT(T) T&
#define CM_OUT(T) T&
#define CM_PRECISE

namespace cumulet::core {
using namespace glm;  // GLSL's own names: vec3, uvec4, floatBitsToUint, ...
#include "common/numbers.glsl"
}  // namespace cumulet::core
