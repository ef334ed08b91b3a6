#version 450
// Final color = noise-free light + denoised positive residual - denoised negative residual (denoise_guides.comp).
// Pixels that are not finite stay unchanged.
// variants: -
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "denoise/denoise.glsl"
layout(binding = CM_UNIT_DENOISE_COLOR) uniform sampler2D cm_missing;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;
layout(binding = CM_UNIT_GUIDE_EMISSION) uniform sampler2D cm_emission;
layout(rgba32f, binding = CM_IMAGE_DENOISED) uniform image2D cm_denoised;
layout(location = 0) uniform ivec2 cm_first;  // corner in the image

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(cm_denoised)))) return;
  ivec2 texel = cm_first + at;
  vec4 color = imageLoad(cm_denoised, at);
  if (!cm_is_finite(color.rgb)) return;
  vec3 known = cm_exact_light(texelFetch(cm_emission, texel, 0), texelFetch(cm_transmittance, texel, 0).x);
  color.rgb = max(color.rgb + known - texelFetch(cm_missing, at, 0).rgb, vec3(0.0));
  imageStore(cm_denoised, at, color);
}
