#version 450
// First pass of the wavelet filter: reads the current accumulation. CM_HOLES as in resolve.comp.
// variants: CM_HOLES=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "display/means.glsl"
#include "denoise/wavelet.glsl"
layout(binding = CM_UNIT_MOMENTS) uniform sampler2D cm_moments;  // means of squared luminance
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_GUIDE_NORMAL) uniform sampler2D cm_normal;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;
layout(binding = CM_UNIT_GUIDE_SURFACE_Z) uniform sampler2D cm_surface_z;
layout(binding = CM_UNIT_GUIDE_VOLUME_Z) uniform sampler2D cm_volume_z;
layout(binding = CM_UNIT_GUIDE_EMISSION) uniform sampler2D cm_emission;
layout(location = 3) uniform float cm_surfaces;  // 0: another renderer draws the surfaces below
layout(location = 4) uniform ivec4 cm_box;       // pixels of the crop window: first, and one past the last
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_SPREAD) uniform writeonly image2D cm_spread_out;
layout(rgba32ui, binding = CM_IMAGE_WAVELET_GUIDES) uniform writeonly uimage2D cm_guides_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_BEHIND) uniform writeonly image2D cm_behind_out;

#define CM_SQUARABLE 1e15  // larger values overflow when squared

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (texel.x >= textureSize(cm_sum, 0).x || texel.y >= cm_rows.y) return;
  CmMean mean = cm_mean(texel);
  float samples = float(texelFetch(cm_counts, texel, 0).x);
  float square = texelFetch(cm_moments, texel, 0).x;
  CmGuides guides;
  vec2 through = texelFetch(cm_transmittance, texel, 0).xy;
  vec2 volume = texelFetch(cm_volume_z, texel, 0).xy;
  guides.transmittance = through.x;
  vec3 normal = cm_surfaces * texelFetch(cm_normal, texel, 0).xyz;
  guides.normal = guides.transmittance * normal;
  guides.surface_z = texelFetch(cm_surface_z, texel, 0).x;
  guides.volume_z = volume.x;
  float covered = cm_surfaces * through.y;
  // The noise-free light is not filtered; wavelet_output.comp adds it back.
  vec4 known_light = texelFetch(cm_emission, texel, 0);
  vec3 emission = known_light.rgb;
  vec3 tint = cm_tint(cm_surfaces * texelFetch(cm_albedo, texel, 0).rgb, covered, guides.transmittance, known_light);
  float open = cm_open(covered, volume.y, guides.transmittance);
  vec3 lit = mean.front.rgb - emission;
  vec3 front = lit / tint;
  float part = clamp(1.0 - mean.front.a, 0.0, 1.0);
  guides.finite = cm_is_within(mean.front.rgb, CM_SQUARABLE) && cm_is_within(mean.background, CM_SQUARABLE) &&
                  cm_is_within(mean.front.a, CM_SQUARABLE) && cm_is_within(emission, CM_SQUARABLE) &&
                  cm_is_within(1e-15 * square, CM_SQUARABLE) && all(greaterThanEqual(texel, cm_box.xy)) &&
                  all(lessThan(texel, cm_box.zw));
  // A sample is either covered or not, so the background can be subtracted from the mean square.
  float behind = cm_luminance(mean.background);
  float luminance = cm_luminance(front);
  float apart = cm_luminance(lit);
  float known = cm_luminance(emission);
  float of_front = square - (part > 0.0 ? behind * behind / part : 0.0);
  float own = max(of_front - known * (2.0 * apart + known), apart * apart);
  float scale = apart != 0.0 ? clamp(cm_luminance(abs(front)) / cm_luminance(abs(lit)), 1.0, 20.0) : 1.0;
  float moment = samples > 0.0 ? scale * scale * own : luminance * luminance;
  if (!guides.finite) {
    front = vec3(0.0);
    part = samples = moment = 0.0;
    mean.background = vec3(0.0);
  }
  imageStore(cm_front_out, texel, vec4(front, part));
  imageStore(cm_spread_out, texel, vec4(open, moment, samples, 0.0));
  imageStore(cm_guides_out, texel, cm_packed(guides));
  // Mean over the uncovered samples; alpha is 1 if there were any.
  imageStore(cm_behind_out, texel, part > 0.0 ? vec4(mean.background / part, 1.0) : vec4(0.0));
}
