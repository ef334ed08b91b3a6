// Environment map prefiltered by GGX lobes, for rasterized surfaces: images over direction for a few roughnesses.
// src/light/prefiltered_environment.cpp makes them. Shaders look them up in the lobe's dominant direction (Karis, "Real
// Shading in Unreal Engine 4", SIGGRAPH 2013 courses). Shared by GLSL and C++.
#ifndef CM_PREFILTERED_GLSL
#define CM_PREFILTERED_GLSL

// Size in texels, in the layout of environment.glsl; levels for roughness 0 to 1.
const int CM_PREFILTERED_WIDTH = 64;
const int CM_PREFILTERED_HEIGHT = 32;
const int CM_PREFILTERED_LEVELS = 6;

CM_FN float cm_prefiltered_level(float roughness) {
  return clamp(roughness, 0.0f, 1.0f) * float(CM_PREFILTERED_LEVELS - 1);
}

// Texture coordinates of a direction, from 0 to 1.
CM_FN vec2 cm_prefiltered_position(vec3 w) {
  float across = sqrt(w.x * w.x + w.z * w.z);
  float azimuth = across > 0.0f ? atan(w.x, w.z) : 0.0f;
  return vec2(0.5f - 0.159154943f * azimuth, 0.318309886f * atan(across, w.y));
}

// Dominant direction of a GGX lobe: the mirror direction of a smooth one, moved towards the normal n of a rough one.
// After Lagarde and de Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014.
CM_FN vec3 cm_prefiltered_middle(vec3 n, vec3 wo, float roughness) {
  vec3 mirrored = n * (2.0f * dot(n, wo)) - wo;
  float smoothness = 1.0f - roughness;
  return normalize(mix(n, mirrored, smoothness * (sqrt(smoothness) + roughness)));
}

#endif
