#version 450
// Inputs of the denoiser: mean color, albedo and normal. A volume hides the surfaces behind it from these guides as
// from the eye; otherwise hidden geometry would show through clouds in the result. In place of the surface it adds the
// medium's own albedo, so that the volume's outline is a guide as well. The albedo is scaled by the local contrast of
// the noise-free light, so that billows are guides too. CM_BACKGROUND 0: radiance in front of the background; 1: all
// radiance. CM_KNOWN 1: subtracts the noise-free light. The residual has either sign, which the network does not
// accept, so its positive and negative parts go to separate images.
// variants: CM_BACKGROUND=0,1 CM_KNOWN=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "denoise/denoise.glsl"
layout(binding = CM_UNIT_SUM) uniform sampler2D cm_sum;
layout(binding = CM_UNIT_COUNTS) uniform usampler2D cm_counts;
layout(binding = CM_UNIT_BACKGROUND) uniform sampler2D cm_background;  // means
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;    // of surfaces, as the next two
layout(binding = CM_UNIT_GUIDE_NORMAL) uniform sampler2D cm_normal;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;  // in front of them
layout(binding = CM_UNIT_GUIDE_EMISSION) uniform sampler2D cm_emission;
layout(rgba32f, binding = CM_IMAGE_GUIDE_COLOR) uniform writeonly image2D cm_color_out;
layout(rgba32f, binding = CM_IMAGE_GUIDE_ALBEDO) uniform writeonly image2D cm_albedo_out;
layout(rgba32f, binding = CM_IMAGE_GUIDE_NORMAL) uniform writeonly image2D cm_normal_out;
#if CM_KNOWN
layout(rgba32f, binding = CM_IMAGE_GUIDE_MISSING) uniform writeonly image2D cm_missing_out;
#endif
layout(location = 0) uniform vec3 cm_medium_albedo;
layout(location = 1) uniform ivec2 cm_first;  // corner in the image

vec3 cm_known_light(ivec2 texel) {
  vec3 known = texelFetch(cm_emission, texel, 0).rgb;
  return cm_is_finite(known) ? known : vec3(0.0);
}

// Neighborhood for the local contrast, about as wide as billows: steps to each side, and pixels per step.
#define CM_STEPS 4
#define CM_STEP 3

// Brightness of the noise-free light relative to its neighborhood: 0 if black, 1/2 if equal to the neighborhood.
vec3 cm_relief(ivec2 texel) {
  ivec2 end = cm_first + imageSize(cm_color_out) - 1;
  vec4 about = vec4(0.0);
  for (int y = -CM_STEPS; y <= CM_STEPS; ++y) {
    for (int x = -CM_STEPS; x <= CM_STEPS; ++x) {
      float weight = exp(-0.125 * float(x * x + y * y));
      about += weight * vec4(cm_known_light(clamp(texel + CM_STEP * ivec2(x, y), cm_first, end)), 1.0);
    }
  }
  if (about.rgb == vec3(0.0)) return vec3(1.0);
  vec3 here = cm_known_light(texel);
  return here / max(here + about.rgb / about.a, vec3(1e-30));
}

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(cm_color_out)))) return;
  ivec2 texel = cm_first + at;
  vec4 color = texelFetch(cm_sum, texel, 0) / max(float(texelFetch(cm_counts, texel, 0).x), 1.0);
#if CM_BACKGROUND
  color.rgb += texelFetch(cm_background, texel, 0).rgb;
#endif
  float transmittance = texelFetch(cm_transmittance, texel, 0).x;
#if CM_KNOWN
  vec3 left = color.rgb - cm_exact_light(texelFetch(cm_emission, texel, 0), transmittance);
  bool finite = cm_is_finite(left);
  if (finite) color.rgb = max(left, vec3(0.0));
  imageStore(cm_missing_out, at, vec4(finite ? max(-left, vec3(0.0)) : vec3(0.0), 0.0));
#endif
  vec3 medium = transmittance < 1.0 ? cm_medium_albedo * cm_relief(texel) : cm_medium_albedo;
  vec3 albedo = mix(medium, texelFetch(cm_albedo, texel, 0).rgb, transmittance);
  imageStore(cm_color_out, at, color);
  imageStore(cm_albedo_out, at, vec4(albedo, 0.0));
  imageStore(cm_normal_out, at, vec4(transmittance * texelFetch(cm_normal, texel, 0).xyz, 0.0));
}
