#version 450
// Merges a pixel's samples with the reprojected history (CM_HISTORY 1), and writes the history for the following
// images. History counts for less where it differs from the new samples around it by more than their noise. It counts
// for nothing once there are CM_ENOUGH new samples.
// variants: CM_HISTORY=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet_history.glsl"
layout(location = 3) uniform float cm_most;  // maximum number of samples in the history
layout(rgba32ui, binding = CM_IMAGE_HISTORY_LIGHT) uniform writeonly uimage2D cm_light_out;
layout(rgba32ui, binding = CM_IMAGE_HISTORY_GUIDES) uniform writeonly uimage2D cm_guides_out;
#if CM_HISTORY
layout(binding = CM_UNIT_HISTORY_LIGHT) uniform usampler2D cm_history_light;
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_SPREAD) uniform writeonly image2D cm_spread_out;

#define CM_RADIUS 2
#define CM_ENOUGH 64.0
// Clamping range of the history, in standard deviations of the neighborhood.
#define CM_CLAMP 2.0
// Squared differences up to this multiple of the noise's variance count as noise.
#define CM_NOISE_BOUND 2.0
// The history's variance counts as at most this many samples beside the new ones.
#define CM_FEW 4.0

// Statistics of a pixel's neighborhood, itself included, of the samples that cover it. The others say nothing about
// radiance: without this, a history that is darkened because they are dark, but keeps its coverage, leaves dark spots
// where the ground covers a part of the pixels.
struct CmAround {
  vec3 now;  // means: of new samples, of the history
  vec3 then;
  vec3 deviation;   // standard deviation of pixels' means
  float variance;   // variance of a sample's luminance
  float samples_now;
  float samples_then;
};

CmAround cm_around(ivec2 texel, CmGuides here, vec4 slopes) {
  ivec2 size = textureSize(cm_guides, 0);
  vec3 now = vec3(0.0);
  vec3 then = vec3(0.0);
  vec3 squares = vec3(0.0);
  vec2 moments = vec2(0.0);  // now, then
  float n_now = 0.0;
  float n_then = 0.0;
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      CmGuides there = cm_guides_at(at);
      vec4 spread = texelFetch(cm_spread, at, 0);
      if (!there.finite || spread.z == 0.0) continue;
      vec4 front = texelFetch(cm_front, at, 0);
      CmLit lit = cm_unpacked_light(texelFetch(cm_history_light, at, 0));
      float weight = cm_alike(here, there, slopes, vec2(x, y));
      float cover = cm_cover(front.a);
      now += weight * spread.z * front.rgb;
      squares += weight * spread.z * front.rgb * front.rgb / cover;
      moments += weight * vec2(spread.z * spread.y, lit.samples * lit.moment);
      n_now += weight * spread.z * cover;
      then += weight * lit.samples * lit.front.rgb;
      n_then += weight * lit.samples * cm_cover(lit.front.a);
    }
  }
  CmAround around;
  around.samples_now = n_now;
  around.samples_then = n_then;
  around.now = n_now > 0.0 ? now / n_now : vec3(0.0);
  around.then = n_then > 0.0 ? then / n_then : vec3(0.0);
  around.deviation = n_now > 0.0 ? sqrt(max(vec3(0.0), squares / n_now - around.now * around.now)) : vec3(0.0);
  vec2 n = vec2(n_now, n_then);
  vec2 means = vec2(cm_luminance(around.now), cm_luminance(around.then));
  vec2 variances = max(vec2(0.0), moments / max(n, vec2(1e-30)) - means * means);
  vec2 say = min(n, vec2(n_now, CM_FEW));
  around.variance = dot(say, variances) / max(say.x + say.y, 1e-30);
  return around;
}

// History of the pixel, reduced and clamped where it disagrees with the new samples.
CmLit cm_trusted_history(CmLit lit, CmAround around, float samples) {
  if (around.samples_now == 0.0 || lit.samples == 0.0) return lit;
  float off = cm_luminance(around.then - around.now);
  float noise = around.variance * (1.0 / around.samples_now + 1.0 / around.samples_then);
  float bias = max(0.0, off * off - CM_NOISE_BOUND * noise);
  // Equivalent number of samples: the history's error is bias^2 + variance / lit.samples.
  lit.samples *= around.variance > 0.0 ? around.variance / (around.variance + lit.samples * bias)
                                       : (bias > 0.0 ? 0.0 : 1.0);
  lit.samples *= max(0.0, 1.0 - samples / CM_ENOUGH);
  float unknown = around.variance * CM_FEW / around.samples_now;
  vec3 room = CM_CLAMP * sqrt(around.deviation * around.deviation + unknown);
  float cover = cm_cover(lit.front.a);
  vec3 clamped = cover * clamp(lit.front.rgb / cover, around.now - room, around.now + room);
  float before = cm_luminance(lit.front.rgb);
  float after = cm_luminance(clamped);
  if (before != 0.0) lit.moment *= min(1.0, after * after / (before * before));
  lit.front.rgb = clamped;
  return lit;
}
#endif

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (texel.x >= textureSize(cm_guides, 0).x || texel.y >= cm_rows.y) return;
  CmGuides here = cm_guides_at(texel);
  vec4 front = texelFetch(cm_front, texel, 0);
  vec4 spread = texelFetch(cm_spread, texel, 0);
#if CM_HISTORY
  if (here.finite) {
    CmAround around = cm_around(texel, here, cm_slopes(texel, here));
    CmLit lit = cm_unpacked_light(texelFetch(cm_history_light, texel, 0));
    lit = cm_trusted_history(lit, around, spread.z);
    if (lit.samples > 0.0) {
      float all = spread.z + lit.samples;
      front += (lit.samples / all) * (lit.front - front);
      spread.y += (lit.samples / all) * (lit.moment - spread.y);
      spread.z = all;
    }
  }
  imageStore(cm_front_out, texel, front);
  imageStore(cm_spread_out, texel, spread);
#endif
  imageStore(cm_light_out, texel, cm_packed_light(CmLit(front, spread.y, min(spread.z, cm_most))));
  imageStore(cm_guides_out, texel, cm_packed_geometry(cm_geometry_at(texel)));
}
