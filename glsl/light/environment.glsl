// The environment map: an equirectangular image with its top at +Y and its center at +Z, rotated from +Z towards +X.
// Shared by GLSL and C++; the includer provides
//   cm                                  the parameters
//   uvec4 cm_environment_word(uint i)   texel i, by rows from the top: src/light/environment.hpp
//
// Radiance is interpolated bilinearly between texel centers, and so is the pdf of NEE over the image. A texel is picked
// by its luminance times the solid angle of its row, and a point by a tent function about its center. So every
// direction with light has a pdf above 0, and a sun of one texel is sampled in proportion to its brightness.
#ifndef CM_ENVIRONMENT_GLSL
#define CM_ENVIRONMENT_GLSL

#include "common/frame.glsl"

// RGB as three halves times a power of two, which is stored in the upper half of the last word.
CM_FN vec3 cm_environment_texel(uint i) {
  uvec4 word = cm_environment_word(i);
  vec2 rg = unpackHalf2x16(word.z);
  vec2 b = unpackHalf2x16(word.w & 0xffffu);
  return vec3(rg.x, rg.y, b.x) * uintBitsToFloat(word.w & 0xffff0000u);
}

struct CmSurrounding {
  vec3 radiance;
  float density;  // solid-angle pdf of NEE
};

CM_FN CmSurrounding cm_surrounding(vec3 w) {
  uvec2 size = cm.environment.size;
  float across = sqrt(w.x * w.x + w.z * w.z);
  vec3 there = cm_turned(w, cm.lights.environment_turn);
  float azimuth = across > 0.0f ? atan(there.x, there.z) : 0.0f;
  vec2 at = vec2(0.5f - 0.159154943f * azimuth, 0.318309886f * atan(across, w.y)) * vec2(size) - 0.5f;
  vec2 low = floor(at);
  vec2 f = at - low;
  uint x_0 = low.x < 0.0f ? size.x - 1u : min(uint(low.x), size.x - 1u);
  uint x_1 = x_0 + 1u < size.x ? x_0 + 1u : 0u;
  uint y_0 = low.y < 0.0f ? 0u : min(uint(low.y), size.y - 1u);
  uint y_1 = low.y < 0.0f ? 0u : min(y_0 + 1u, size.y - 1u);
  vec3 row_0 = mix(cm_environment_texel(y_0 * size.x + x_0), cm_environment_texel(y_0 * size.x + x_1), f.x);
  vec3 row_1 = mix(cm_environment_texel(y_1 * size.x + x_0), cm_environment_texel(y_1 * size.x + x_1), f.x);
  float angle = 3.14159265f / float(size.y);
  float weight = mix(cm_luminance(row_0) * sin((float(y_0) + 0.5f) * angle),
                     cm_luminance(row_1) * sin((float(y_1) + 0.5f) * angle), f.y);
  CmSurrounding found;
  found.radiance = cm.lights.environment_strength * mix(row_0, row_1, f.y);
  found.density = cm.environment.density * weight / max(across, 1e-6f);
  return found;
}

// Samples a tent function on [-1, 1], with its peak at 0.
CM_FN float cm_tent(float u) { return u < 0.5f ? sqrt(2.0f * u) - 1.0f : 1.0f - sqrt(2.0f - 2.0f * u); }

CM_FN vec3 cm_environment_radiance(vec3 w) { return cm_surrounding(w).radiance; }
CM_FN float cm_environment_pdf(CmLightHit hit) { return cm_surrounding(hit.w).density; }

CM_FN CmLightSample cm_environment_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  uvec2 size = cm.environment.size;
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x7f4a7c15u)));
  uint i = cm_below(pick.x, size.x * size.y);
  uvec4 word = cm_environment_word(i);
  if (pick.y > word.x) i = word.y;
  float x = float(i % size.x) + 0.5f + cm_tent(u.x);
  float y = float(i / size.x) + 0.5f + cm_tent(u.y);
  // Reflects coordinates beyond a pole.
  float height = float(size.y);
  y = y < 0.0f ? -y : (y > height ? 2.0f * height - y : y);
  float azimuth = 6.28318531f * (0.5f - x / float(size.x));
  float down = 3.14159265f * y / height;
  vec2 level = sin(down) * vec2(sin(azimuth), cos(azimuth));
  vec2 turn = cm.lights.environment_turn;
  vec3 w = cm_turned(vec3(level.x, cos(down), level.y), vec2(turn.x, -turn.y));
  CmSurrounding found = cm_surrounding(w);
  return CmLightSample(CM_LIGHT_ENVIRONMENT, found.radiance, w, 3.0e38f, found.density);
}

#endif
