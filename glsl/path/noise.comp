#version 450
// Noise of a tile, per 8x8 adaptive-sampling block, over pixels with at least two samples. Returns the sums of the
// squared standard errors of luminance in even and in odd rows, the sum of the luminances, and the number of pixels.
// One work group per block. The order of summation is fixed, so that decisions based on it are reproducible.
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "common/luminance.glsl"
#include "path/path_state.glsl"
#include "path/path_blocks.glsl"
#include "path/pixel_store.glsl"

layout(std430, binding = CM_STORAGE_ERRORS) writeonly buffer CmErrors { vec4 cm_errors[]; };

shared vec4 cm_sums[64];

void main() {
  uvec2 local = CM_SQUARE_EDGE * gl_WorkGroupID.xy + gl_LocalInvocationID.xy;
  vec4 sum = vec4(0.0);
  if (local.x < cm.dispatch.tile_size.x && local.y < cm.dispatch.tile_size.y) {
    CmPixel pixel = cm_load_pixel(cm.dispatch.tile_corner + local);
    if (pixel.samples >= 2u) {
      float n = float(pixel.samples);
      float mean = cm_luminance(pixel.sum.rgb / n + pixel.background);
      float squared = max(0.0, pixel.square - mean * mean) / (n - 1.0);
      sum = (local.y & 1u) == 0u ? vec4(squared, 0.0, mean, 1.0) : vec4(0.0, squared, mean, 1.0);
    }
  }
  cm_sums[gl_LocalInvocationIndex] = sum;
  for (uint half_way = 32u; half_way > 0u; half_way /= 2u) {
    barrier();
    if (gl_LocalInvocationIndex < half_way) {
      cm_sums[gl_LocalInvocationIndex] += cm_sums[gl_LocalInvocationIndex + half_way];
    }
  }
  if (gl_LocalInvocationIndex == 0u) cm_errors[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = cm_sums[0];
}
