// GGX microfacets with Smith's height-correlated masking (Heitz, "Understanding the Masking-Shadowing Function in
// Microfacet-Based BRDFs", JCGT 3(2), 2014), and Schlick's Fresnel term. Shared by GLSL and C++.
#ifndef CM_GGX_GLSL
#define CM_GGX_GLSL

// 1 for the extended-material variant, which has more than reflecting lobes of one roughness: the extensions listed
// second in glsl/surface/bsdf.glsl, but for iridescence. 2 for all. They are variants, so that scenes without them do
// not pay for them. Thin films are half of the code of a kernel that has them.
#ifndef CM_EXTENDED_BSDF
#define CM_EXTENDED_BSDF 0
#endif

const float CM_INV_PI = 0.318309886f;

// Entries per side of the table of directional albedos made by src/surface/ggx_albedo.hpp.
const int CM_GGX_ALBEDO_SIZE = 32;

const float CM_MIN_ALPHA = 1e-3f;
CM_FN float cm_alpha(float roughness) { return max(roughness * roughness, CM_MIN_ALPHA); }

// (1 - cosine)^5
CM_FN float cm_schlick(float cosine) {
  float c = clamp(1.0f - cosine, 0.0f, 1.0f);
  float c2 = c * c;
  return c2 * c2 * c;
}

// The functions below take vectors in the frame of the normal: z is the cosine. Anisotropic lobes have their two widths
// along x and y, and alpha is a vector.
#if CM_EXTENDED_BSDF
#define CmAlpha vec2
CM_FN float cm_ggx_area(CmAlpha alpha) { return alpha.x * alpha.y; }
CM_FN float cm_shrunk_square(CmAlpha alpha, vec3 h) {
  vec2 shrunk = vec2(h.x, h.y) / alpha;
  return dot(shrunk, shrunk);
}
CM_FN float cm_stretched_square(CmAlpha alpha, vec3 w) {
  vec2 stretched = vec2(w.x, w.y) * alpha;
  return dot(stretched, stretched);
}
CM_FN vec3 cm_stretched(CmAlpha alpha, vec3 w, float z) { return vec3(alpha.x * w.x, alpha.y * w.y, z); }
#else
#define CmAlpha float
CM_FN float cm_ggx_area(CmAlpha alpha) { return alpha * alpha; }
CM_FN float cm_shrunk_square(CmAlpha alpha, vec3 h) { return (h.x * h.x + h.y * h.y) * (1.0f / (alpha * alpha)); }
CM_FN float cm_stretched_square(CmAlpha alpha, vec3 w) { return alpha * alpha * (w.x * w.x + w.y * w.y); }
CM_FN vec3 cm_stretched(CmAlpha alpha, vec3 w, float z) { return vec3(alpha * w.x, alpha * w.y, z); }
#endif

// GGX distribution of normals: 1 / (pi a_x a_y (x^2 / a_x^2 + y^2 / a_y^2 + z^2)^2), h unit.
CM_FN float cm_ggx_density(CmAlpha alpha, vec3 h) {
  float s = cm_shrunk_square(alpha, h) + h.z * h.z;
  return CM_INV_PI / (cm_ggx_area(alpha) * s * s);
}

// Smith's Lambda: (sqrt(1 + a^2 tan^2) - 1) / 2.
CM_FN float cm_ggx_lambda(CmAlpha alpha, vec3 w) {
  return 0.5f * sqrt(1.0f + cm_stretched_square(alpha, w) / (w.z * w.z)) - 0.5f;
}

// Samples a visible normal: Heitz, "Sampling the GGX Distribution of Visible Normals", JCGT 7(4), 2018; with u in [0,
// 1)^2.
CM_FN vec3 cm_ggx_visible_normal(CmAlpha alpha, vec3 wo, float u0, float u1) {
  vec3 stretched = normalize(cm_stretched(alpha, wo, wo.z));
  float length2 = stretched.x * stretched.x + stretched.y * stretched.y;
  vec3 t1 = length2 > 0.0f ? vec3(-stretched.y, stretched.x, 0.0f) * (1.0f / sqrt(length2)) : vec3(1.0f, 0.0f, 0.0f);
  vec3 t2 = cross(stretched, t1);
  float radius = sqrt(u0);
  float angle = 6.28318531f * u1;
  float p1 = radius * cos(angle);
  float blend = 0.5f * (1.0f + stretched.z);
  float p2 = (1.0f - blend) * sqrt(max(0.0f, 1.0f - p1 * p1)) + blend * radius * sin(angle);
  vec3 h = t1 * p1 + t2 * p2 + stretched * sqrt(max(0.0f, 1.0f - p1 * p1 - p2 * p2));
  return normalize(cm_stretched(alpha, h, max(h.z, 1e-6f)));
}

// Solid-angle pdf of wi, reflected at a visible normal: G1(wo) D(h) / (4 n.wo).
CM_FN float cm_ggx_pdf(CmAlpha alpha, vec3 wo, vec3 h) {
  return cm_ggx_density(alpha, h) / ((1.0f + cm_ggx_lambda(alpha, wo)) * 4.0f * wo.z);
}

// D G2 / (4 n.wo): a GGX lobe without its Fresnel term, times |cos|.
CM_FN float cm_ggx(CmAlpha alpha, vec3 wo, vec3 wi, vec3 h) {
  float g = 1.0f / (1.0f + cm_ggx_lambda(alpha, wo) + cm_ggx_lambda(alpha, wi));
  return cm_ggx_density(alpha, h) * g / (4.0f * wo.z);
}

// Table coordinates of an albedo, by cosine and roughness, from 0 to CM_GGX_ALBEDO_SIZE - 1. Grazing angles, where the
// albedo changes fast, have the highest resolution.
CM_FN vec2 cm_ggx_albedo_position(float roughness, float cosine) {
  return clamp(vec2(sqrt(max(cosine, 0.0f)), roughness), 0.0f, 1.0f) * float(CM_GGX_ALBEDO_SIZE - 1);
}

#endif
