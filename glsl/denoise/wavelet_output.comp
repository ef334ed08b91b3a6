#version 450
// Last pass of the wavelet filter: writes the result as means. CM_BACKGROUND as in resolve.comp.
// variants: CM_BACKGROUND=0,1,2
layout(local_size_x = 8, local_size_y = 8) in;
#define CM_HOLES 0
#include "common/bindings.glsl"
#include "display/means.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet.glsl"
layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_GUIDE_TRANSMITTANCE) uniform sampler2D cm_transmittance;
layout(binding = CM_UNIT_GUIDE_VOLUME_Z) uniform sampler2D cm_volume_z;
layout(binding = CM_UNIT_GUIDE_EMISSION) uniform sampler2D cm_emission;
layout(location = 3) uniform float cm_surfaces;
layout(rgba32f, binding = CM_IMAGE_WAVELET_BEHIND) uniform readonly image2D cm_behind;
layout(rgba32f, binding = CM_IMAGE_MEANS) uniform writeonly image2D cm_means;
#if CM_BACKGROUND == 2
layout(rgba32f, binding = CM_IMAGE_BACKGROUND_MEANS) uniform writeonly image2D cm_background_means;
#endif

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  if (texel.x >= textureSize(cm_guides, 0).x || texel.y >= cm_rows.y) return;
  CmMean mean;
  if (cm_guides_at(texel).finite) {
    vec4 front = texelFetch(cm_front, texel, 0);
    float open = texelFetch(cm_spread, texel, 0).x;
    vec2 through = texelFetch(cm_transmittance, texel, 0).xy;
    float covered = cm_surfaces * through.y;
    vec4 known = texelFetch(cm_emission, texel, 0);
    vec3 tint = cm_tint(cm_surfaces * texelFetch(cm_albedo, texel, 0).rgb, covered, through.x, known);
    float own = cm_open(covered, texelFetch(cm_volume_z, texel, 0).y, through.x);
    // From the coverage of the mixed pixels to that of this one. If only its own samples count, that is theirs.
    front = cm_within_cover(cm_scaled_cover(front, cm_cover(own) / cm_cover(open)));
    float part = min(front.a, 1.0);
    vec3 lit = tint * front.rgb;
    mean.front = vec4(max(vec3(0.0), lit + known.rgb), 1.0 - part);
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
