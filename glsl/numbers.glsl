// What a float is, by its bits: a compiler that takes none to be NaN or infinite may turn comparisons around, so that
// !(x > 0.0f) is x <= 0.0f, which no NaN is, and isnan(x) false. Shared by GLSL and C++.
#ifndef CM_NUMBERS_GLSL
#define CM_NUMBERS_GLSL
#include "shared.glsl"

CM_FN bool cm_is_nan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }

// |x| <= most; no NaN is.
CM_FN bool cm_is_within(float x, float most) { return (floatBitsToUint(x) & 0x7fffffffu) <= floatBitsToUint(most); }
CM_FN bool cm_is_within(vec3 v, float most) {
  return cm_is_within(v.x, most) && cm_is_within(v.y, most) && cm_is_within(v.z, most);
}

CM_FN bool cm_is_finite(float x) { return (floatBitsToUint(x) & 0x7fffffffu) < 0x7f800000u; }
CM_FN bool cm_is_finite(vec3 v) { return cm_is_finite(v.x) && cm_is_finite(v.y) && cm_is_finite(v.z); }

// Infinity is; no NaN is, and no denormal: GPUs may take them for 0, and one over them for infinity.
CM_FN bool cm_is_positive(float x) { return floatBitsToUint(x) - 0x00800000u <= 0x7f000000u; }

#endif
