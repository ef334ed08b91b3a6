#version 450
// Draws an accumulation as displayed color, or its depth. Variants, not uniforms, select the work per pixel, because
// software drivers execute both sides of every branch. CM_LAYERS 1: surfaces at the size of the rectangle lie below, in
// front of the background. CM_LUT 1: a display LUT replaces the tone curve.
// variants: CM_DEPTH=1 or CM_DEPTH=0 CM_BILINEAR=0,1 CM_RESOLVED=0,1 CM_TONE_MAP=0u,1u,2u,3u CM_ENCODE=true,false or CM_DEPTH=0 CM_BILINEAR=1 CM_RESOLVED=0,1 CM_TONE_MAP=0u,1u,2u,3u CM_ENCODE=true,false CM_LAYERS=1 or CM_DEPTH=0 CM_BILINEAR=0,1 CM_RESOLVED=0,1 CM_ENCODE=true,false CM_LUT=1 or CM_DEPTH=0 CM_BILINEAR=1 CM_RESOLVED=0,1 CM_ENCODE=true,false CM_LAYERS=1 CM_LUT=1
#ifndef CM_LAYERS
#define CM_LAYERS 0
#endif
#ifndef CM_LUT
#define CM_LUT 0
#endif
#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "display/display_lut.glsl"

layout(binding = CM_UNIT_SUM) uniform sampler2D cm_sum;  // row 0 is the image's top; CM_RESOLVED: means
layout(binding = CM_UNIT_COUNTS) uniform usampler2D cm_counts;
layout(binding = CM_UNIT_VOLUME_Z) uniform sampler2D cm_volume_z;
layout(location = 0) uniform ivec4 cm_viewport;
layout(location = 1) uniform bool cm_flip_y;
#if CM_DEPTH == 0
layout(location = 2) uniform float cm_exposure;
layout(location = 3) uniform bool cm_transparent;
layout(location = 4) uniform vec3 cm_backdrop;  // radiance behind everything, beside the background's
#if CM_LAYERS || !CM_RESOLVED
layout(location = 6) uniform bool cm_with_background;  // false: without the background
layout(binding = CM_UNIT_BACKGROUND) uniform sampler2D cm_background;  // mean radiance
#endif
layout(location = 0) out vec4 cm_color;
#if CM_LUT
layout(location = 7) uniform uint cm_lut_shaper;
layout(location = 8) uniform vec2 cm_lut_domain;
layout(binding = CM_UNIT_DISPLAY_LUT) uniform sampler3D cm_lut;  // encoded colors; red is the first axis

// Encoded color of exposed radiance.
vec3 cm_lut_color(vec3 exposed) {
  vec3 position;
  for (int c = 0; c < 3; ++c) position[c] = cm_lut_position(exposed[c], cm_lut_shaper, cm_lut_domain);
  CmLutCell cell = cm_lut_cell(position, textureSize(cm_lut, 0).x);
  vec3 color = vec3(0.0);
  for (int i = 0; i < 4; ++i) color += cell.weights[i] * texelFetch(cm_lut, cell.points[i], 0).rgb;
  return clamp(color, vec3(0.0), vec3(1.0));
}
#endif
#if CM_LAYERS
layout(binding = CM_UNIT_LAYER_COLOR) uniform sampler2DArray cm_layer_color;
layout(binding = CM_UNIT_LAYER_Z) uniform sampler2DArray cm_layer_z;
layout(binding = CM_UNIT_HOST_DEPTH) uniform sampler2DArray cm_host_z;
layout(location = 5) uniform ivec4 cm_layers;  // layers, whether blended ones follow, the host's depth layers

// Mean of the surface pass at a texel, without the surfaces behind the host's depth.
vec4 cm_surfaces(ivec2 texel) {
  vec2 share = (vec2(texel) + 0.5) / vec2(textureSize(cm_layer_z, 0).xy);
  vec4 sum = vec4(0.0);
  for (int i = 0; i < cm_layers.x; ++i) {
    float host_z = uintBitsToFloat(0x7f800000u);
    if (cm_layers.z > 0) {
      ivec2 at = ivec2(share * vec2(textureSize(cm_host_z, 0).xy));
      host_z = texelFetch(cm_host_z, ivec3(at, i % cm_layers.z), 0).x;
    }
    vec4 color = vec4(0.0);
    if (texelFetch(cm_layer_z, ivec3(texel, i), 0).x <= host_z) color = texelFetch(cm_layer_color, ivec3(texel, i), 0);
    if (cm_layers.y > 0 && texelFetch(cm_layer_z, ivec3(texel, cm_layers.x + i), 0).x <= host_z) {
      vec4 blended = texelFetch(cm_layer_color, ivec3(texel, cm_layers.x + i), 0);
      color = blended + (1.0 - blended.a) * color;
    }
    sum += color;
  }
  return sum / float(cm_layers.x);
}
#endif

vec4 cm_texel(ivec2 texel) {
#if CM_RESOLVED
  vec4 mean = texelFetch(cm_sum, texel, 0);
#else
  vec4 mean = texelFetch(cm_sum, texel, 0) / max(float(texelFetch(cm_counts, texel, 0).x), 1.0);
#endif
#if CM_LAYERS
  return mean;
#else
#if !CM_RESOLVED
  if (cm_with_background) mean.rgb += texelFetch(cm_background, texel, 0).rgb;
#endif
  return cm_transparent ? mean : vec4(mean.rgb + (1.0 - mean.a) * cm_backdrop, 1.0);
#endif
}
#else
layout(location = 2) uniform vec2 cm_depth;  // a, b
layout(location = 3) uniform bool cm_orthographic;
#endif

void main() {
  // Not gl_FragCoord itself: with per-sample shading by the host it is not at the pixel's center.
  ivec2 pixel = ivec2(floor(gl_FragCoord.xy)) - cm_viewport.xy;
  if (!cm_flip_y) pixel.y = cm_viewport.w - 1 - pixel.y;
  ivec2 size = textureSize(cm_sum, 0);
  vec2 at = (vec2(pixel) + 0.5) * (vec2(size) / vec2(cm_viewport.zw));
#if CM_DEPTH == 0
#if CM_BILINEAR
  vec2 low = floor(at - 0.5);
  vec2 weight = at - 0.5 - low;
  ivec2 last = size - 1;
#if CM_LAYERS
  ivec2 layer_size = textureSize(cm_layer_z, 0).xy;
  // Of the four coarse pixels around, those of similar surface depth count most, so that silhouettes have no seam.
  float here = 1.0 / texelFetch(cm_layer_z, ivec3(pixel, 0), 0).x;
  vec4 value = vec4(0.0);
  vec3 background = vec3(0.0);
  float sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    ivec2 offset = ivec2(i & 1, i >> 1);
    ivec2 tap = clamp(ivec2(low) + offset, ivec2(0), last);
    float there = 1.0 / texelFetch(cm_layer_z, ivec3((vec2(tap) + 0.5) / vec2(size) * vec2(layer_size), 0), 0).x;
    vec2 part = mix(1.0 - weight, weight, vec2(offset));
    float alike = part.x * part.y / (0.01 + abs(here - there) / max(max(here, there), 1e-30));
    value += alike * cm_texel(tap);
    background += alike * texelFetch(cm_background, tap, 0).rgb;
    sum += alike;
  }
  value /= sum;
  background /= sum;
  vec4 behind = cm_surfaces(pixel);
  value += (1.0 - value.a) * behind;
  if (cm_with_background) value.rgb += background * (1.0 - behind.a);
  if (!cm_transparent) value = vec4(value.rgb + (1.0 - value.a) * cm_backdrop, 1.0);
#else
  ivec2 p0 = clamp(ivec2(low), ivec2(0), last);
  ivec2 p1 = clamp(ivec2(low) + 1, ivec2(0), last);
  vec4 value = mix(mix(cm_texel(p0), cm_texel(ivec2(p1.x, p0.y)), weight.x),
                   mix(cm_texel(ivec2(p0.x, p1.y)), cm_texel(p1), weight.x), weight.y);
#endif
#else
  vec4 value = cm_texel(pixel);
#endif
#if CM_LUT
  vec3 encoded = cm_lut_color(cm_exposed(value.rgb, cm_exposure));
  vec3 linear = cm_srgb_decode_each(encoded);
  cm_color = CM_ENCODE ? cm_encoded_over(linear, encoded, value.a) : cm_linear_over(linear, value.a);
#else
  cm_color = cm_display_over(value, cm_exposure, CM_TONE_MAP, CM_ENCODE);
#endif
#else
  float z = texelFetch(cm_volume_z, min(ivec2(at), size - 1), 0).x;
  if (!cm_is_positive(z)) discard;
  gl_FragDepth = clamp(cm_depth.x + (cm_orthographic ? cm_depth.y * z : cm_depth.y / z), 0.0, 1.0);
#endif
}
