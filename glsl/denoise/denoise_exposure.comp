#version 450
// Exposure for denoising: 0.18 over the geometric mean of the image's luminance. The mean is over bins of about 16x16
// pixels, in which noise has little effect. The exposure is 1 if everything is black. CM_STAGE 0: one bin per work
// group; 1: reduction of all bins, one work group.
// variants: CM_STAGE=0,1
layout(local_size_x = 64) in;
#include "common/bindings.glsl"
#include "denoise/denoise.glsl"

#if CM_STAGE == 0
layout(binding = CM_UNIT_DENOISE_COLOR) uniform sampler2D cm_color;
#endif
layout(std430, binding = CM_STORAGE_DENOISE_BINS) buffer CmBins {
  float cm_exposure;
  vec2 cm_bins[];  // log2 of the luminance, and 1 if it is above 0
};
layout(location = 0) uniform uint cm_first;  // index of the first work group
layout(location = 1) uniform uint cm_bins_x;
layout(location = 2) uniform uint cm_bins_y;
shared vec2 cm_sums[64];

// Sums over the work group; the result is valid in its first lane.
vec2 cm_sum(vec2 value) {
  uint lane = gl_LocalInvocationID.x;
  cm_sums[lane] = value;
  for (uint half_of = 32u; half_of > 0u; half_of >>= 1) {
    barrier();
    if (lane < half_of) cm_sums[lane] += cm_sums[lane + half_of];
  }
  return cm_sums[0];
}

void main() {
  uint lane = gl_LocalInvocationID.x;
#if CM_STAGE == 0
  uint group = cm_first + gl_WorkGroupID.x;
  uvec2 bins = uvec2(cm_bins_x, cm_bins_y);
  uvec2 bin = uvec2(group % bins.x, group / bins.x);
  uvec2 size = uvec2(textureSize(cm_color, 0));
  uvec2 begin = bin * size / bins;
  uvec2 end = (bin + 1u) * size / bins;
  uint width = end.x - begin.x;
  uint count = width * (end.y - begin.y);
  float sum = 0.0;
  for (uint i = lane; i < count; i += 64u) {
    vec3 color = texelFetch(cm_color, ivec2(begin + uvec2(i % width, i / width)), 0).rgb;
    sum += dot(cm_radiance(color), vec3(0.212671, 0.715160, 0.072169));
  }
  float luminance = cm_sum(vec2(sum, 0.0)).x / float(count);
  bool lit = luminance > 1e-8 && cm_is_finite(luminance);
  if (lane == 0u) cm_bins[group] = lit ? vec2(log2(luminance), 1.0) : vec2(0.0);
#else
  vec2 sum = vec2(0.0);
  for (uint i = lane; i < cm_bins_x * cm_bins_y; i += 64u) sum += cm_bins[i];
  sum = cm_sum(sum);
  if (lane == 0u) cm_exposure = sum.y > 0.0 ? 0.18 / exp2(sum.x / sum.y) : 1.0;
#endif
}
