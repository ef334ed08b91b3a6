#version 450
// Writes an accumulation's means. CM_HOLES 1: a pixel without samples gets the mean of its neighbors, or the previous
// image's value if these have no samples either. CM_BACKGROUND 0: radiance in front of the background, premultiplied;
// 1: all radiance, with the same alpha; 2: as 0, and the background's radiance separately.
// variants: CM_HOLES=0,1 CM_BACKGROUND=0,1,2
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "display/means.glsl"
layout(location = 0) uniform uvec2 cm_rows;  // rows to resolve: first, and one past the last
layout(rgba32f, binding = CM_IMAGE_MEANS) uniform writeonly image2D cm_means;
#if CM_BACKGROUND == 2
layout(rgba32f, binding = CM_IMAGE_BACKGROUND_MEANS) uniform writeonly image2D cm_background_means;
#endif

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (any(greaterThanEqual(texel, ivec2(textureSize(cm_sum, 0).x, cm_rows.y)))) return;
  CmMean mean = cm_mean(texel);
#if CM_BACKGROUND == 1
  mean.front.rgb += mean.background;
#elif CM_BACKGROUND == 2
  imageStore(cm_background_means, texel, vec4(mean.background, 0.0));
#endif
  imageStore(cm_means, texel, mean.front);
}
