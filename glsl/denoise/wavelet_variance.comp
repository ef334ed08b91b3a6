#version 450
// Estimates the noise's variance. A pixel's few samples say little about it (a single one nothing), so its neighbors
// contribute. Differences between pixels count only if no pixel has two samples. If a pixel's own samples differ much
// more than that, their variance counts, so that the filter replaces a pixel with a rare bright sample by its neighbors.
//
// Fireflies are dimmed first. A firefly is a pixel much brighter than all similar pixels nearby, and than its own
// samples make certain. It is dimmed to slightly more than the brightest neighbor; otherwise it would spread as a blob,
// or be kept as an edge. If only few pixels nearby have any light, it is kept, because it may be all there is.
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#define CM_WAVELET_READS
#include "denoise/wavelet.glsl"
layout(rgba32f, binding = CM_IMAGE_WAVELET_FRONT) uniform writeonly image2D cm_front_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_SPREAD) uniform writeonly image2D cm_spread_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_UNFILTERED) uniform writeonly image2D cm_unfiltered_out;
layout(rgba32f, binding = CM_IMAGE_WAVELET_BEHIND) uniform image2D cm_behind;

#define CM_RADIUS 2
// With fewer degrees of freedom, the differences between pixels are the better estimate.
#define CM_ENOUGH 3.0
#define CM_FEW 2.0
// Maximum brightness relative to the second brightest pixel.
#define CM_BRIGHTER 1.5
// In standard errors.
#define CM_CERTAIN 2.0
// A pixel's own variance counts above this multiple of its neighborhood's.
#define CM_NOISIER 2.0
// Minimum similarity of a pixel, and minimum number of lit pixels, for the test.
#define CM_ALIKE 0.1
#define CM_LIT 6u

// Background for pixels without an uncovered sample: the mean over neighbors, first near ones, then some farther away.
vec3 cm_behind_near(ivec2 texel) {
  ivec2 last = textureSize(cm_guides, 0) - 1;
  for (int stride = 1; stride <= 5; stride += 4) {
    vec4 sum = vec4(0.0);
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) {
        vec4 there = imageLoad(cm_behind, clamp(texel + stride * ivec2(x, y), ivec2(0), last));
        if (there.a == 1.0) sum += there;  // alpha 1; pixels filled in here have alpha 0
      }
    }
    if (sum.a > 0.0) return sum.rgb / sum.a;
  }
  return vec3(0.0);
}

// Coverage of a pixel for this test. Where its few samples cover more than feature rays do, their light is not that of
// a firefly.
float cm_hit_cover(float open, float part) { return cm_cover(min(open, part)); }

// Brightest pixels of a neighborhood: luminance over coverage.
struct CmBrightest {
  float most;  // of the brightest pixel, which may be the center; next: of the second brightest
  float next;
  uint lit;    // number of pixels with light
};

CmBrightest cm_brightest(ivec2 texel, CmGuides here, vec4 slopes) {
  ivec2 size = textureSize(cm_guides, 0);
  CmBrightest about = CmBrightest(0.0, 0.0, 0u);
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      CmGuides there = cm_guides_at(at);
      if (!there.finite || cm_alike(here, there, slopes, vec2(x, y)) < CM_ALIKE) continue;
      vec4 front = texelFetch(cm_front, at, 0);
      float luminance = cm_luminance(front.rgb) / cm_hit_cover(texelFetch(cm_spread, at, 0).x, front.a);
      about.next = max(about.next, min(about.most, luminance));
      about.most = max(about.most, luminance);
      if (luminance > 0.0) about.lit += 1u;
    }
  }
  return about;
}

// Dimming factor of a pixel, 1 if it is no firefly. spread: input of this pass.
float cm_dimmed(vec4 front, vec4 spread, CmBrightest about) {
  float cover = cm_hit_cover(spread.x, front.a);
  float luminance = cm_luminance(front.rgb);
  if (about.lit < CM_LIT || luminance < cover * about.most) return 1.0;
  float room = CM_BRIGHTER * cover * about.next;
  if (spread.z >= 2.0) {
    float deviation = sqrt(max(0.0, spread.y - luminance * luminance) / (spread.z - 1.0));
    room = max(room, luminance - CM_CERTAIN * deviation);
  }
  return luminance > room ? room / luminance : 1.0;
}

// Variance of the mean of a pixel's own samples that cover it, after dimming; 0 if it has fewer than two. Samples that
// do not cover the pixel are dark, which is no noise.
float cm_own_variance(vec4 front, vec4 spread, float dimmed) {
  if (spread.z < 2.0) return 0.0;
  float luminance = cm_luminance(front.rgb);
  float covered = max(1.0 - front.a, 1.0 / spread.z);
  return dimmed * dimmed * max(0.0, spread.y - luminance * luminance / covered) / (spread.z - 1.0);
}

void main() {
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, cm_rows.x);
  ivec2 size = textureSize(cm_guides, 0);
  if (texel.x >= size.x || texel.y >= cm_rows.y) return;
  CmGuides here = cm_guides_at(texel);
  vec4 spread = texelFetch(cm_spread, texel, 0);
  vec4 slopes = cm_slopes(texel, here);
  CmBrightest about = cm_brightest(texel, here, slopes);
  float own_samples = spread.z;
  vec4 front = vec4(0.0);   // sums over all samples: radiance, and coverage
  vec3 either = vec3(0.0);  // sum of absolute values
  float square = 0.0;
  float open = 0.0;
  float count = 0.0;
  float deviation = 0.0;    // sum of squared deviations from the pixels' means
  float freedom = 0.0;      // its degrees of freedom, times coverage
  float degrees = 0.0;
  for (int y = -CM_RADIUS; y <= CM_RADIUS; ++y) {
    for (int x = -CM_RADIUS; x <= CM_RADIUS; ++x) {
      ivec2 at = texel + ivec2(x, y);
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
      CmGuides there = cm_guides_at(at);
      vec4 other = texelFetch(cm_spread, at, 0);
      if (!there.finite || other.z == 0.0) continue;
      vec4 color = texelFetch(cm_front, at, 0);
      float weight = cm_alike(here, there, slopes, vec2(x, y));
      float cover = cm_cover(other.x);
      float dimmed = cm_dimmed(color, other, about);
      color.rgb *= dimmed;
      other.y *= dimmed * dimmed;
      float luminance = cm_luminance(color.rgb);
      float samples = weight * other.z;
      front += samples * vec4(color.rgb, cover);
      either += samples * abs(color.rgb);
      open += samples * color.a;
      square += samples * other.y;
      count += samples;
      deviation += samples * max(0.0, other.y - luminance * luminance);
      freedom += weight * (other.z - 1.0) * cover;
      degrees += weight * (other.z - 1.0);
    }
  }
  vec2 variance = vec2(0.0);
  if (count > 0.0) {
    float cover = cm_cover(spread.x);
    float mean = cover * cm_luminance(front.rgb) / front.a;
    float sample_variance =
        degrees >= CM_ENOUGH ? cover * deviation / freedom : max(0.0, cover * square / front.a - mean * mean);
    // Variance per channel, if the colors differ in all channels.
    vec3 color = either / count;
    float luminance = cm_luminance(color);
    float channels = dot(color, color) / 3.0;
    // At most as for pure blue: the residual after subtracting emission has either sign.
    if (channels > 0.0) sample_variance *= min(64.0, channels / max(luminance * luminance, 1e-30));
    // None of few samples does not mean never: the Krichevsky-Trofimov estimator (1981).
    open = (open + 0.5) / (count + 1.0);
    // Means of few samples are skewed, and the estimate of their noise is itself noisy.
    float samples = max(own_samples, 0.5);
    variance = (1.0 + CM_FEW / samples) / samples * vec2(sample_variance, open * (1.0 - open));
  }
  vec4 own = texelFetch(cm_front, texel, 0);
  if (here.finite) {
    float dimmed = cm_dimmed(own, spread, about);
    float own_variance = cm_own_variance(own, spread, dimmed);
    if (own_variance > CM_NOISIER * variance.x) variance.x = own_variance;
    own.rgb *= dimmed;
  }
  imageStore(cm_front_out, texel, own);
  imageStore(cm_spread_out, texel, vec4(spread.x, variance, 0.0));
  float own_cover = cm_cover(spread.x);
  imageStore(cm_unfiltered_out, texel, vec4(own.rgb / own_cover, variance.x / (own_cover * own_cover)));
  if (imageLoad(cm_behind, texel).a == 0.0) imageStore(cm_behind, texel, vec4(cm_behind_near(texel), 0.0));
}
