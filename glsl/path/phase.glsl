// Phase functions. Shared by GLSL and C++. Cosines are between the directions of propagation before and after, so g > 0
// scatters forward. Each phase function integrates to 1 over the sphere.
#ifndef CM_PHASE_GLSL
#define CM_PHASE_GLSL
#include "common/frame.glsl"

// A Henyey-Greenstein lobe, mixed by second_weight with a second lobe of Draine (2003). The latter is Henyey-Greenstein
// with g = second_anisotropy times 1 + second_bend cosine^2, normalized.
struct CmPhase {
  float anisotropy;
  float second_anisotropy;
  float second_bend;
  float second_weight;
};

#define CM_ISOTROPIC_PHASE 0.0795774715f
CM_FN float cm_henyey_greenstein(float g, float cosine) {
  // 1 + g^2 - 2 g cosine, which is never 0, without the cancellation.
  float k = abs(g);
  float d = (1.0f - k) * (1.0f - k) + 2.0f * max(0.0f, k - g * cosine);
  return CM_ISOTROPIC_PHASE * (1.0f - g * g) / (d * sqrt(d));
}

CM_FN float cm_draine(float g, float bend, float cosine) {
  return cm_henyey_greenstein(g, cosine) * (1.0f + bend * cosine * cosine) /
         (1.0f + bend * (1.0f + 2.0f * g * g) / 3.0f);
}

CM_FN float cm_phase(CmPhase phase, float cosine) {
  float first = cm_henyey_greenstein(phase.anisotropy, cosine);
  return mix(first, cm_draine(phase.second_anisotropy, phase.second_bend, cosine), phase.second_weight);
}

// Samples a cosine by inversion; its pdf is 2 pi times the phase function.
CM_FN float cm_henyey_greenstein_cosine(float g, float u) {
  if (abs(g) < 1e-3f) return 1.0f - 2.0f * u;
  float s = (1.0f - g * g) / (1.0f - g + 2.0f * g * u);
  return clamp((1.0f + g * g - s * s) / (2.0f * g), -1.0f, 1.0f);
}

// Cumulative distribution of Draine's lobe, up to a factor and a constant, as a function of v = 1 / sqrt(1 + g^2 - 2 g
// cosine). b: bend / (4 g^2); c: 1 + g^2. Its derivative is 1 + bend cosine^2.
CM_FN float cm_draine_below(float b, float c, float v) {
  float w = 1.0f / v;
  return (1.0f + b * c * c) * v + b * w * (2.0f * c - w * w / 3.0f);
}

// Samples Draine's lobe for g > 0.1, by Newton's method. On either side of cosine 0 it starts at the end where the
// function is steep, so that no step overshoots. For a bend of 30, eight steps are exact to 1e-6.
CM_FN float cm_draine_cosine(float g, float bend, float u) {
  float c = 1.0f + g * g;
  float b = bend / (4.0f * g * g);
  float back = 1.0f / (1.0f + g);
  float forth = 1.0f / (1.0f - g);
  float wanted = mix(cm_draine_below(b, c, back), cm_draine_below(b, c, forth), u);
  float v = wanted > cm_draine_below(b, c, 1.0f / sqrt(c)) ? forth : back;
  for (int i = 0; i < 8; ++i) {
    float twice = c - 1.0f / (v * v);  // 2 g cosine
    v -= (cm_draine_below(b, c, v) - wanted) / (1.0f + b * twice * twice);
  }
  return clamp((c - 1.0f / (v * v)) / (2.0f * g), -1.0f, 1.0f);
}

CM_FN float cm_phase_cosine(CmPhase phase, float u) {
  float first = 1.0f - phase.second_weight;
  if (u < first) return cm_henyey_greenstein_cosine(phase.anisotropy, u / first);
  u = (u - first) / phase.second_weight;
  if (phase.second_bend == 0.0f) return cm_henyey_greenstein_cosine(phase.second_anisotropy, u);
  return cm_draine_cosine(phase.second_anisotropy, phase.second_bend, u);
}

// Unit vector at this cosine and angle around the unit vector w.
CM_FN vec3 cm_around(vec3 w, float cosine, float angle) {
  vec3 u;
  vec3 v;
  cm_frame(w, u, v);
  float sine = sqrt(max(0.0f, 1.0f - cosine * cosine));
  return normalize(u * (sine * cos(angle)) + v * (sine * sin(angle)) + w * cosine);
}

#endif
