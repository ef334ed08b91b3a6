#version 450
// Computes the numbers that a channel's records are sums of, from the bricks of the channel's fields, like
// grid::ChannelFields: one work group per brick. CM_FIELDS: number of fields.
// variants: CM_CHANNEL=0 CM_FIELDS=3 or CM_CHANNEL=1,3 CM_FIELDS=4 or CM_CHANNEL=2 CM_FIELDS=2,4
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/channels.glsl"
#include "common/luminance.glsl"

layout(std430, binding = CM_STORAGE_BRICKS_TOGETHER) readonly buffer CmTogether { float cm_together[]; };
layout(std430, binding = CM_STORAGE_BRICKS_NUMBERS) writeonly buffer CmNumbers { float cm_numbers[]; };
layout(location = 0) uniform uvec2 cm_range;    // bricks: first, and one past the last
layout(location = 1) uniform uint cm_to_first;  // destination of brick 0

float cm_field(uint voxel, uint i) { return cm_together[voxel * uint(CM_FIELDS) + i]; }

void cm_put(uint from, uint to) {
#if CM_CHANNEL == CM_CHANNEL_ANISOTROPY
#if CM_FIELDS == 4
  float scatters = cm_luminance(vec3(cm_field(from, 1u), cm_field(from, 2u), cm_field(from, 3u)));
#else
  float scatters = cm_field(from, 1u);
#endif
  cm_numbers[2u * to] = 2.0 * cm_field(from, 0u) - scatters;
  cm_numbers[2u * to + 1u] = scatters;
#elif CM_CHANNEL == CM_CHANNEL_VELOCITY
  float density = cm_field(from, 3u);
  for (uint i = 0u; i < 3u; ++i) cm_numbers[4u * to + i] = 2.0 * cm_field(from, i) - density;
  cm_numbers[4u * to + 3u] = density;
#else
  for (uint i = 0u; i < uint(CM_FIELDS); ++i) cm_numbers[uint(CM_FIELDS) * to + i] = cm_field(from, i);
#endif
}

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint brick = min(cm_range.x + work, cm_range.y - 1u);  // surplus groups repeat the last brick
  for (uint v = gl_LocalInvocationIndex; v < 512u; v += 64u) cm_put(512u * brick + v, 512u * (cm_to_first + brick) + v);
}
