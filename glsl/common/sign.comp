#version 450
// Sets a flag, to test whether the driver executes dispatches within the call.
layout(local_size_x = 1) in;
#include "common/bindings.glsl"
layout(std430, binding = CM_STORAGE_SIGN) buffer CmSign { uint cm_sign; };

void main() { cm_sign = 1u; }
