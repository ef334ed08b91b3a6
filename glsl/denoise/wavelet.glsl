// Shared code of the passes of the wavelet filter (src/render/passes/wavelet.hpp describes their order). A pixel has
//   front    radiance in front of the background, divided by the surface's albedo (demodulated); uncovered fraction
//   spread   uncovered fraction from feature rays; variance of the mean radiance; variance of the uncovered fraction.
//            Before wavelet_variance.comp the second is a sample's second moment and the third the number of samples
//   guides   noise-free features
#ifndef CM_WAVELET_GLSL
#define CM_WAVELET_GLSL
#include "common/shared.glsl"
#include "common/luminance.glsl"
#include "common/numbers.glsl"

layout(location = 0) uniform ivec2 cm_rows;  // rows of this dispatch: first, and one past the last

struct CmGuides {
  vec3 normal;          // of the visible part of the surface: its length is that fraction
  float transmittance;  // of the volume in front of the surface
  float surface_z;      // view depths; above CM_NOTHING_Z: none
  float volume_z;
  bool finite;  // false: the pixel has NaN or infinity, and other pixels ignore it
};

#define CM_NOTHING_Z 1e37

uvec4 cm_packed(CmGuides g) {
  return uvec4(packHalf2x16(g.normal.xy), packHalf2x16(vec2(g.normal.z, g.finite ? g.transmittance : -1.0)),
               floatBitsToUint(min(g.surface_z, 2.0 * CM_NOTHING_Z)), floatBitsToUint(min(g.volume_z, 2.0 * CM_NOTHING_Z)));
}

CmGuides cm_unpacked(uvec4 words) {
  vec2 low = unpackHalf2x16(words.x);
  vec2 high = unpackHalf2x16(words.y);
  return CmGuides(vec3(low, high.x), high.y, uintBitsToFloat(words.z), uintBitsToFloat(words.w), high.y >= 0.0);
}

#ifdef CM_WAVELET_READS
layout(binding = CM_UNIT_WAVELET_FRONT) uniform sampler2D cm_front;
layout(binding = CM_UNIT_WAVELET_SPREAD) uniform sampler2D cm_spread;
layout(binding = CM_UNIT_WAVELET_GUIDES) uniform usampler2D cm_guides;
layout(location = 2) uniform vec2 cm_footprint;   // world size of a pixel at depth z: x + y z

CmGuides cm_guides_at(ivec2 texel) { return cm_unpacked(texelFetch(cm_guides, texel, 0)); }

// Coverage of a pixel. Its radiance is proportional to this if the material there looks the same.
float cm_cover(float open) { return 1.0 - 0.98 * open; }

// Light (front) of a pixel with `ratio` times the coverage. Radiance and coverage change together: otherwise dark and
// bright spots would remain where a pixel's few samples hit the background, or nothing but the surface. Samples cover
// a pixel at most once; the caller limits the result where it is a mean of several pixels.
vec4 cm_scaled_cover(vec4 front, float ratio) { return vec4(ratio * front.rgb, 1.0 - ratio * (1.0 - front.a)); }
vec4 cm_within_cover(vec4 front) {
  float most = max(1.0, 1.0 - front.a);
  return vec4(front.rgb / most, max(0.0, front.a));
}

// Returns the difference of smaller magnitude. The other one may cross an edge.
float cm_smaller(float a, float b) { return abs(a) < abs(b) ? a : b; }

// Depth differences from pixel to pixel, to the right and down: of surfaces (xy), of the volume (zw).
vec4 cm_slopes(ivec2 texel, CmGuides here) {
  ivec2 last = textureSize(cm_guides, 0) - 1;
  vec2 z = vec2(here.surface_z, here.volume_z);
  vec4 slopes;
  for (int axis = 0; axis < 2; ++axis) {
    ivec2 by = ivec2(1 - axis, axis);
    uvec4 before = texelFetch(cm_guides, max(texel - by, ivec2(0)), 0);
    uvec4 after = texelFetch(cm_guides, min(texel + by, last), 0);
    vec2 from = z - uintBitsToFloat(before.zw);
    vec2 to = uintBitsToFloat(after.zw) - z;
    slopes[axis] = cm_smaller(from.x, to.x);
    slopes[2 + axis] = cm_smaller(from.y, to.y);
  }
  return mix(slopes, vec4(0.0), greaterThan(abs(slopes), vec4(0.1 * CM_NOTHING_Z)));
}

// Distance of a depth from the plane through another pixel's depth, relative to the tolerance of that slope.
float cm_off_plane(float here, float there, vec2 slope, vec2 offset) {
  if (max(here, there) > CM_NOTHING_Z) return min(here, there) > CM_NOTHING_Z ? 0.0 : 10.0;
  float expected = dot(slope, offset);
  float footprint = cm_footprint.x + cm_footprint.y * here;
  return min(10.0, abs(there - here - expected) / (0.5 * abs(expected) + 2.0 * footprint * length(offset)));
}

// Similarity of two pixels, 0 to 1. Surfaces count by their visibility.
float cm_alike(CmGuides here, CmGuides there, vec4 slopes, vec2 offset) {
  vec3 bend = here.normal - there.normal;
  float far = 20.0 * dot(bend, bend) + 2.0 * abs(here.transmittance - there.transmittance);
  float seen = max(here.transmittance, there.transmittance);
  far += seen * cm_off_plane(here.surface_z, there.surface_z, slopes.xy, offset);
  if (max(here.volume_z, there.volume_z) < CM_NOTHING_Z) {
    far += 0.25 * (1.0 - seen) * cm_off_plane(here.volume_z, there.volume_z, slopes.zw, offset);
  }
  return exp(-far);
}
#endif

// Visible albedo of a surface, by which its light is divided (demodulation), so that the result is smooth where only
// the color is not. covered: fraction of the pixel covered by surfaces. Emission is added, because its difference
// between samples and feature rays is unrelated to the albedo, which may be black.
vec3 cm_tint(vec3 albedo, float covered, float transmittance, vec4 known) {
  return clamp(1.0 + transmittance * (albedo - covered) + (1.0 - known.a) * known.rgb, 0.05, 1.0);
}

// Fraction of a pixel covered by neither surfaces, ground nor volume.
float cm_open(float covered, float grounded, float transmittance) {
  return transmittance * max(0.0, 1.0 - covered - grounded);
}

#endif
