#version 450
// How much noise a tile's pixels have: of each block, over its pixels with two samples, the sum of their luminances'
// squared standard errors, the sum of these luminances, and how many they are. A work group a block; always in the same
// order, so that what is decided by it is the same every time.
layout(local_size_x = 8, local_size_y = 8) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "parameters.glsl"
#include "luminance.glsl"
#include "path_state.glsl"
#include "path_store.glsl"
#include "pixel_store.glsl"

shared vec3 cm_sums[64];

void main() {
  uint block = gl_WorkGroupID.x;
  uvec2 corner = uvec2(block % cm_blocks_across() * CM_BLOCK_WIDTH, block / cm_blocks_across() * CM_BLOCK_HEIGHT);
  vec3 sum = vec3(0.0);
  for (uint x = 0u; x < CM_BLOCK_WIDTH; x += 8u) {
    uvec2 local = corner + uvec2(x, 0u) + gl_LocalInvocationID.xy;
    if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.tile_size.y) break;
    CmPixel pixel = cm_load_pixel(cm.dispatch.tile_corner + local);
    if (pixel.samples < 2u) continue;
    float n = float(pixel.samples);
    float mean = cm_luminance(pixel.sum.rgb / n + pixel.background);
    sum += vec3(max(0.0, pixel.square - mean * mean) / (n - 1.0), mean, 1.0);
  }
  cm_sums[gl_LocalInvocationIndex] = sum;
  for (uint half_way = 32u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (gl_LocalInvocationIndex < half_way) {
      cm_sums[gl_LocalInvocationIndex] += cm_sums[gl_LocalInvocationIndex + half_way];
    }
  }
  if (gl_LocalInvocationIndex == 0u) {
    cm_blocks[block] = uvec4(floatBitsToUint(cm_sums[0].x), floatBitsToUint(cm_sums[0].y), uint(cm_sums[0].z), 0u);
  }
}
