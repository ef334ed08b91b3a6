// The sheen of cloth (KHR_materials_sheen), with fibers upright on the surface: Estevez and Kulla, "Production Friendly
// Microfacet Sheen BRDF", SIGGRAPH 2017 courses. Shared by GLSL and C++.
#ifndef CM_SHEEN_GLSL
#define CM_SHEEN_GLSL
#include "surface/ggx.glsl"

// Their fit of Smith's Lambda: Lambda is exp of this up to a cosine of 0.5, and point-mirrored beyond.
CM_FN float cm_sheen_fit(float alpha, float x) {
  float smooth2 = (1.0f - alpha) * (1.0f - alpha);
  float a = mix(21.5473f, 25.3245f, smooth2);
  float b = mix(3.82987f, 3.32435f, smooth2);
  float c = mix(0.19823f, 0.16801f, smooth2);
  float d = mix(-1.97760f, -1.27393f, smooth2);
  float e = mix(-4.32054f, -4.85967f, smooth2);
  return a / (1.0f + b * pow(x, c)) + d * x + e;
}
CM_FN float cm_sheen_lambda(float alpha, float cosine) {
  float x = clamp(cosine, 1e-6f, 1.0f);
  if (x < 0.5f) return exp(cm_sheen_fit(alpha, x));
  return exp(2.0f * cm_sheen_fit(alpha, 0.5f) - cm_sheen_fit(alpha, max(1.0f - x, 1e-6f)));
}

// The lobe of white sheen times |cos|, in the frame of the normal.
CM_FN float cm_sheen(float roughness, vec3 wo, vec3 wi, vec3 h) {
  float alpha = cm_alpha(roughness);
  float sine2 = clamp(1.0f - h.z * h.z, 0.0f, 1.0f);
  float density = (2.0f + 1.0f / alpha) * pow(sine2, 0.5f / alpha) * 0.159154943f;
  return density / ((1.0f + cm_sheen_lambda(alpha, wo.z) + cm_sheen_lambda(alpha, wi.z)) * 4.0f * wo.z);
}

// Directions are sampled uniformly over the hemisphere, because most of the lobe is at grazing angles.
const float CM_SHEEN_PDF = 0.159154943f;
CM_FN vec3 cm_sheen_direction(float u0, float u1) {
  float sine = sqrt(max(0.0f, 1.0f - u0 * u0));
  float angle = 6.28318531f * u1;
  return vec3(sine * cos(angle), sine * sin(angle), u0);
}

#endif
