// Light of one wavelength in an RGB image (KHR_materials_dispersion). A path that is refracted by an index that depends
// on the wavelength picks one, and keeps its color from there on. Shared by GLSL and C++.
#ifndef CM_DISPERSION_GLSL
#define CM_DISPERSION_GLSL

// Each RGB channel as a part of the spectrum: a tent function about the dominant wavelength of Rec. 709's primary, in
// nanometers. This is an approximation, in which white stays white.
const vec3 CM_TENT_MIDDLE = vec3(611.0f, 549.0f, 464.0f);
const float CM_TENT_HALF = 62.0f;

// Samples a wavelength with u in [0, 1): a third for each tent.
CM_FN float cm_wavelength(float u) {
  float third = u * 3.0f;
  float middle = third < 1.0f ? CM_TENT_MIDDLE.x : (third < 2.0f ? CM_TENT_MIDDLE.y : CM_TENT_MIDDLE.z);
  float v = 2.0f * fract(third) - 1.0f;
  float off = 1.0f - sqrt(max(0.0f, 1.0f - abs(v)));
  return middle + CM_TENT_HALF * (v < 0.0f ? -off : off);
}

// The channels' spectral weights at a wavelength, over the pdf of cm_wavelength. Their mean is 1.
CM_FN vec3 cm_wavelength_color(float wavelength) {
  vec3 tents = max(1.0f - abs(vec3(wavelength) - CM_TENT_MIDDLE) * (1.0f / CM_TENT_HALF), 0.0f);
  return tents * (3.0f / max(tents.x + tents.y + tents.z, 1e-6f));
}

// Two terms of Cauchy's equation through the index at 587.6 nm, clamped to [1, 1e4]. dispersion: 20 / Abbe number.
CM_FN float cm_cauchy(float ior, float dispersion, float wavelength) {
  return clamp(ior + (ior - 1.0f) * dispersion * 0.05f * (523655.0f / (wavelength * wavelength) - 1.5168f), 1.0f, 1e4f);
}

#endif
