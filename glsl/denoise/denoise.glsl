// Shared code of the denoiser's kernels. Channels are halves in blocks of eight: one uvec4 per pixel, block after
// block.
#ifndef CM_DENOISE_GLSL
#define CM_DENOISE_GLSL
#include "common/numbers.glsl"

// Perceptually uniform luminance, 1 at 65504: the fit to Aydin et al., "Extending Quality Metrics to Full Luminance
// Range Images" (2008), with which Open Image Denoise's networks were trained.
const float CM_PU_SCALE = 0.318967155;
const float CM_PU_DARKEST = 1.57945760e-06;
const float CM_PU_DARK = 3.22087631e-02;

float cm_pu(float y) {
  float x = 1.92653254e-01 * log(y + 6.26026094e-03) + 9.98620152e-01;
  if (y <= CM_PU_DARK) x = 1.64593172 * pow(y, 4.31384981e-01) - 2.94139609e-03;
  if (y <= CM_PU_DARKEST) x = 1.41283765e+03 * y;
  return x * CM_PU_SCALE;
}

float cm_pu_inverse(float encoded) {
  float x = encoded / CM_PU_SCALE;
  if (x <= 2.23151711e-03) return x / 1.41283765e+03;
  if (x <= 3.70974749e-01) return pow((x + 2.94139609e-03) / 1.64593172, 1.0 / 4.31384981e-01);
  return exp((x - 9.98620152e-01) / 1.92653254e-01) - 6.26026094e-03;
}

// Packs two halves, rounded to nearest even if the driver's packHalf2x16 truncates, and clamped to the largest half.
uint cm_pack(vec2 v) {
  uvec2 bits = floatBitsToUint(min(v, vec2(65504.0)));
  bits = (bits + 0xfffu + ((bits >> 13) & 1u)) & ~0x1fffu;
  return packHalf2x16(uintBitsToFloat(bits));
}

// Exact part of the noise-free light of aovs.comp: all except sunlight scattered in a medium, which is approximate. If
// a pixel shows both surface and medium, its sunlight counts by the transmittance.
vec3 cm_exact_light(vec4 known, float transmittance) {
  vec3 exact = known.rgb * (1.0 - known.a * (1.0 - transmittance));
  return cm_is_finite(exact) ? exact : vec3(0.0);
}

// Radiance as input of the network: non-finite values become 0, negative ones too.
vec3 cm_radiance(vec3 v) { return cm_is_finite(v) ? max(v, vec3(0.0)) : vec3(0.0); }

#endif
