// What a surface reflects: the metallic-roughness material of glTF 2.0 (appendix B) with KHR_materials_ior, _specular
// and _clearcoat. Shared by GLSL and C++; the includer has before this
//   vec2 cm_ggx_albedo(float roughness, float cosine)
//   vec2 cm_ggx_albedo_average(float roughness)
// of src/surface/ggx_albedo.hpp's table: a GGX lobe with a Fresnel term of f0 and f90 reflects f0 x + f90 y of constant
// radiance, towards a cosine and on average over all of them (weighed by the cosine).
//
// Three lobes: a GGX coat over a GGX base, and a Lambertian one under the base. Appendix B weighs the Lambertian lobe by
// 1 - F(v.h), which reflects up to 1.7 times the light that comes in at grazing angles. Here it is coupled to the base by
// what that reflects, E: (1 - E(n.v)) (1 - E(n.l)) / (1 - E_avg) (Kelemen and Szirmay-Kalos, "A Microfacet Based Coupled
// Specular-Matte BRDF Model with Importance Sampling", Eurographics 2001): as reciprocal, and a white dielectric of any
// roughness reflects exactly what comes in. The coat weighs the Lambertian lobe in the same way, by its own E; the base's
// own lobe, whose way in is mostly as steep as its way out, by the lesser of 1 - E(n.v) and 1 - E(n.l).
//
// The Lambertian lobe keeps the normal that is not bent: it mirrors nothing, and loses light at rims by a bent one. It
// ends softly where light sinks below the smooth surface under a normal map: see cm_terminator.
//
// wo and wi are unit vectors that point away from the surface, wo towards where the light goes. Nothing is transmitted.
#ifndef CM_BSDF_GLSL
#define CM_BSDF_GLSL
#include "frame.glsl"
#include "ggx.glsl"
#include "numbers.glsl"

struct CmSurface {
  vec3 base_color;            // linear, 0 to 1
  float metallic;             // 0 to 1
  float roughness;            // perceptual, 0 to 1: alpha = max(roughness^2, 1e-3)
  vec3 normal;                // of shading: unit, world, on wo's side
  vec3 matte_normal;          // what it would be if it were not bent, unit: the Lambertian lobe's
  vec3 smooth_normal;         // matte_normal without a normal map, unit
  vec3 f0;                    // reflectance of the dielectric at normal incidence, see cm_dielectric_f0
  float specular;             // its reflectance at grazing incidence
  float clearcoat;            // weight of the coat, of ior 1.5
  float clearcoat_roughness;  // as roughness
};

const float CM_COAT_F0 = 0.04f;

// f0 of an ior (0: infinite, as KHR_materials_ior has it) and KHR_materials_specular's weight and colour.
CM_FN vec3 cm_dielectric_f0(float ior, float specular, vec3 specular_color) {
  float r = ior > 0.0f ? (ior - 1.0f) / (ior + 1.0f) : 1.0f;
  return min(specular_color * (r * r), vec3(1.0f)) * specular;
}

CM_FN float cm_max3(vec3 v) { return max(v.x, max(v.y, v.z)); }

CM_FN float cm_coat_fresnel(CmSurface s, float cosine) {
  return s.clearcoat * (CM_COAT_F0 + (1.0f - CM_COAT_F0) * cm_schlick(cosine));
}

// What the dielectric's interface reflects, its largest channel.
CM_FN float cm_interface_fresnel(CmSurface s, float cosine) {
  float f0 = cm_max3(s.f0);
  return f0 + (s.specular - f0) * cm_schlick(cosine);
}

// What is left of constant radiance below the dielectric's interface, and below the coat, towards a cosine or by the
// average of the table.
CM_FN float cm_below_interface(CmSurface s, vec2 albedo) {
  return max(0.0f, 1.0f - cm_max3(s.f0) * albedo.x - s.specular * albedo.y);
}
CM_FN float cm_below_coat(CmSurface s, vec2 albedo) {
  return 1.0f - s.clearcoat * (CM_COAT_F0 * albedo.x + albedo.y);
}

// Of the base lobe: dielectric and metal are both linear in f0 and f90.
CM_FN vec3 cm_base_fresnel(CmSurface s, float cosine) {
  vec3 f0 = mix(s.f0, s.base_color, s.metallic);
  float f90 = mix(s.specular, 1.0f, s.metallic);
  return f0 + (vec3(f90) - f0) * cm_schlick(cosine);
}

// Reflected share of constant radiance by the Lambertian lobe alone, without the coat.
CM_FN vec3 cm_matte_albedo(CmSurface s, float cosine) {
  return s.base_color * ((1.0f - s.metallic) * cm_below_interface(s, cm_ggx_albedo(s.roughness, cosine)));
}

// Probabilities of choosing the coat (x), the base lobe (y) and the Lambertian one (z): roughly as they reflect.
CM_FN vec3 cm_lobe_weights(CmSurface s, float cosine) {
  float below = s.clearcoat > 0.0f ? cm_below_coat(s, cm_ggx_albedo(s.clearcoat_roughness, cosine)) : 1.0f;
  vec3 w = vec3(1.0f - below, below * cm_max3(cm_base_fresnel(s, cosine)), below * cm_max3(cm_matte_albedo(s, cosine)));
  float sum = w.x + w.y + w.z;
  return sum > 0.0f ? w * (1.0f / sum) : vec3(0.0f, 0.0f, 1.0f);
}

// The lobes' sum times |cos|; the Lambertian one, which sees wi at matte_cosine, weighed by `terminator`.
CM_FN vec3 cm_bsdf_eval_local(CmSurface s, float terminator, float matte_cosine, vec3 wo, vec3 wi) {
  if (!cm_is_positive(wo.z)) return vec3(0.0f);
  float cosine = 1.0f;
  vec3 h = vec3(0.0f);
  vec3 f = vec3(0.0f);
  bool above = wi.z > 0.0f;
  if (above) {
    h = normalize(wo + wi);
    cosine = dot(wo, h);
    f = cm_base_fresnel(s, cosine) * cm_ggx(cm_alpha(s.roughness), wo, wi, h);
  }
  vec3 matte = vec3(0.0f);
  if (s.metallic < 1.0f && matte_cosine > 0.0f) {
    float average = cm_below_interface(s, cm_ggx_albedo_average(s.roughness));
    float through = cm_below_interface(s, cm_ggx_albedo(s.roughness, matte_cosine)) / max(average, 1e-6f);
    matte = cm_matte_albedo(s, wo.z) * (terminator * through * matte_cosine * CM_INV_PI);
  }
  if (s.clearcoat > 0.0f) {
    float rough = s.clearcoat_roughness;
    float out_of = cm_below_coat(s, cm_ggx_albedo(rough, wo.z));
    float into = cm_below_coat(s, cm_ggx_albedo(rough, max(matte_cosine, 0.0f)));
    matte *= out_of * into / cm_below_coat(s, cm_ggx_albedo_average(rough));
    if (above) {
      f *= min(out_of, cm_below_coat(s, cm_ggx_albedo(rough, wi.z)));
      f += vec3(cm_coat_fresnel(s, cosine) * cm_ggx(cm_alpha(rough), wo, wi, h));
    }
  }
  return f + matte;
}

CM_FN float cm_bsdf_pdf_local(CmSurface s, float matte_cosine, vec3 wo, vec3 wi) {
  if (!cm_is_positive(wo.z)) return 0.0f;
  vec3 lobes = cm_lobe_weights(s, wo.z);
  float pdf = lobes.z * max(matte_cosine, 0.0f) * CM_INV_PI;
  // Lobes that mirror throw some of their samples below the surface, where the Lambertian one may still see them.
  vec3 h = normalize(wo + wi);
  if (!cm_is_positive(h.z)) return pdf;
  if (lobes.y > 0.0f) pdf += lobes.y * cm_ggx_pdf(cm_alpha(s.roughness), wo, h);
  if (lobes.x > 0.0f) pdf += lobes.x * cm_ggx_pdf(cm_alpha(s.clearcoat_roughness), wo, h);
  return pdf;
}

CM_FN vec3 cm_into_frame(vec3 u, vec3 v, vec3 n, vec3 w) { return vec3(dot(u, w), dot(v, w), dot(n, w)); }

// How much of the light from wi the Lambertian lobe gets: all of it where no map has turned the normal, none where wi is
// below the smooth surface, and between them less and less: Chiang, Li and Burley, "Taming the Shadow Terminator",
// SIGGRAPH Talks 2019. A mapped normal at c to the smooth one loses so, of constant radiance, 2 % (c = 0.999) to 14 %
// (0.9), 35 % (0.5) and at most (1 - c) / 2 with c <= 0: the shade that bumps throw on each other, as Cycles has it.
CM_FN float cm_terminator(CmSurface s, vec3 wi) {
  float c = dot(s.matte_normal, s.smooth_normal);
  float above = dot(s.smooth_normal, wi);
  if (c <= 0.0f) return above > 0.0f ? 1.0f : 0.0f;
  float t = clamp(above / max(dot(s.matte_normal, wi) * c, 1e-12f), 0.0f, 1.0f);
  return t * (1.0f + t * (1.0f - t));
}

// f |cos wi|: 0 where either is not above the surface. f is reciprocal where the normal is not mapped.
CM_FN vec3 cm_bsdf_eval(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  return cm_bsdf_eval_local(s, cm_terminator(s, wi), dot(s.matte_normal, wi), cm_into_frame(u, v, s.normal, wo),
                            cm_into_frame(u, v, s.normal, wi));
}

// Density of cm_bsdf_sample's wi by solid angle.
CM_FN float cm_bsdf_pdf(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  return cm_bsdf_pdf_local(s, dot(s.matte_normal, wi), cm_into_frame(u, v, s.normal, wo),
                           cm_into_frame(u, v, s.normal, wi));
}

// A direction for u in [0, 1)^3; u0 picks the lobe. May be below the surface: eval is 0 where it is for every lobe.
CM_FN vec3 cm_bsdf_sample(CmSurface s, vec3 wo, float u0, float u1, float u2) {
  vec3 u;
  vec3 v;
  cm_frame(s.normal, u, v);
  vec3 o = cm_into_frame(u, v, s.normal, wo);
  if (!cm_is_positive(o.z)) return s.normal;
  vec3 lobes = cm_lobe_weights(s, o.z);
  vec3 i;
  vec3 n = s.normal;
  if (u0 < lobes.x + lobes.y) {
    float alpha = cm_alpha(u0 < lobes.x ? s.clearcoat_roughness : s.roughness);
    vec3 h = cm_ggx_visible_normal(alpha, o, u1, u2);
    i = h * (2.0f * dot(o, h)) - o;
  } else {
    n = s.matte_normal;
    cm_frame(n, u, v);
    float radius = sqrt(u1);
    float angle = 6.28318531f * u2;
    i = vec3(radius * cos(angle), radius * sin(angle), sqrt(1.0f - u1));
  }
  return normalize(u * i.x + v * i.y + n * i.z);
}

// A shading normal for the lobes that mirror, bent as far as it must be for the viewer's mirror image to be above the surface, whose own normal is
// `geometric`, on the viewer's side: halfway to a mirror direction that is lifted to just above it.
CM_FN vec3 cm_bend_normal(vec3 normal, vec3 geometric, vec3 wo) {
  vec3 mirrored = normal * (2.0f * dot(normal, wo)) - wo;
  float height = dot(mirrored, geometric);
  float least = min(0.01f, 0.9f * dot(wo, geometric));
  if (height >= least) return normal;
  vec3 along = mirrored - geometric * height;
  float length2 = dot(along, along);
  float scale = sqrt(max(0.0f, 1.0f - least * least) / max(length2, 1e-12f));
  vec3 bent = wo + along * scale + geometric * least;
  float bent2 = dot(bent, bent);
  return bent2 > 1e-12f ? bent * (1.0f / sqrt(bent2)) : geometric;
}

// What a sky of constant radiance 1 comes back as, nothing in its way: the integral of cm_bsdf_eval over wi, by lobes.
struct CmAlbedos {
  vec3 base;
  vec3 coat;
  vec3 matte;
};

CM_FN CmAlbedos cm_bsdf_albedos(CmSurface s, vec3 wo) {
  float cosine = dot(s.normal, wo);  // as cm_bsdf_eval has it: drivers look it up once
  vec3 f0 = mix(s.f0, s.base_color, s.metallic);
  float f90 = mix(s.specular, 1.0f, s.metallic);
  vec2 base = cm_ggx_albedo(s.roughness, cosine);
  vec3 sum = f0 * base.x + vec3(f90 * base.y);
  vec3 matte = cm_matte_albedo(s, cosine);
  vec3 coated = vec3(0.0f);
  if (s.clearcoat > 0.0f) {
    vec2 coat = cm_ggx_albedo(s.clearcoat_roughness, cosine);
    float through = cm_below_coat(s, coat);
    float through_all = cm_below_coat(s, cm_ggx_albedo_average(s.clearcoat_roughness));
    sum *= mix(through, min(through, through_all), s.roughness);  // smooth: the way out is as steep as the way in
    matte *= through;
    coated = vec3(s.clearcoat * (CM_COAT_F0 * coat.x + coat.y));
  }
  return CmAlbedos(sum, coated, matte);
}

CM_FN vec3 cm_albedo_of(CmAlbedos albedos) { return albedos.base + albedos.coat + albedos.matte; }
CM_FN vec3 cm_bsdf_albedo(CmSurface s, vec3 wo) { return cm_albedo_of(cm_bsdf_albedos(s, wo)); }

#endif
