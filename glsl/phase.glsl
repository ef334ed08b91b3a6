// Henyey-Greenstein phase function. Shared by GLSL and C++. Cosines are between the directions of flight before and
// after, so g > 0 scatters forward; the function integrates to 1 over the sphere.
#ifndef CM_PHASE_GLSL
#define CM_PHASE_GLSL
#include "frame.glsl"

CM_FN float cm_phase(float g, float cosine) {
  // 1 + g^2 - 2 g cosine, which is never 0, without the cancellation.
  float k = abs(g);
  float d = (1.0f - k) * (1.0f - k) + 2.0f * max(0.0f, k - g * cosine);
  return 0.0795774715f * (1.0f - g * g) / (d * sqrt(d));
}

// Cosine with density 2 pi cm_phase(g, .), by inversion.
CM_FN float cm_phase_cosine(float g, float u) {
  if (abs(g) < 1e-3f) return 1.0f - 2.0f * u;
  float s = (1.0f - g * g) / (1.0f - g + 2.0f * g * u);
  return clamp((1.0f + g * g - s * s) / (2.0f * g), -1.0f, 1.0f);
}

// Unit vector at the cosine and angle around unit vector w.
CM_FN vec3 cm_around(vec3 w, float cosine, float angle) {
  vec3 u;
  vec3 v;
  cm_frame(w, u, v);
  float sine = sqrt(max(0.0f, 1.0f - cosine * cosine));
  return normalize(u * (sine * cos(angle)) + v * (sine * sin(angle)) + w * cosine);
}

#endif
