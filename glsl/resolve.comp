#version 450
// An accumulation's means. CM_HOLES 1: a pixel whose first path is still under way takes after those around it, and
// where none of these has a sample either it shows what was there before.
// variants: CM_HOLES=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "bindings.glsl"
layout(binding = CM_UNIT_SUM) uniform sampler2D cm_sum;
layout(binding = CM_UNIT_COUNTS) uniform usampler2D cm_counts;
layout(binding = CM_UNIT_SUM_BEFORE) uniform sampler2D cm_sum_before;  // of any size
layout(binding = CM_UNIT_COUNTS_BEFORE) uniform usampler2D cm_counts_before;
layout(rgba32f, binding = CM_IMAGE_MEANS) uniform writeonly image2D cm_means;

vec4 cm_mean_of(sampler2D sums, usampler2D counts, ivec2 texel) {
  return texelFetch(sums, texel, 0) / max(float(texelFetch(counts, texel, 0).x), 1.0);
}

#if CM_HOLES
// The mean of those texels around that have samples.
vec4 cm_around(sampler2D sums, usampler2D counts, ivec2 texel, out float has) {
  ivec2 last = textureSize(sums, 0) - 1;
  vec4 around = vec4(0.0);
  has = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      ivec2 near = clamp(texel + ivec2(x, y), ivec2(0), last);
      float one = min(float(texelFetch(counts, near, 0).x), 1.0);
      around += one * cm_mean_of(sums, counts, near);
      has += one;
    }
  }
  return around / max(has, 1.0);
}
#endif

vec4 cm_mean(ivec2 texel) {
  vec4 mean = cm_mean_of(cm_sum, cm_counts, texel);
#if CM_HOLES
  if (texelFetch(cm_counts, texel, 0).x > 0u) return mean;
  float has = 0.0;
  mean = cm_around(cm_sum, cm_counts, texel, has);
  if (has > 0.0) return mean;
  vec2 share = (vec2(texel) + 0.5) / vec2(textureSize(cm_sum, 0));
  ivec2 before = ivec2(share * vec2(textureSize(cm_sum_before, 0)));
  mean = cm_mean_of(cm_sum_before, cm_counts_before, before);
  if (texelFetch(cm_counts_before, before, 0).x == 0u) mean = cm_around(cm_sum_before, cm_counts_before, before, has);
#endif
  return mean;
}

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, textureSize(cm_sum, 0)))) return;
  imageStore(cm_means, texel, cm_mean(texel));
}
