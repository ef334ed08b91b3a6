// Light from all directions by spherical harmonics of the first and second order, beside its mean: what a rasterised
// surface sees of sky or environment (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment
// Maps", SIGGRAPH 2001). Shared by GLSL and C++.
#ifndef CM_HARMONICS_GLSL
#define CM_HARMONICS_GLSL

// Colours: radiance towards a unit w, less the mean, is about the sum of each times its product of w's components.
struct CmHarmonics {
  vec4 x;
  vec4 y;
  vec4 z;
  vec4 xy;
  vec4 yz;
  vec4 zx;
  vec4 xx;  // x x - z z
  vec4 yy;  // y y - z z
};

// How much a lobe leaves of each order, where w is its middle: a cosine's over pi, and a GGX lobe's that is looked at from
// above (a fit within 0.03 of the integrals).
const vec2 CM_MATTE_ORDERS = vec2(0.66666667f, 0.25f);
CM_FN vec2 cm_gloss_orders(float alpha) {
  float square = alpha * alpha;
  return vec2(1.0f - 0.4f * square / (square + 0.08f), 1.0f - 0.86f * square / (square + 0.056f));
}

// The middle of a GGX lobe: from the mirror direction, of a smooth one, towards the normal n. After Lagarde and de
// Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014.
CM_FN vec3 cm_gloss_middle(vec3 n, vec3 wo, float roughness) {
  vec3 mirrored = n * (2.0f * dot(n, wo)) - wo;
  float smoothness = 1.0f - roughness;
  return normalize(mix(n, mirrored, smoothness * (sqrt(smoothness) + roughness)));
}

CM_FN vec3 cm_harmonics(CmHarmonics h, vec3 w, vec2 orders) {
  vec4 first = w.x * h.x + w.y * h.y + w.z * h.z;
  vec4 second = (w.x * w.y) * h.xy + (w.y * w.z) * h.yz + (w.z * w.x) * h.zx + (w.x * w.x - w.z * w.z) * h.xx +
                (w.y * w.y - w.z * w.z) * h.yy;
  return vec3(orders.x * first + orders.y * second);
}

#endif
