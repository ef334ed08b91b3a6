#version 450
// What the wavelet filter begins with, of an accumulation as it is now. CM_HOLES as resolve.comp's.
// variants: CM_HOLES=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "bindings.glsl"
#include "means.glsl"
#include "wavelet.glsl"
layout(binding = CM_UNIT_MOMENTS) uniform sampler2D cm_moments;  // means of squared luminance
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_GUIDE_NORMAL) uniform sampler2D cm_normal;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;
layout(binding = CM_UNIT_GUIDE_SURFACE_Z) uniform sampler2D cm_surface_z;
layout(binding = CM_UNIT_GUIDE_VOLUME_Z) uniform sampler2D cm_volume_z;
layout(location = 3) uniform float cm_surfaces;  // 0: surfaces are drawn beneath, by another
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_SPREAD) uniform writeonly image2D cm_spread_out;
layout(rgba32ui, binding = CM_IMAGE_WAVELET_GUIDES) uniform writeonly uimage2D cm_guides_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_BEHIND) uniform writeonly image2D cm_behind_out;

// Of a size that can be squared. By its bits: compilers may take comparisons for those of numbers.
bool cm_is_number(float x) { return (floatBitsToUint(x) & 0x7fffffffu) < floatBitsToUint(1e15); }
bool cm_are_numbers(vec3 v) { return cm_is_number(v.x) && cm_is_number(v.y) && cm_is_number(v.z); }

// A single path that found a light by chance stands out from all about it by more than its pixel's own samples tell
// for certain: it is dimmed, or the filter would take it for an edge, or spread it out as dots.
#define CM_SPECK 1.5
#define CM_CERTAIN 2.0  // standard errors
float cm_speck(ivec2 texel, float luminance, float square, float samples) {
  float brightest = 0.0;
  float sum = 0.0;
  float count = 0.0;
  ivec2 last = textureSize(cm_sum, 0) - 1;
  for (int y = -2; y <= 2; ++y) {
    for (int x = -2; x <= 2; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThan(at, last))) continue;
      float n = float(texelFetch(cm_counts, at, 0).x);
      float there = n > 0.0 ? cm_luminance(texelFetch(cm_sum, at, 0).rgb) / n : 0.0;
      if (n == 0.0 || !cm_is_number(there)) continue;
      if (at != texel) brightest = max(brightest, there);
      sum += there;
      count += 1.0;
    }
  }
  float most = CM_SPECK * max(brightest, sum / max(count, 1.0));
  float deviation = sqrt(max(0.0, square - luminance * luminance) / max(samples - 1.0, 1.0));
  if (samples >= 2.0) most = max(most, luminance - CM_CERTAIN * deviation);
  return luminance > most ? most / luminance : 1.0;
}

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
  vec3 tint = cm_tint(cm_surfaces * texelFetch(cm_albedo, texel, 0).rgb, covered, guides.transmittance);
  float open = cm_open(covered, volume.y, guides.transmittance);
  vec3 front = mean.front.rgb / tint;
  float part = clamp(1.0 - mean.front.a, 0.0, 1.0);
  guides.finite = cm_are_numbers(mean.front.rgb) && cm_are_numbers(mean.background) && cm_is_number(mean.front.a) &&
                  cm_is_number(1e-15 * square);
  // A sample is covered or it is not: of its square, what is behind can be taken off.
  float behind = cm_luminance(mean.background);
  float apart = cm_luminance(mean.front.rgb);
  float own = max(square - (part > 0.0 ? behind * behind / part : 0.0), apart * apart);
  float dimmed = guides.finite ? cm_speck(texel, apart, own, samples) : 1.0;
  front *= dimmed;
  float luminance = cm_luminance(front);
  float scale = apart > 0.0 ? luminance / apart : 1.0;
  float moment = samples > 0.0 ? scale * scale * own : luminance * luminance;
  if (!guides.finite) {
    front = vec3(0.0);
    part = samples = moment = 0.0;
    mean.background = vec3(0.0);
  }
  imageStore(cm_front_out, texel, vec4(front, part));
  imageStore(cm_spread_out, texel, vec4(open, moment, samples, 0.0));
  imageStore(cm_guides_out, texel, cm_packed(guides));
  // The mean of those samples that nothing covers; alpha says whether there were any.
  imageStore(cm_behind_out, texel, part > 0.0 ? vec4(mean.background / part, 1.0) : vec4(0.0));
}
