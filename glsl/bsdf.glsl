// What a surface reflects: the metallic-roughness material of glTF 2.0 (appendix B) with KHR_materials_ior, _specular
// and _clearcoat. Shared by GLSL and C++.
//
// Three lobes: a GGX coat over a GGX base (Smith, height-correlated; Heitz, "Understanding the Masking-Shadowing
// Function in Microfacet-Based BRDFs", JCGT 3(2), 2014), and a Lambertian one under the base. Fresnel is Schlick's.
// Appendix B weighs the Lambertian lobe by 1 - F(v.h), which reflects up to 1.7 times the light that comes in at
// grazing angles. Here it is T(n.v) T(n.l) / (1 - F_avg) with T = 1 - F (Kelemen and Szirmay-Kalos, "A Microfacet Based
// Coupled Specular-Matte BRDF Model with Importance Sampling", Eurographics 2001): as reciprocal, and a smooth white
// dielectric reflects exactly what comes in. The coat weighs what is under it by T(n.v) T(n.l).
//
// wo and wi are unit vectors that point away from the surface, wo towards where the light goes. Nothing is transmitted.
#ifndef CM_BSDF_GLSL
#define CM_BSDF_GLSL
#include "frame.glsl"

struct CmSurface {
  vec3 base_color;            // linear, 0 to 1
  float metallic;             // 0 to 1
  float roughness;            // perceptual, 0 to 1: alpha = max(roughness^2, 1e-3)
  vec3 normal;                // of shading: unit, world, on wo's side
  vec3 f0;                    // reflectance of the dielectric at normal incidence, see cm_dielectric_f0
  float specular;             // its reflectance at grazing incidence
  float clearcoat;            // weight of the coat, of ior 1.5
  float clearcoat_roughness;  // as roughness
};

const float CM_INV_PI = 0.318309886f;
const float CM_COAT_F0 = 0.04f;

// f0 of an ior (0: infinite, as KHR_materials_ior has it) and KHR_materials_specular's weight and colour.
CM_FN vec3 cm_dielectric_f0(float ior, float specular, vec3 specular_color) {
  float r = ior > 0.0f ? (ior - 1.0f) / (ior + 1.0f) : 1.0f;
  return min(specular_color * (r * r), vec3(1.0f)) * specular;
}

CM_FN float cm_alpha(float roughness) { return max(roughness * roughness, 1e-3f); }

CM_FN float cm_max3(vec3 v) { return max(v.x, max(v.y, v.z)); }

// (1 - cosine)^5
CM_FN float cm_schlick(float cosine) {
  float c = clamp(1.0f - cosine, 0.0f, 1.0f);
  float c2 = c * c;
  return c2 * c2 * c;
}

// The functions below take vectors in the frame of the normal: z is the cosine.

// GGX density of normals: 1 / (pi a^2 ((x^2 + y^2) / a^2 + z^2)^2), h unit.
CM_FN float cm_ggx_density(float alpha, vec3 h) {
  float inverse = 1.0f / (alpha * alpha);
  float s = (h.x * h.x + h.y * h.y) * inverse + h.z * h.z;
  return CM_INV_PI * inverse / (s * s);
}

// Smith's Lambda: (sqrt(1 + a^2 tan^2) - 1) / 2.
CM_FN float cm_ggx_lambda(float alpha, vec3 w) {
  float tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
  return 0.5f * sqrt(1.0f + alpha * alpha * tan2) - 0.5f;
}

// Visible normal: Heitz, "Sampling the GGX Distribution of Visible Normals", JCGT 7(4), 2018; with u in [0, 1)^2.
CM_FN vec3 cm_ggx_visible_normal(float alpha, vec3 wo, float u0, float u1) {
  vec3 stretched = normalize(vec3(alpha * wo.x, alpha * wo.y, wo.z));
  float length2 = stretched.x * stretched.x + stretched.y * stretched.y;
  vec3 t1 = length2 > 0.0f ? vec3(-stretched.y, stretched.x, 0.0f) * (1.0f / sqrt(length2)) : vec3(1.0f, 0.0f, 0.0f);
  vec3 t2 = cross(stretched, t1);
  float radius = sqrt(u0);
  float angle = 6.28318531f * u1;
  float p1 = radius * cos(angle);
  float blend = 0.5f * (1.0f + stretched.z);
  float p2 = (1.0f - blend) * sqrt(max(0.0f, 1.0f - p1 * p1)) + blend * radius * sin(angle);
  vec3 h = t1 * p1 + t2 * p2 + stretched * sqrt(max(0.0f, 1.0f - p1 * p1 - p2 * p2));
  return normalize(vec3(alpha * h.x, alpha * h.y, max(h.z, 1e-6f)));
}

// Density of wi, reflected at a visible normal: G1(wo) D(h) / (4 n.wo).
CM_FN float cm_ggx_pdf(float alpha, vec3 wo, vec3 h) {
  return cm_ggx_density(alpha, h) / ((1.0f + cm_ggx_lambda(alpha, wo)) * 4.0f * wo.z);
}

// D G2 / (4 n.wo): a GGX lobe without its Fresnel term, times |cos|.
CM_FN float cm_ggx(float alpha, vec3 wo, vec3 wi, vec3 h) {
  float g = 1.0f / (1.0f + cm_ggx_lambda(alpha, wo) + cm_ggx_lambda(alpha, wi));
  return cm_ggx_density(alpha, h) * g / (4.0f * wo.z);
}

CM_FN float cm_coat_fresnel(CmSurface s, float cosine) {
  return s.clearcoat * (CM_COAT_F0 + (1.0f - CM_COAT_F0) * cm_schlick(cosine));
}

// What the dielectric's interface reflects, its largest channel.
CM_FN float cm_interface_fresnel(CmSurface s, float cosine) {
  float f0 = cm_max3(s.f0);
  return f0 + (s.specular - f0) * cm_schlick(cosine);
}

// Of the base lobe: dielectric and metal are both linear in f0 and f90.
CM_FN vec3 cm_base_fresnel(CmSurface s, float cosine) {
  vec3 f0 = mix(s.f0, s.base_color, s.metallic);
  float f90 = mix(s.specular, 1.0f, s.metallic);
  return f0 + (vec3(f90) - f0) * cm_schlick(cosine);
}

// Reflected share of constant radiance by the Lambertian lobe alone, without the coat.
CM_FN vec3 cm_matte_albedo(CmSurface s, float cosine) {
  return s.base_color * ((1.0f - s.metallic) * (1.0f - cm_interface_fresnel(s, cosine)));
}

// Probabilities of choosing the coat (x), the base lobe (y) and the Lambertian one (z): roughly as they reflect.
CM_FN vec3 cm_lobe_weights(CmSurface s, float cosine) {
  float coat = cm_coat_fresnel(s, cosine);
  vec3 w = vec3(coat, (1.0f - coat) * cm_max3(cm_base_fresnel(s, cosine)),
                (1.0f - coat) * cm_max3(cm_matte_albedo(s, cosine)));
  float sum = w.x + w.y + w.z;
  return sum > 0.0f ? w * (1.0f / sum) : vec3(0.0f, 0.0f, 1.0f);
}

CM_FN vec3 cm_bsdf_eval_local(CmSurface s, vec3 wo, vec3 wi) {
  if (!(wo.z > 0.0f) || !(wi.z > 0.0f)) return vec3(0.0f);
  vec3 h = normalize(wo + wi);
  float cosine = dot(wo, h);
  vec3 f = cm_base_fresnel(s, cosine) * cm_ggx(cm_alpha(s.roughness), wo, wi, h);
  if (s.metallic < 1.0f) {
    float f0 = cm_max3(s.f0);
    float average = f0 + (s.specular - f0) * (1.0f / 21.0f);
    float through = (1.0f - cm_interface_fresnel(s, wi.z)) / max(1.0f - average, 1e-6f);
    f += cm_matte_albedo(s, wo.z) * (through * wi.z * CM_INV_PI);
  }
  if (s.clearcoat > 0.0f) {
    f *= (1.0f - cm_coat_fresnel(s, wo.z)) * (1.0f - cm_coat_fresnel(s, wi.z));
    f += vec3(cm_coat_fresnel(s, cosine) * cm_ggx(cm_alpha(s.clearcoat_roughness), wo, wi, h));
  }
  return f;
}

CM_FN float cm_bsdf_pdf_local(CmSurface s, vec3 wo, vec3 wi) {
  if (!(wo.z > 0.0f) || !(wi.z > 0.0f)) return 0.0f;
  vec3 h = normalize(wo + wi);
  vec3 lobes = cm_lobe_weights(s, wo.z);
  float pdf = lobes.z * wi.z * CM_INV_PI;
  if (lobes.y > 0.0f) pdf += lobes.y * cm_ggx_pdf(cm_alpha(s.roughness), wo, h);
  if (lobes.x > 0.0f) pdf += lobes.x * cm_ggx_pdf(cm_alpha(s.clearcoat_roughness), wo, h);
  return pdf;
}

CM_FN vec3 cm_into_frame(vec3 u, vec3 v, vec3 n, vec3 w) { return vec3(dot(u, w), dot(v, w), dot(n, w)); }

// f |cos wi|: 0 where either is not above the surface. f is reciprocal.
CM_FN vec3 cm_bsdf_eval(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  return cm_bsdf_eval_local(s, cm_into_frame(u, v, s.normal, wo), cm_into_frame(u, v, s.normal, wi));
}

// Density of cm_bsdf_sample's wi by solid angle. Integrates to 1 less the share of samples that fail.
CM_FN float cm_bsdf_pdf(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  return cm_bsdf_pdf_local(s, cm_into_frame(u, v, s.normal, wo), cm_into_frame(u, v, s.normal, wi));
}

// A direction for u in [0, 1)^3; u0 picks the lobe. May be below the surface, where eval is 0.
CM_FN vec3 cm_bsdf_sample(CmSurface s, vec3 wo, float u0, float u1, float u2) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  vec3 o = cm_into_frame(u, v, s.normal, wo);
  if (!(o.z > 0.0f)) return s.normal;
  vec3 lobes = cm_lobe_weights(s, o.z);
  vec3 i;
  if (u0 < lobes.x + lobes.y) {
    float alpha = cm_alpha(u0 < lobes.x ? s.clearcoat_roughness : s.roughness);
    vec3 h = cm_ggx_visible_normal(alpha, o, u1, u2);
    i = h * (2.0f * dot(o, h)) - o;
  } else {
    float radius = sqrt(u1);
    float angle = 6.28318531f * u2;
    i = vec3(radius * cos(angle), radius * sin(angle), sqrt(1.0f - u1));
  }
  return normalize(u * i.x + v * i.y + s.normal * i.z);
}

// A shading normal, bent towards the viewer as far as it must be for the surface to be seen from its front.
CM_FN vec3 cm_bend_normal(vec3 normal, vec3 wo) {
  float cosine = dot(normal, wo);
  return cosine >= 1e-3f ? normal : normalize(normal + wo * (1e-3f - cosine));
}

// What a sky of constant radiance 1 comes back as, nothing in its way: the integral of cm_bsdf_eval over wi. base and
// coat: the shares that the two GGX lobes reflect, f0 x + f90 y (Karis, "Real Shading in Unreal Engine 4", SIGGRAPH 2013;
// surface/ggx_albedo.hpp has the table).
CM_FN vec3 cm_bsdf_albedo(CmSurface s, vec3 wo, vec2 base, vec2 coat) {
  float cosine = clamp(dot(s.normal, wo), 0.0f, 1.0f);
  vec3 f0 = mix(s.f0, s.base_color, s.metallic);
  float f90 = mix(s.specular, 1.0f, s.metallic);
  vec3 sum = f0 * base.x + vec3(f90 * base.y);
  vec3 matte = cm_matte_albedo(s, cosine);
  if (s.clearcoat > 0.0f) {
    float through = 1.0f - cm_coat_fresnel(s, cosine);
    float through_all = 1.0f - s.clearcoat * (CM_COAT_F0 + (1.0f - CM_COAT_F0) * (1.0f / 21.0f));
    sum *= through * mix(through, through_all, s.roughness);  // smooth: the way out is as steep as the way in
    matte *= through * through_all;
    sum += vec3(s.clearcoat * (CM_COAT_F0 * coat.x + coat.y));
  }
  return sum + matte;
}

#endif
