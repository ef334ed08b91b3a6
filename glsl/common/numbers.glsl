// Classifies floats by their bits. A compiler that assumes no NaN or infinity may invert comparisons, so that !(x >
// 0.0f) becomes x <= 0.0f, which is false for NaN, and may make isnan(x) false. Shared by GLSL and C++.
#ifndef CM_NUMBERS_GLSL
#define CM_NUMBERS_GLSL
#include "common/shared.glsl"

CM_FN bool cm_is_nan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }

// Returns true if |x| <= most; false for NaN.
CM_FN bool cm_is_within(float x, float most) { return (floatBitsToUint(x) & 0x7fffffffu) <= floatBitsToUint(most); }
CM_FN bool cm_is_within(vec3 v, float most) {
  return cm_is_within(v.x, most) && cm_is_within(v.y, most) && cm_is_within(v.z, most);
}

CM_FN bool cm_is_finite(float x) { return (floatBitsToUint(x) & 0x7fffffffu) < 0x7f800000u; }
CM_FN bool cm_is_finite(vec3 v) { return cm_is_finite(v.x) && cm_is_finite(v.y) && cm_is_finite(v.z); }

// Returns true if x > 0, also for infinity; false for NaN and denormals. GPUs may flush denormals to 0, and their
// reciprocals may be infinite.
CM_FN bool cm_is_positive(float x) { return floatBitsToUint(x) - 0x00800000u <= 0x7f000000u; }

#endif
