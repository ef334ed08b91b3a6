#version 450
// What the wavelet filter found, as means. CM_BACKGROUND as resolve.comp's.
// variants: CM_BACKGROUND=0,1,2
layout(local_size_x = 8, local_size_y = 8) in;
#define CM_HOLES 0
#include "bindings.glsl"
#include "means.glsl"
#define CM_WAVELET_READS
#include "wavelet.glsl"
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;
layout(binding = CM_UNIT_GUIDE_VOLUME_Z) uniform sampler2D cm_volume_z;
layout(binding = CM_UNIT_GUIDE_EMISSION) uniform sampler2D cm_emission;
layout(binding = CM_UNIT_WAVELET_UNFILTERED) uniform sampler2D cm_unfiltered;  // over cover, and its variance
layout(location = 3) uniform float cm_surfaces;
layout(rgba32f, binding = CM_IMAGE_WAVELET_BEHIND) uniform readonly image2D cm_behind;
layout(rgba32f, binding = CM_IMAGE_MEANS) uniform writeonly image2D cm_means;
#if CM_BACKGROUND == 2
layout(rgba32f, binding = CM_IMAGE_BACKGROUND_MEANS) uniform writeonly image2D cm_background_means;
#endif

#define CM_RADIUS 2
// Times the noise: what filtered and unfiltered light differ by for certain.
#define CM_CERTAIN 1.1

// How much of a pixel's light is best taken unfiltered: most of it where the filter is off by more than the noise. Of
// noise of variance v the filter has left r v, at most by keeping a part c of the pixel itself, the root of r. Then
// filtered and unfiltered light differ by b^2 + (1 - c)^2 v, which is known of the pixels about it, and so is the bias b;
// the mix of both that is least off, by (1 - w)^2 b^2 + (c + w (1 - c))^2 v, follows.
float cm_unfiltered_share(ivec2 texel) {
  ivec2 size = textureSize(cm_guides, 0);
  float off = 0.0;
  vec2 noise = vec2(0.0);  // without the filter, with it
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      vec4 unfiltered = texelFetch(cm_unfiltered, at, 0);
      vec2 spread = texelFetch(cm_spread, at, 0).xy;
      float cover = cm_cover(spread.x);
      vec3 apart = texelFetch(cm_front, at, 0).rgb / cover - unfiltered.rgb;
      off += dot(apart, apart) / 3.0;
      noise += vec2(unfiltered.a, spread.y / (cover * cover));
    }
  }
  if (!(noise.x > 0.0)) return 1.0;
  float kept = min(1.0, sqrt(noise.y / noise.x));
  float differ = (1.0 - kept) * (1.0 - kept) * noise.x;
  float bias = max(0.0, off - CM_CERTAIN * differ);
  float more = bias - kept * (1.0 - kept) * noise.x;
  return more > 0.0 ? more / (bias + differ) : 0.0;
}

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (texel.x >= textureSize(cm_guides, 0).x || texel.y >= cm_rows.y) return;
  CmMean mean;
  if (cm_guides_at(texel).finite) {
    vec4 front = texelFetch(cm_front, texel, 0);
    float open = texelFetch(cm_spread, texel, 0).x;
    vec2 through = texelFetch(cm_transmittance, texel, 0).xy;
    float covered = cm_surfaces * through.y;
    vec3 emission = texelFetch(cm_emission, texel, 0).rgb;
    vec3 tint = cm_tint(cm_surfaces * texelFetch(cm_albedo, texel, 0).rgb, covered, through.x, emission);
    float own = cm_open(covered, texelFetch(cm_volume_z, texel, 0).y, through.x);
    // Where only its own samples count, these are what they are.
    float part = clamp(front.a + own - open, 0.0, 1.0);
    vec3 filtered = front.rgb / cm_cover(open);
    vec3 lit = tint * cm_cover(own) * mix(filtered, texelFetch(cm_unfiltered, texel, 0).rgb, cm_unfiltered_share(texel));
    mean.front = vec4(max(vec3(0.0), lit + emission), 1.0 - part);
    mean.background = part * imageLoad(cm_behind, texel).rgb;
  } else {
    mean = cm_mean(texel);
  }
#if CM_BACKGROUND == 1
  mean.front.rgb += mean.background;
#elif CM_BACKGROUND == 2
  imageStore(cm_background_means, texel, vec4(mean.background, 0.0));
#endif
  imageStore(cm_means, texel, mean.front);
}
