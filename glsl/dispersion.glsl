// Light of one wavelength in a picture of three colours (KHR_materials_dispersion): a path that is refracted by an index that
// depends on it takes one, and its colour from then on. Shared by GLSL and C++.
#ifndef CM_DISPERSION_GLSL
#define CM_DISPERSION_GLSL

// The three colours as shares of the spectrum, each a tent about the dominant wavelength of Rec. 709's primary, in
// nanometres: an approximation, in which what is white stays white.
const vec3 CM_TENT_MIDDLE = vec3(611.0f, 549.0f, 464.0f);
const float CM_TENT_HALF = 62.0f;

// Of u in [0, 1): a third of all for each tent.
CM_FN float cm_wavelength(float u) {
  float third = u * 3.0f;
  float middle = third < 1.0f ? CM_TENT_MIDDLE.x : (third < 2.0f ? CM_TENT_MIDDLE.y : CM_TENT_MIDDLE.z);
  float v = 2.0f * fract(third) - 1.0f;
  float off = 1.0f - sqrt(max(0.0f, 1.0f - abs(v)));
  return middle + CM_TENT_HALF * (v < 0.0f ? -off : off);
}

// The colours' densities at a wavelength over that with which cm_wavelength takes it: its mean is 1.
CM_FN vec3 cm_wavelength_colour(float wavelength) {
  vec3 tents = max(1.0f - abs(vec3(wavelength) - CM_TENT_MIDDLE) * (1.0f / CM_TENT_HALF), 0.0f);
  return tents * (3.0f / max(tents.x + tents.y + tents.z, 1e-6f));
}

// Cauchy's two terms through the index at 587.6 nm (of 1e4 at most); dispersion: 20 over Abbe's number.
CM_FN float cm_cauchy(float ior, float dispersion, float wavelength) {
  return clamp(ior + (ior - 1.0f) * dispersion * 0.05f * (523655.0f / (wavelength * wavelength) - 1.5168f), 1.0f, 1e4f);
}

#endif
