// The BSDF: the metallic-roughness material of glTF 2.0 (appendix B) with KHR_materials_ior, _specular and _clearcoat.
// With CM_EXTENDED_BSDF also _transmission, _volume, _dispersion, _sheen and _anisotropy, with 2 also _iridescence
// (glsl/surface/film.glsl, glsl/surface/sheen.glsl). Shared by GLSL and C++. The includer provides before this
//   vec2 cm_ggx_albedo(float roughness, float cosine)
//   vec2 cm_ggx_albedo_average(float roughness)
// which look up the table of src/surface/ggx_albedo.hpp: a GGX lobe with a Fresnel term of f0 and f90 reflects f0 x +
// f90 y of constant radiance, towards a cosine and as a cosine-weighted average. With CM_EXTENDED_BSDF also
//   float cm_sheen_albedo(float roughness, float cosine)
//   float cm_sheen_albedo_average(float roughness)
// which look up the table of src/surface/sheen_albedo.hpp.
//
// There are three lobes: a GGX coat over a GGX base, and a Lambertian lobe under the base. Appendix B weights the
// Lambertian lobe by 1 - F(v.h), which reflects up to 1.7 times the incident light at grazing angles. Here it is
// coupled to the albedo E of the base: (1 - E(n.v)) (1 - E(n.l)) / (1 - E_avg) (Kelemen and Szirmay-Kalos, "A
// Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling", Eurographics 2001). This is also
// reciprocal, and a white dielectric of any roughness reflects exactly the incident light. The coat attenuates the
// Lambertian lobe in the same way, by its own E. It attenuates the base lobe by the minimum of 1 - E(n.v) and 1 -
// E(n.l), because that lobe mostly leaves as steeply as it enters.
//
// The Lambertian lobe keeps the normal that is not bent: it has no mirror direction, and a bent normal would darken it
// at silhouettes. Under a normal map it fades out where light sinks below the smooth surface: see cm_terminator.
//
// wo and wi are unit vectors that point away from the surface; light leaves along wo.
//
// Transmission replaces the Lambertian lobe for the light that passes the interface of the non-metallic part. A thin
// wall has the shape of the base lobe on its other side. At the minimum roughness it lets light pass straight on, which
// is no lobe: cm_bsdf_passes. A volume boundary refracts by the same microfacets (Walter, Marschner, Li and Torrance,
// "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007). Radiance is counted divided by the square of
// the index, so it is unchanged where light enters and leaves again. Energy lost between microfacets is not restored:
// of constant radiance at most 0.04 at a roughness of 0.2, 0.21 at 0.5 and 0.7 at 1 (rich_bsdf_test).
#ifndef CM_BSDF_GLSL
#define CM_BSDF_GLSL
#include "common/frame.glsl"
#include "surface/ggx.glsl"
#include "common/numbers.glsl"
#if CM_EXTENDED_BSDF
#include "surface/film.glsl"
#include "surface/sheen.glsl"
#endif

struct CmSurface {
  vec3 base_color;            // linear, 0 to 1
  float metallic;             // 0 to 1
  float roughness;            // perceptual, 0 to 1: alpha = max(roughness^2, 1e-3)
  vec3 normal;                // shading normal: unit, world, on wo's side
  vec3 matte_normal;          // the same before bending, unit: for the Lambertian lobe
  vec3 smooth_normal;         // matte_normal without a normal map, unit
  vec3 f0;                    // reflectance of the dielectric at normal incidence, see cm_dielectric_f0
  float specular;             // reflectance of the dielectric at grazing incidence
  float clearcoat;            // weight of the coat, of ior 1.5
  float clearcoat_roughness;  // like roughness
#if CM_EXTENDED_BSDF
  vec3 geometric;         // triangle normal, unit, on wo's side: transmitted light is behind it
  vec3 tangent;           // unit, perpendicular to the normal: direction of alpha.x
  CmAlpha alpha;          // of the base lobe; roughness corresponds to their mean
  vec3 sheen;             // linear, 0 to 1
  float sheen_roughness;  // like roughness
  CmFilm film;
  float film_average;     // see cm_film_average
  float transmission;     // 0 to 1
  float eta;              // index of refraction behind the surface over that in front; 0: a thin wall
#endif
};

const float CM_COAT_F0 = 0.04f;

// f0 for an index of refraction (0: infinite, as in KHR_materials_ior) and KHR_materials_specular's weight and color.
CM_FN vec3 cm_dielectric_f0(float ior, float specular, vec3 specular_color) {
  float r = ior > 0.0f ? (ior - 1.0f) / (ior + 1.0f) : 1.0f;
  return min(specular_color * (r * r), vec3(1.0f)) * specular;
}

CM_FN float cm_max3(vec3 v) { return max(v.x, max(v.y, v.z)); }

CM_FN float cm_coat_fresnel(CmSurface s, float cosine) {
  return s.clearcoat * (CM_COAT_F0 + (1.0f - CM_COAT_F0) * cm_schlick(cosine));
}

// Largest channel of the dielectric interface's reflectance.
CM_FN float cm_interface_fresnel(CmSurface s, float cosine) {
  float f0 = cm_max3(s.f0);
  return f0 + (s.specular - f0) * cm_schlick(cosine);
}

#if CM_EXTENDED_BSDF

CM_FN void cm_surface_frame(CmSurface s, CM_OUT(vec3) u, CM_OUT(vec3) v) {
  u = s.tangent;
  v = cross(s.normal, u);
}

CM_FN CmAlpha cm_base_alpha(CmSurface s) { return s.alpha; }
CM_FN CmAlpha cm_coat_alpha(CmSurface s) { return vec2(cm_alpha(s.clearcoat_roughness)); }

// Fresnel reflectance of an interface with these parameters. If wo is on the denser side, uses the cosine on the other
// side; total internal reflection gives 1.
CM_FN vec3 cm_interface_fresnel_of(CmSurface s, vec3 f0, float f90, float cosine) {
  if (s.eta > 0.0f && s.eta < 1.0f) {
    float sine2 = (1.0f - cosine * cosine) / (s.eta * s.eta);
    if (sine2 >= 1.0f) return vec3(1.0f);
    cosine = sqrt(1.0f - sine2);
  }
  vec3 f = f0 + (vec3(f90) - f0) * cm_schlick(cosine);
#if CM_EXTENDED_BSDF > 1
  float film = cm_film_share(s.film);
  if (film > 0.0f) f = mix(f, cm_film_fresnel(s.film, f0, cosine), film);
#endif
  return f;
}
CM_FN vec3 cm_base_fresnel(CmSurface s, float cosine) {
  return cm_interface_fresnel_of(s, mix(s.f0, s.base_color, s.metallic), mix(s.specular, 1.0f, s.metallic), cosine);
}
CM_FN float cm_dielectric_fresnel(CmSurface s, float cosine) {
  return cm_max3(cm_interface_fresnel_of(s, s.f0, s.specular, cosine));
}

// Reflectance added by a thin film on the dielectric interface, towards a cosine and on average.
CM_FN float cm_film_adds(CmSurface s, float cosine) {
#if CM_EXTENDED_BSDF > 1
  if (!(s.film.weight > 0.0f)) return 0.0f;
  float f0 = cm_max3(s.f0);
  return cm_dielectric_fresnel(s, cosine) - (f0 + (s.specular - f0) * cm_schlick(cosine));
#else
  return 0.0f;
#endif
}
CM_FN float cm_film_average(CmSurface s) {
  // Gauss-Legendre quadrature over the squared cosine.
  float sum = 8.0f * cm_film_adds(s, 0.70710678f);
  sum += 5.0f * (cm_film_adds(s, 0.33571049f) + cm_film_adds(s, 0.94196513f));
  return sum * (1.0f / 18.0f);
}

// Fraction of constant radiance that passes the dielectric interface, towards a cosine and on average, and that passes
// the sheen. The part added by a film is computed as if the lobe were narrow.
CM_FN float cm_below_interface_of(CmSurface s, vec2 albedo, float film) {
  float reflected = cm_max3(s.f0) * albedo.x + s.specular * albedo.y;
  return clamp(1.0f - reflected - film * (albedo.x + albedo.y), 0.0f, 1.0f);
}
CM_FN float cm_below_interface(CmSurface s, float cosine) {
  return cm_below_interface_of(s, cm_ggx_albedo(s.roughness, cosine), cm_film_adds(s, cosine));
}
CM_FN float cm_below_interface_average(CmSurface s) {
  return cm_below_interface_of(s, cm_ggx_albedo_average(s.roughness), s.film_average);
}
CM_FN float cm_below_sheen(CmSurface s, float albedo) { return max(0.0f, 1.0f - cm_max3(s.sheen) * albedo); }
CM_FN float cm_below_sheen_towards(CmSurface s, float cosine) {
  return cm_max3(s.sheen) > 0.0f ? cm_below_sheen(s, cm_sheen_albedo(s.sheen_roughness, cosine)) : 1.0f;
}

#else

CM_FN void cm_surface_frame(CmSurface s, CM_OUT(vec3) u, CM_OUT(vec3) v) { cm_frame(s.normal, u, v); }

CM_FN CmAlpha cm_base_alpha(CmSurface s) { return cm_alpha(s.roughness); }
CM_FN CmAlpha cm_coat_alpha(CmSurface s) { return cm_alpha(s.clearcoat_roughness); }

// Fresnel term of the base lobe: dielectric and metal are both linear in f0 and f90.
CM_FN vec3 cm_base_fresnel(CmSurface s, float cosine) {
  vec3 f0 = mix(s.f0, s.base_color, s.metallic);
  float f90 = mix(s.specular, 1.0f, s.metallic);
  return f0 + (vec3(f90) - f0) * cm_schlick(cosine);
}

// Fraction of constant radiance that passes the dielectric interface, towards a cosine and on average, and that passes
// the coat.
CM_FN float cm_below_interface_of(CmSurface s, vec2 albedo) {
  return max(0.0f, 1.0f - cm_max3(s.f0) * albedo.x - s.specular * albedo.y);
}
CM_FN float cm_below_interface(CmSurface s, float cosine) {
  return cm_below_interface_of(s, cm_ggx_albedo(s.roughness, cosine));
}
CM_FN float cm_below_interface_average(CmSurface s) {
  return cm_below_interface_of(s, cm_ggx_albedo_average(s.roughness));
}

#endif

CM_FN float cm_below_coat(CmSurface s, vec2 albedo) {
  return 1.0f - s.clearcoat * (CM_COAT_F0 * albedo.x + albedo.y);
}
CM_FN float cm_below_coat_towards(CmSurface s, float cosine) {
  return s.clearcoat > 0.0f ? cm_below_coat(s, cm_ggx_albedo(s.clearcoat_roughness, cosine)) : 1.0f;
}

// Albedo of only the Lambertian lobe under constant radiance, without the coat.
CM_FN vec3 cm_matte_albedo(CmSurface s, float cosine) {
  float share = (1.0f - s.metallic) * cm_below_interface(s, cosine);
#if CM_EXTENDED_BSDF
  share *= 1.0f - s.transmission;
#endif
  return s.base_color * share;
}

#if CM_EXTENDED_BSDF

// Color of the transmitted part of the light that passes the interface.
CM_FN vec3 cm_transmitted(CmSurface s) { return s.base_color * (s.transmission * (1.0f - s.metallic)); }

// Returns true if transmission goes straight on and is no lobe: cm_bsdf_passes.
CM_FN bool cm_is_clear(CmSurface s) { return s.eta == 0.0f && max(s.alpha.x, s.alpha.y) <= 1.001f * CM_MIN_ALPHA; }

// Fraction of light that passes straight on. Paths do so with the largest channel as probability. Paths that do not are
// shaded with the lobes, weighted by cm_surface_point's `kept`.
CM_FN vec3 cm_bsdf_passes(CmSurface s, vec3 wo) {
  if (!(s.transmission > 0.0f) || !cm_is_clear(s)) return vec3(0.0f);
  float cosine = clamp(dot(s.normal, wo), 0.0f, 1.0f);
  float below = cm_below_coat_towards(s, cosine) * cm_below_sheen_towards(s, cosine);
  return min(cm_transmitted(s) * (below * (1.0f - cm_dielectric_fresnel(s, cosine))), vec3(1.0f));
}

// Probability that a microfacet seen by wo at this cosine reflects rather than transmits.
CM_FN float cm_reflects(CmSurface s, float cosine) {
  if (!(s.transmission > 0.0f) || cm_is_clear(s)) return 1.0f;
  float through = cm_max3(cm_transmitted(s)) * (1.0f - cm_dielectric_fresnel(s, cosine));
  if (!(through > 0.0f)) return 1.0f;
  return cm_max3(cm_base_fresnel(s, cosine)) / (cm_max3(cm_base_fresnel(s, cosine)) + through);
}

// Half vector h that refracts wi to wo. Returns false if there is none.
CM_FN bool cm_refracting(CmSurface s, vec3 wo, vec3 wi, CM_OUT(vec3) h) {
  h = wo + wi * s.eta;
  float length2 = dot(h, h);
  if (!(length2 > 1e-20f)) return false;
  h *= (h.z < 0.0f ? -1.0f : 1.0f) * inversesqrt(length2);
  return h.z > 1e-6f && dot(wo, h) > 0.0f && dot(wi, h) < 0.0f;
}

// The Jacobian |dh / dwi| of refraction.
CM_FN float cm_refraction_jacobian(CmSurface s, vec3 wo, vec3 wi, vec3 h) {
  float sum = dot(wo, h) + s.eta * dot(wi, h);
  return s.eta * s.eta * abs(dot(wi, h)) / max(sum * sum, 1e-20f);
}

// Direction refracted at a microfacet; wo itself in case of total internal reflection.
CM_FN vec3 cm_refracted(CmSurface s, vec3 wo, vec3 h) {
  float cosine = dot(wo, h);
  float sine2 = (1.0f - cosine * cosine) / (s.eta * s.eta);
  if (sine2 >= 1.0f) return wo;
  return normalize(h * (cosine / s.eta - sqrt(1.0f - sine2)) - wo * (1.0f / s.eta));
}

// The transmission lobe times |cos|.
CM_FN vec3 cm_through_eval(CmSurface s, vec3 wo, vec3 wi) {
  if (!(wi.z < 0.0f) || !(s.transmission > 0.0f) || cm_is_clear(s)) return vec3(0.0f);
  float below = cm_below_coat_towards(s, wo.z) * cm_below_sheen_towards(s, wo.z);
  vec3 mirrored = vec3(wi.x, wi.y, -wi.z);
  vec3 h = normalize(wo + mirrored);
  float lobe = 0.0f;
  if (s.eta == 0.0f) {
    lobe = cm_ggx(s.alpha, wo, mirrored, h);
  } else if (cm_refracting(s, wo, wi, h)) {
    lobe = cm_ggx(s.alpha, wo, mirrored, h) * 4.0f * dot(wo, h) * cm_refraction_jacobian(s, wo, wi, h);
  }
  return lobe > 0.0f ? cm_transmitted(s) * (below * lobe * (1.0f - cm_dielectric_fresnel(s, dot(wo, h)))) : vec3(0.0f);
}

// Solid-angle pdf of directions transmitted by the base lobe's microfacets.
CM_FN float cm_through_pdf(CmSurface s, vec3 wo, vec3 wi) {
  if (!(s.transmission > 0.0f)) return 0.0f;
  vec3 h = wo + vec3(wi.x, wi.y, -wi.z);
  float jacobian = 0.0f;
  if (s.eta == 0.0f) {
    float length2 = dot(h, h);
    h *= inversesqrt(max(length2, 1e-20f));
    jacobian = cm_is_positive(h.z) ? 1.0f : 0.0f;
  } else if (cm_refracting(s, wo, wi, h)) {
    jacobian = 4.0f * dot(wo, h) * cm_refraction_jacobian(s, wo, wi, h);
  }
  return jacobian > 0.0f ? jacobian * cm_ggx_pdf(s.alpha, wo, h) * (1.0f - cm_reflects(s, dot(wo, h))) : 0.0f;
}

#endif

// Selection probabilities of the coat (x), the base lobe with its transmission (y), the Lambertian lobe (z) and the
// sheen (w), roughly in proportion to their albedo.
CM_FN vec4 cm_lobe_weights(CmSurface s, float cosine) {
  float below = cm_below_coat_towards(s, cosine);
  float sheen = 0.0f;
#if CM_EXTENDED_BSDF
  float coat = below;
  below *= cm_below_sheen_towards(s, cosine);
  sheen = coat - below;
  vec4 w = vec4(1.0f - coat, 0.0f, 0.0f, sheen);
  w.y = cm_max3(cm_base_fresnel(s, cosine));
  if (!cm_is_clear(s)) w.y += cm_max3(cm_transmitted(s)) * (1.0f - cm_dielectric_fresnel(s, cosine));
  w.y *= below;
  w.z = below * cm_max3(cm_matte_albedo(s, cosine));
#else
  vec4 w = vec4(1.0f - below, below * cm_max3(cm_base_fresnel(s, cosine)),
                below * cm_max3(cm_matte_albedo(s, cosine)), sheen);
#endif
  float sum = w.x + w.y + w.z + w.w;
  return sum > 0.0f ? w * (1.0f / sum) : vec4(0.0f, 0.0f, 1.0f, 0.0f);
}

// Sum of the reflection lobes times |cos|. The Lambertian lobe has wi at matte_cosine and is multiplied by
// `terminator`.
CM_FN vec3 cm_bsdf_eval_local(CmSurface s, float terminator, float matte_cosine, vec3 wo, vec3 wi) {
  if (!cm_is_positive(wo.z)) return vec3(0.0f);
  float cosine = 1.0f;
  vec3 h = vec3(0.0f);
  vec3 f = vec3(0.0f);
  bool above = wi.z > 0.0f;
  if (above) {
    h = normalize(wo + wi);
    cosine = dot(wo, h);
    f = cm_base_fresnel(s, cosine) * cm_ggx(cm_base_alpha(s), wo, wi, h);
  }
  vec3 matte = vec3(0.0f);
  if (s.metallic < 1.0f && matte_cosine > 0.0f) {
    float average = cm_below_interface_average(s);
    float through = cm_below_interface(s, matte_cosine) / max(average, 1e-6f);
    matte = cm_matte_albedo(s, wo.z) * (terminator * through * matte_cosine * CM_INV_PI);
  }
#if CM_EXTENDED_BSDF
  if (cm_max3(s.sheen) > 0.0f) {
    float rough = s.sheen_roughness;
    float out_of = cm_below_sheen_towards(s, wo.z);
    float into = cm_below_sheen_towards(s, max(matte_cosine, 0.0f));
    matte *= out_of * into / max(cm_below_sheen(s, cm_sheen_albedo_average(rough)), 1e-6f);
    if (above) {
      f *= min(out_of, cm_below_sheen_towards(s, wi.z));
      f += s.sheen * cm_sheen(rough, wo, wi, h);
    }
  }
#endif
  if (s.clearcoat > 0.0f) {
    float rough = s.clearcoat_roughness;
    float out_of = cm_below_coat_towards(s, wo.z);
    float into = cm_below_coat_towards(s, max(matte_cosine, 0.0f));
    matte *= out_of * into / cm_below_coat(s, cm_ggx_albedo_average(rough));
    if (above) {
      f *= min(out_of, cm_below_coat_towards(s, wi.z));
      f += vec3(cm_coat_fresnel(s, cosine) * cm_ggx(cm_coat_alpha(s), wo, wi, h));
    }
  }
  return f + matte;
}

CM_FN float cm_bsdf_pdf_local(CmSurface s, float matte_cosine, vec3 wo, vec3 wi) {
  if (!cm_is_positive(wo.z)) return 0.0f;
  vec4 lobes = cm_lobe_weights(s, wo.z);
  float pdf = lobes.z * max(matte_cosine, 0.0f) * CM_INV_PI;
#if CM_EXTENDED_BSDF
  if (wi.z > 0.0f) pdf += lobes.w * CM_SHEEN_PDF;
  if (lobes.y > 0.0f) pdf += lobes.y * cm_through_pdf(s, wo, wi);
#endif
  // Specular lobes send some samples below the surface, where the Lambertian lobe may still receive light.
  vec3 h = normalize(wo + wi);
  if (!cm_is_positive(h.z)) return pdf;
  float base = lobes.y;
#if CM_EXTENDED_BSDF
  base *= cm_reflects(s, dot(wo, h));
#endif
  if (base > 0.0f) pdf += base * cm_ggx_pdf(cm_base_alpha(s), wo, h);
  if (lobes.x > 0.0f) pdf += lobes.x * cm_ggx_pdf(cm_coat_alpha(s), wo, h);
  return pdf;
}

CM_FN vec3 cm_into_frame(vec3 u, vec3 v, vec3 n, vec3 w) { return vec3(dot(u, w), dot(v, w), dot(n, w)); }

// Fraction of the light from wi that the Lambertian lobe gets: 1 without a normal map, 0 where wi is below the smooth
// surface, and a smooth transition in between (Chiang, Li and Burley, "Taming the Shadow Terminator", SIGGRAPH Talks
// 2019). With cosine c between mapped and smooth normal, it removes 2 % (c = 0.999), 14 % (0.9) or 35 % (0.5) of
// constant radiance, and at most (1 - c) / 2 with c <= 0. This is the shadowing between bumps, as in Cycles.
CM_FN float cm_terminator(CmSurface s, vec3 wi) {
  float c = dot(s.matte_normal, s.smooth_normal);
  float above = dot(s.smooth_normal, wi);
  if (c <= 0.0f) return above > 0.0f ? 1.0f : 0.0f;
  float t = clamp(above / max(dot(s.matte_normal, wi) * c, 1e-12f), 0.0f, 1.0f);
  return t * (1.0f + t * (1.0f - t));
}

// f |cos wi|. 0 where wo or wi is below the surface, except for transmission. f is reciprocal without a normal map; for
// transmission, f over the square of the index on wi's side is.
CM_FN vec3 cm_bsdf_eval(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_surface_frame(s, u, v);
  vec3 o = cm_into_frame(u, v, s.normal, wo);
  vec3 i = cm_into_frame(u, v, s.normal, wi);
#if CM_EXTENDED_BSDF
  if (s.transmission > 0.0f && dot(s.geometric, wi) < 0.0f) return cm_is_positive(o.z) ? cm_through_eval(s, o, i) : vec3(0.0f);
#endif
  return cm_bsdf_eval_local(s, cm_terminator(s, wi), dot(s.matte_normal, wi), o, i);
}

// Solid-angle pdf of cm_bsdf_sample.
CM_FN float cm_bsdf_pdf(CmSurface s, vec3 wo, vec3 wi) {
  vec3 u;
  vec3 v;
  cm_surface_frame(s, u, v);
  return cm_bsdf_pdf_local(s, dot(s.matte_normal, wi), cm_into_frame(u, v, s.normal, wo),
                           cm_into_frame(u, v, s.normal, wi));
}

// Samples a direction with u in [0, 1)^3; u0 picks the lobe. The result may lie outside all lobes, where eval is 0.
CM_FN vec3 cm_bsdf_sample(CmSurface s, vec3 wo, float u0, float u1, float u2) {
  vec3 u;
  vec3 v;
  cm_surface_frame(s, u, v);
  vec3 o = cm_into_frame(u, v, s.normal, wo);
  if (!cm_is_positive(o.z)) return s.normal;
  vec4 lobes = cm_lobe_weights(s, o.z);
  vec3 i;
  vec3 n = s.normal;
  if (u0 < lobes.x + lobes.y) {
    CmAlpha alpha = cm_base_alpha(s);
    if (u0 < lobes.x) alpha = cm_coat_alpha(s);
    vec3 h = cm_ggx_visible_normal(alpha, o, u1, u2);
    i = h * (2.0f * dot(o, h)) - o;
#if CM_EXTENDED_BSDF
    if (u0 >= lobes.x && u0 - lobes.x >= lobes.y * cm_reflects(s, dot(o, h))) {
      i = s.eta == 0.0f ? vec3(i.x, i.y, -i.z) : cm_refracted(s, o, h);
    }
  } else if (u0 >= 1.0f - lobes.w) {
    i = cm_sheen_direction(u1, u2);
#endif
  } else {
    n = s.matte_normal;
    cm_frame(n, u, v);
    float radius = sqrt(u1);
    float angle = 6.28318531f * u2;
    i = vec3(radius * cos(angle), radius * sin(angle), sqrt(1.0f - u1));
  }
  return normalize(u * i.x + v * i.y + n * i.z);
}

// Bends a shading normal for the specular lobes just so far that wo's mirror direction is above the surface. geometric:
// the surface's own normal, on wo's side. The result is halfway to a mirror direction raised to slightly above the
// surface.
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

#if !CM_EXTENDED_BSDF

// Albedo of each lobe under a sky of constant radiance 1 without occlusion: the integral of cm_bsdf_eval over wi.
struct CmAlbedos {
  vec3 base;
  vec3 coat;
  vec3 matte;
};

CM_FN CmAlbedos cm_bsdf_albedos(CmSurface s, vec3 wo) {
  float cosine = dot(s.normal, wo);  // the same expression as in cm_bsdf_eval, so that drivers look up the table once
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

#endif
