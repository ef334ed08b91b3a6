// Current mean of an accumulation's pixel. CM_HOLES 1: a pixel without samples gets the mean of its neighbors. If these
// have no samples either, it gets the previous image's value.
#ifndef CM_MEANS_GLSL
#define CM_MEANS_GLSL

layout(binding = CM_UNIT_SUM) uniform sampler2D cm_sum;
layout(binding = CM_UNIT_COUNTS) uniform usampler2D cm_counts;
layout(binding = CM_UNIT_BACKGROUND) uniform sampler2D cm_background;  // means
layout(binding = CM_UNIT_SUM_BEFORE) uniform sampler2D cm_sum_before;  // previous image, of any size
layout(binding = CM_UNIT_COUNTS_BEFORE) uniform usampler2D cm_counts_before;
layout(binding = CM_UNIT_BACKGROUND_BEFORE) uniform sampler2D cm_background_before;

struct CmMean {
  vec4 front;
  vec3 background;
};

CmMean cm_mean_of(sampler2D sums, usampler2D counts, sampler2D backgrounds, ivec2 texel) {
  return CmMean(texelFetch(sums, texel, 0) / max(float(texelFetch(counts, texel, 0).x), 1.0),
                texelFetch(backgrounds, texel, 0).rgb);
}

#if CM_HOLES
// Mean of the neighbors that have samples; the texel itself, without samples, if there are none.
CmMean cm_around(sampler2D sums, usampler2D counts, sampler2D backgrounds, ivec2 texel, out bool has) {
  ivec2 last = textureSize(sums, 0) - 1;
  CmMean sum = CmMean(vec4(0.0), vec3(0.0));
  float n = 0.0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      ivec2 near = clamp(texel + ivec2(x, y), ivec2(0), last);
      float one = min(float(texelFetch(counts, near, 0).x), 1.0);
      CmMean mean = cm_mean_of(sums, counts, backgrounds, near);
      sum.front += one * mean.front;
      sum.background += one * mean.background;
      n += one;
    }
  }
  has = n > 0.0;
  if (!has) return cm_mean_of(sums, counts, backgrounds, clamp(texel, ivec2(0), last));
  return CmMean(sum.front / n, sum.background / n);
}
#endif

CmMean cm_mean(ivec2 texel) {
  CmMean mean = cm_mean_of(cm_sum, cm_counts, cm_background, texel);
#if CM_HOLES
  if (texelFetch(cm_counts, texel, 0).x > 0u) return mean;
  bool has = false;
  mean = cm_around(cm_sum, cm_counts, cm_background, texel, has);
  if (has) return mean;
  vec2 share = (vec2(texel) + 0.5) / vec2(textureSize(cm_sum, 0));
  ivec2 before = ivec2(share * vec2(textureSize(cm_sum_before, 0)));
  CmMean last = cm_mean_of(cm_sum_before, cm_counts_before, cm_background_before, before);
  has = texelFetch(cm_counts_before, before, 0).x > 0u;
  if (!has) last = cm_around(cm_sum_before, cm_counts_before, cm_background_before, before, has);
  if (has) return last;
#endif
  return mean;
}

#endif
