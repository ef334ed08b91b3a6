#version 450
// Copies bricks between buffers to new positions: one work group per brick. Values are preserved exactly.
// variants: CM_FROM_HALVES=0,1 CM_TO_HALVES=0,1
layout(local_size_x = 64) in;

#include "common/bindings.glsl"

layout(std430, binding = CM_STORAGE_BRICKS_FROM) readonly buffer CmFrom { uint cm_from[]; };
layout(std430, binding = CM_STORAGE_BRICKS_TO) writeonly buffer CmTo { uint cm_to[]; };
layout(std430, binding = CM_STORAGE_BRICKS_MOVED) readonly buffer CmMoved { uvec2 cm_moved[]; };  // from, to
layout(location = 0) uniform uvec2 cm_range;  // entries of cm_moved: first, and one past the last
layout(location = 1) uniform uint cm_to_first;
layout(location = 2) uniform uvec2 cm_numbers;  // floats per voxel there, and which one is written; not for halves

float cm_number(uint i) {
#if CM_FROM_HALVES
  return unpackHalf2x16(cm_from[i >> 1u] >> (16u * (i & 1u))).x;
#else
  return uintBitsToFloat(cm_from[i]);
#endif
}

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uvec2 moved = cm_moved[min(cm_range.x + work, cm_range.y - 1u)];
  uint from = 512u * moved.x + 8u * gl_LocalInvocationIndex;
  uint to = 512u * (cm_to_first + moved.y) + 8u * gl_LocalInvocationIndex;
#if CM_FROM_HALVES && CM_TO_HALVES
  for (uint w = 0u; w < 4u; ++w) cm_to[to / 2u + w] = cm_from[from / 2u + w];
#elif CM_TO_HALVES
  for (uint w = 0u; w < 4u; ++w)
    cm_to[to / 2u + w] = packHalf2x16(vec2(cm_number(from + 2u * w), cm_number(from + 2u * w + 1u)));
#else
  for (uint z = 0u; z < 8u; ++z)
    cm_to[(to + z) * cm_numbers.x + cm_numbers.y] = floatBitsToUint(cm_number(from + z));
#endif
}
