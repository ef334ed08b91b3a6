#version 450
// One level of the edge-avoiding a-trous wavelet (Dammertz et al., "Edge-Avoiding A-Trous Wavelet Transform for fast
// Global Illumination Filtering", 2010). As in SVGF (Schied et al., "Spatiotemporal Variance-Guided Filtering", 2017),
// differences within the noise's standard deviation are no edges.
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet.glsl"
layout(location = 3) uniform int cm_stride;
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_SPREAD) uniform writeonly image2D cm_spread_out;

#define CM_RADIUS 2
const float cm_kernel[3] = float[3](0.375, 0.25, 0.0625);
// Times the standard deviation of two pixels' difference.
#define CM_TOLERANCE 1.2

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  ivec2 size = textureSize(cm_guides, 0);
  if (texel.x >= size.x || texel.y >= cm_rows.y) return;
  CmGuides here = cm_guides_at(texel);
  vec4 front = texelFetch(cm_front, texel, 0);
  vec4 spread = texelFetch(cm_spread, texel, 0);
  if (!here.finite) {
    imageStore(cm_front_out, texel, front);
    imageStore(cm_spread_out, texel, spread);
    return;
  }
  vec4 slopes = cm_slopes(texel, here);
  float cover = cm_cover(spread.x);
  vec3 color = front.rgb / cover;
  float variance = spread.y / (cover * cover);
  float excess = front.a - spread.x;
  vec4 front_sum = vec4(0.0);
  vec3 spread_sum = vec3(0.0);
  float sum = 0.0;
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 offset = cm_stride * ivec2(x, y);
      ivec2 at = texel + offset;
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      CmGuides there = cm_guides_at(at);
      if (!there.finite) continue;
      vec4 other = texelFetch(cm_front, at, 0);
      vec4 other_spread = texelFetch(cm_spread, at, 0);
      float other_cover = cm_cover(other_spread.x);
      vec3 difference = other.rgb / other_cover - color;
      float of_color = dot(difference, difference) /
                        (3.0 * (variance + other_spread.y / (other_cover * other_cover)) + 1e-30);
      float more = other.a - other_spread.x - excess;
      float of_part = more * more / (spread.z + other_spread.z + 1e-30);
      float weight = cm_kernel[abs(x)] * cm_kernel[abs(y)] * cm_alike(here, there, slopes, vec2(offset)) *
                     exp(-max(of_color, of_part) / (2.0 * CM_TOLERANCE * CM_TOLERANCE));
      front_sum += weight * other;
      spread_sum += vec3(weight, weight * weight, weight * weight) * other_spread.xyz;
      sum += weight;
    }
  }
  imageStore(cm_front_out, texel, front_sum / sum);
  imageStore(cm_spread_out, texel, vec4(spread_sum / vec3(sum, sum * sum, sum * sum), 0.0));
}
