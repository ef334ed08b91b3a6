#version 450
// What a denoiser is told of a picture: its means, and what is known of pixels without light. A volume hides what is
// behind it from these guides as it does from the eye: else geometry that nobody sees would print through clouds. What
// it has instead is its own albedo, so that its outline is a guide as well.
// CM_BACKGROUND 0: what is in front of the background; 1: all radiance.
// variants: CM_BACKGROUND=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "bindings.glsl"
layout(binding = CM_UNIT_SUM) uniform sampler2D cm_sum;
layout(binding = CM_UNIT_COUNTS) uniform usampler2D cm_counts;
layout(binding = CM_UNIT_BACKGROUND) uniform sampler2D cm_background;  // already means
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;    // of surfaces, as the two that follow
layout(binding = CM_UNIT_GUIDE_NORMAL) uniform sampler2D cm_normal;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;  // in front of them
layout(rgba32f, binding = CM_IMAGE_GUIDE_COLOUR) uniform writeonly image2D cm_colour_out;
layout(rgba32f, binding = CM_IMAGE_GUIDE_ALBEDO) uniform writeonly image2D cm_albedo_out;
layout(rgba32f, binding = CM_IMAGE_GUIDE_NORMAL) uniform writeonly image2D cm_normal_out;
layout(location = 0) uniform vec3 cm_medium_albedo;
layout(location = 1) uniform ivec2 cm_first;  // pixel of the picture

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(cm_colour_out)))) return;
  ivec2 texel = cm_first + at;
  vec4 colour = texelFetch(cm_sum, texel, 0) / max(float(texelFetch(cm_counts, texel, 0).x), 1.0);
#if CM_BACKGROUND
  colour.rgb += texelFetch(cm_background, texel, 0).rgb;
#endif
  float transmittance = texelFetch(cm_transmittance, texel, 0).x;
  vec3 albedo = mix(cm_medium_albedo, texelFetch(cm_albedo, texel, 0).rgb, transmittance);
  imageStore(cm_colour_out, at, colour);
  imageStore(cm_albedo_out, at, vec4(albedo, 0.0));
  imageStore(cm_normal_out, at, vec4(transmittance * texelFetch(cm_normal, texel, 0).xyz, 0.0));
}
