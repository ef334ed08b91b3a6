#version 450
// Blends unfiltered light back in where the filter changed more than noise.
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet.glsl"
layout(binding = CM_UNIT_WAVELET_UNFILTERED) uniform sampler2D cm_unfiltered;  // over coverage; a: its variance
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;

#define CM_RADIUS 2
// Differences between filtered and unfiltered light count as bias beyond this multiple of the noise.
#define CM_CERTAIN 1.1

// Weight w of the unfiltered light. It is large where the filter's bias exceeds the noise. Of noise of variance v the
// filter leaves r v, and it keeps at most a part c = sqrt(r) of the pixel itself. Then filtered and unfiltered light
// differ by b^2 + (1 - c)^2 v. The neighborhood gives that difference, and thus the bias b. w minimizes the error (1 -
// w)^2 b^2 + (c + w (1 - c))^2 v.
float cm_unfiltered_share(ivec2 texel, CmGuides here) {
  ivec2 size = textureSize(cm_guides, 0);
  vec4 slopes = cm_slopes(texel, here);
  float off = 0.0;
  vec2 noise = vec2(0.0);  // variance without the filter, and with it
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      CmGuides there = cm_guides_at(at);
      if (!there.finite) continue;
      float weight = cm_alike(here, there, slopes, vec2(x, y));
      vec4 unfiltered = texelFetch(cm_unfiltered, at, 0);
      vec2 spread = texelFetch(cm_spread, at, 0).xy;
      float cover = cm_cover(spread.x);
      vec3 apart = texelFetch(cm_front, at, 0).rgb / cover - unfiltered.rgb;
      off += weight * dot(apart, apart) / 3.0;
      noise += weight * vec2(unfiltered.a, spread.y / (cover * cover));
    }
  }
  if (!cm_is_positive(noise.x)) return 1.0;
  float kept = min(1.0, sqrt(noise.y / noise.x));
  float differ = (1.0 - kept) * (1.0 - kept) * noise.x;
  float bias = max(0.0, off - CM_CERTAIN * differ);
  float more = bias - kept * (1.0 - kept) * noise.x;
  return more > 0.0 ? more / (bias + differ) : 0.0;
}

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (texel.x >= textureSize(cm_guides, 0).x || texel.y >= cm_rows.y) return;
  CmGuides here = cm_guides_at(texel);
  vec4 front = texelFetch(cm_front, texel, 0);
  if (here.finite) {
    vec3 unfiltered = cm_cover(texelFetch(cm_spread, texel, 0).x) * texelFetch(cm_unfiltered, texel, 0).rgb;
    front.rgb = mix(front.rgb, unfiltered, cm_unfiltered_share(texel, here));
  }
  imageStore(cm_front_out, texel, front);
}
