// Lights: the radiance of each kind, its sampling for next-event estimation (NEE), and its pdf. src/light has the table
// of the lights and of the selection probability of each kind. Shared by GLSL and C++.
//
// NEE at a vertex picks one kind by its probability: cm_light_sample. Scattered rays also reach some kinds, by escaping
// to distant light or by hitting a triangle. Both are combined by the balance heuristic (Veach and Guibas, "Optimally
// Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995). cm_light_pdf is the pdf of NEE in all those
// weights.
//
// A kind is a number and a line of CM_FAR_LIGHTS or CM_NEAR_LIGHTS, with
//   its number, its probability, a sample, a pdf, and, if it is distant, a radiance, where
//   CmLightSample sample(path, here, u)   here: world, the vertex; u.xy chooses the point of the light, u.z the light
//   float pdf(hit)                        by solid angle; 0 for kinds without extent, which no scattered ray reaches
//   vec3 radiance(w)
#ifndef CM_LIGHT_GLSL
#define CM_LIGHT_GLSL

#include "common/luminance.glsl"

#define CM_LIGHT_SKY 0u             // uniform; sampled in the direction of a scattered ray
#define CM_LIGHT_SUN 1u             // distant: a disk, or without extent
#define CM_LIGHT_TRIANGLE 2u        // emissive triangles
#define CM_LIGHT_ANALYTIC_LIGHT 3u  // analytic lights (punctual.glsl)
#define CM_LIGHT_EMISSIVE 4u        // emission of the medium: rays from surfaces and ground are aimed at its bounds
#define CM_LIGHT_OTHER 5u           // kinds of CM_MORE_LIGHTS
#define CM_LIGHT_ENVIRONMENT 6u     // environment map, instead of the sky
#define CM_LIGHT_CELL 7u            // emissive cells

#if CM_GROUPS
uint cm_nee_group = 0u;   // group of the light, triangle or cell that was picked last
uint cm_group_lane = 0u;  // glsl/path/groups.glsl
void cm_add_to_group(uint group, vec3 radiance);

// Light group of a light of that kind. For kinds with a group per light, it is the group of the light that NEE picked
// last.
uint cm_group_of(uint kind) {
  if (kind == CM_LIGHT_SUN) return cm.integrator.sun_group;
  if (kind == CM_LIGHT_SKY || kind == CM_LIGHT_ENVIRONMENT) return cm.integrator.sky_group;
  return cm_nee_group;
}
#endif

// A light sample of NEE.
struct CmLightSample {
  uint kind;
  vec3 radiance;   // arriving radiance; for kinds without extent an irradiance
  vec3 direction;  // world, unit
  float distance;  // 3e38: distant
  float pdf;       // solid-angle pdf; without extent, the selection probability
};

// The light that a ray reaches.
struct CmLightHit {
  uint kind;
  vec3 o;                // cube space: origin of the ray
  vec3 w;                // world, unit: its direction
  float scattering_pdf;  // solid-angle pdf of the scattered ray's direction
  uint triangle;         // triangle that was hit
  vec3 point;            // world: point on that triangle
  vec3 normal;           // world, unit: normal of that triangle
};

CM_FN CmLightHit cm_light_hit(uint kind, vec3 o, vec3 w, float scattering_pdf) {
  CmLightHit hit;
  hit.kind = kind;
  hit.o = o;
  hit.w = w;
  hit.scattering_pdf = scattering_pdf;
  hit.triangle = 0u;
  hit.point = vec3(0.0f, 0.0f, 0.0f);
  hit.normal = w;
  return hit;
}

// ---- The sky

CM_FN vec3 cm_sky_radiance(vec3 w) { return cm.lights.sky_radiance; }
CM_FN float cm_sky_pdf(CmLightHit hit) { return hit.scattering_pdf; }
CM_FN CmLightSample cm_sky_along(vec3 w, float scattering_pdf) {
  return CmLightSample(CM_LIGHT_SKY, cm_sky_radiance(w), w, 3.0e38f, scattering_pdf);
}
// Placeholder: cm_scatter replaces it by cm_sky_along once it has sampled a direction. Until then `density` is only the
// selection probability.
CM_FN CmLightSample cm_sky_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  return cm_sky_along(vec3(0.0f, 1.0f, 0.0f), 1.0f);
}

#if CM_ENVIRONMENT

// ---- The environment

#include "light/environment.glsl"

#endif

// ---- The sun: a disk of uniform radiance. With spread 0 it is a single direction, which no scattered ray reaches.
// CM_SUN_DISK 0: the spread is 0.
#ifndef CM_SUN_DISK
#define CM_SUN_DISK 1
#endif

CM_FN bool cm_sun_is_disk() { return CM_SUN_DISK != 0 && cm.lights.sun_spread > 0.0f; }
CM_FN bool cm_on_sun(vec3 w) {
  vec3 apart = w - cm.lights.sun_direction;
  return CM_SUN_DISK != 0 && dot(apart, apart) < 2.0f * cm.lights.sun_spread;
}
CM_FN vec3 cm_sun_radiance(vec3 w) { return cm_on_sun(w) ? cm.lights.sun_radiance : vec3(0.0f, 0.0f, 0.0f); }
CM_FN float cm_sun_pdf(CmLightHit hit) {
  return cm_on_sun(hit.w) ? 0.159154943f / cm.lights.sun_spread : 0.0f;
}
// Samples the disk uniformly by solid angle.
CM_FN CmLightSample cm_sun_sample(vec3 u) {
  CmLightSample light =
      CmLightSample(CM_LIGHT_SUN, cm.lights.sun_irradiance, cm.lights.sun_direction, 3.0e38f, 1.0f);
  if (cm_sun_is_disk()) {
    float spread = cm.lights.sun_spread * u.x;
    float sine = sqrt(spread * (2.0f - spread));
    float angle = 6.28318531f * u.y;
    vec3 across;
    vec3 along;
    cm_frame(light.direction, across, along);
    light.direction =
        normalize(across * (sine * cos(angle)) + along * (sine * sin(angle)) + light.direction * (1.0f - spread));
    light.radiance = cm.lights.sun_radiance;
    light.pdf = 0.159154943f / cm.lights.sun_spread;
  }
  return light;
}

#if CM_CHANNELS

#include "traversal/cell_emission.glsl"

// ---- Emissive cells; their table is made by src/scene/emissive_cells.hpp
//
// NEE picks an emissive cell by its power and samples a point in it; scattered rays accumulate the emission of all
// cells that they cross. Both are combined by the balance heuristic. For scattered rays the pdf is that of their
// direction. For NEE it is the cell's volume pdf times a lower bound of the squared distance. The latter depends only
// on the cell and on the ray's origin, not on the sampled point. CmEmissive.extent, a length, converts the volume pdf
// to a solid-angle pdf.

CM_FN float cm_emissive_pdf_of(vec3 mean, float distance) {
  float least = distance * CM_EMISSIVE.min_stretch;
  return cm_luminance(mean) * CM_EMISSIVE.density * CM_EMISSIVE.extent * least * least;
}
CM_FN float cm_cell_pdf(CmEmission emission) { return cm_emissive_pdf_of(emission.mean, emission.distance); }

#endif

#if CM_CELL_LIGHTS

// Takes O(1).
CM_FN CmLightSample cm_cell_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
#if CM_INSTANCES
  uint stood = cm_here;
  uvec2 which = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x7f4a7c15u)));
  cm_here = cm_glowing_instance(cm_below(which.x, cm.space.volumes), which.y);
#endif
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x632be5abu)));
  uint i = cm_below(pick.x, CM_GRID.glowing);
  uvec4 entry = cm_emissive_word(2u * i);
  if (pick.y > entry.x) {
    i = entry.y;
    entry = cm_emissive_word(2u * i);
  }
  uvec4 record = cm_emissive_word(2u * i + 1u);
  uvec4 v0_shape = uvec4(entry.z, entry.w, 0u, 0u);
  bool wide = cm_is_wide(CM_GRID.root_exponent);
  uint shape = cm_record_shape(v0_shape, wide);
  uint cell_class = cm_shape_class(shape);
  vec3 point = cm_cell_point(cell_class, vec3(u.x, u.y, cm_random(p.random, p.stream)));
  // Measured from p.o, not from `here`, which is slightly above a surface: rays through the medium start at p.o as
  // well.
  vec3 to_v0 = cm_record_v0(v0_shape, wide) - cm_in_volume_point(p.o);
  vec3 way = cm_out_of_volume(to_v0 + cm_from_frame(point * cm_shape_unit(shape), shape));
  float length_2 = max(dot(way, way), 1e-24f);
  vec3 mean = cm_emission_mean(record);
  vec3 from_centroid = cm_to_frame(to_v0, shape) * -cm_shape_inverse_unit(shape) - cm_frame_centroid(cell_class);
  float distance = cm_cell_distance(from_centroid, shape);
  float least = distance * CM_EMISSIVE.min_stretch;
  CmLightSample light;
  light.kind = CM_LIGHT_CELL;
  light.direction = way * inversesqrt(length_2);
  light.distance = sqrt(length_2);
  light.pdf = cm_emissive_pdf_of(mean, distance);
  light.radiance = mean * (cm_emission_at(record, cell_class, point) * CM_EMISSIVE.extent * least * least / length_2);
#if CM_GROUPS
  cm_nee_group = CM_MEDIUM.group;
#endif
#if CM_CLIP
  vec3 there = cm_record_v0(v0_shape, wide) + cm_from_frame(point * cm_shape_unit(shape), shape);
  if (!cm_clip_keeps(cm_here, there)) light.radiance = vec3(0.0f, 0.0f, 0.0f);
#endif
#if CM_INSTANCES && CM_MOTION
  // The table's probabilities assume the volumes of the cells at the frame time.
  if (cm_instance_moves(cm_here))
    light.radiance *= abs(cm_transform_determinant(cm_instance_transform(cm_here))) / cm_instances[cm_here].space.unit_volume;
#endif
#if CM_INSTANCES
  cm_here = stood;
#endif
  return light;
}

#endif

#if CM_ANALYTIC_LIGHTS

// ---- Analytic lights; no scattered ray hits them. The includer provides CmAnalyticLight cm_analytic_light(uint i)

#include "light/punctual.glsl"

// Picks a light by the alias table of light::share_looks. O(1).
CM_FN CmAnalyticLight cm_pick_analytic_light(CmPath p, uint salt) {
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, salt)));
  uint i = cm_below(pick.x, max(cm.analytic_lights.count, 1u));
  if (pick.y > cm_analytic_light(i).stays) i = cm_analytic_light(i).other;
#if CM_GROUPS
  cm_nee_group = cm_analytic_light(i).group;
#endif
  return cm_analytic_light(i);
}

CM_FN CmLightSample cm_analytic_light_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  CmAnalyticLight analytic_light = cm_pick_analytic_light(p, 0x2c1b3c6du);
  vec3 from = analytic_light.extended != 0u ? cm_analytic_light_point(analytic_light, u.x, u.y) : vec3(0.0f, 0.0f, 0.0f);
  CmLightSample light;
  light.kind = CM_LIGHT_ANALYTIC_LIGHT;
  light.radiance = cm_analytic_light_irradiance(analytic_light, from, here, light.direction, light.distance);
  light.pdf = analytic_light.probability;
  return light;
}

#endif

#if CM_SURFACES

// ---- Emissive triangles; the tables are made by src/light/emitters.hpp, one per mesh

CM_FN uvec4 cm_emitter(uint model, uint i) { return cm_words(cm_models[model].emitters + i); }

// Solid-angle pdf of a point on an emissive triangle. The model and the triangle are picked by power, the point by
// area. way: vector from the shading point to that point, along w (unit); n: unit normal of the triangle.
CM_FN float cm_emitter_pdf(uint model, uvec4 entry, vec3 way, vec3 w, vec3 n) {
  float by_area = cm_models[model].emitter_probability * abs(uintBitsToFloat(entry.w)) * cm_own_area(model, n);
#if CM_MOTION
  // The table's probabilities assume the triangles' areas at the frame time.
  if (cm_model_deforms(model)) by_area *= cm_area_share(cm_vertex_mix(model, entry.x, vec2(0.0f)));
#endif
  return by_area * dot(way, way) / max(abs(dot(n, w)), 1e-12f);
}

// Returns 0 for a triangle that is not in a table. O(log n).
CM_FN float cm_triangle_pdf(CmLightHit hit) {
  uint model = cm_model_of(hit.triangle);
  uint triangle = hit.triangle - cm_models[model].first;
  uint low = 0u;
  uint high = cm_models[model].emitter_count;
  if (high == 0u) return 0.0f;
  while (low + 1u < high) {
    uint middle = (low + high) >> 1u;
    bool below = cm_emitter(model, middle).x <= triangle;
    low = below ? middle : low;
    high = below ? high : middle;
  }
  uvec4 entry = cm_emitter(model, low);
  vec3 way = hit.point - cm_from_cube_point(hit.o);
  return entry.x == triangle ? cm_emitter_pdf(model, entry, way, hit.w, hit.normal) : 0.0f;
}

// Takes O(1). The distance ends just before the triangle.
CM_FN CmLightSample cm_triangle_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  uvec2 which = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x7f4a7c15u)));
  uint model = cm_below(which.x, cm.surfaces.models);
  if (which.y > cm_models[model].alias || cm_models[model].emitter_count == 0u) model = cm_models[model].alias_other;
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x1b56c4e9u)));
  uvec4 entry = cm_emitter(model, cm_below(pick.x, cm_models[model].emitter_count));
#if CM_GROUPS
  cm_nee_group = cm_models[model].group;
#endif
  if (pick.y > entry.y) entry = cm_emitter(model, entry.z);
  float root = sqrt(u.x);
  CmVertexMix m = cm_vertex_mix(model, entry.x, vec2(root * (1.0f - u.y), root * u.y));
  vec3 a = cm_out_of_model_point(model, cm_corner(m, 0).position);
  vec3 b = cm_out_of_model_point(model, cm_corner(m, 1).position);
  vec3 c = cm_out_of_model_point(model, cm_corner(m, 2).position);
  vec3 g = cm_turning_normal(a, b, c);
  vec3 point = m.weight.x * a + m.weight.y * b + m.weight.z * c;
  bool along = dot(g, point - here) > 0.0f;  // seen from the side where the vertices are clockwise
  vec3 aside = along ? -g : g;
  vec3 way = cm_offset_origin(point, aside) + cm_model_room(model, point) * aside - here;
  float length_2 = max(dot(way, way), 1e-24f);
  CmLightSample light;
  light.kind = CM_LIGHT_TRIANGLE;
  light.direction = way * inversesqrt(length_2);
  light.distance = sqrt(length_2) * 0.99999f;
  light.pdf = cm_emitter_pdf(model, entry, way, light.direction, g);
  uint flags = cm_words(m.material + CM_MATERIAL_FLAGS).x;
  bool clockwise = (uintBitsToFloat(entry.w) < 0.0f) != cm_mirrors(model);
  light.radiance = along == clockwise || (flags & CM_ONE_SIDED) == 0u ? cm_emission(m) : vec3(0.0f, 0.0f, 0.0f);
  if ((flags & (CM_ALPHA_MASK | CM_ALPHA_BLEND)) != 0u) light.radiance *= cm_coverage(m);
  return light;
}

#endif

#if CM_SURFACES || CM_GROUND_AIMS

// ---- Emission of the medium: uniformly sampled points of its bounds

CM_FN vec3 cm_emissive_direction(vec3 o, vec3 u, vec3 otherwise) {
  vec3 way = cm_to_world(mix(cm.space.box_min, cm.space.box_max, u) - o);
  return dot(way, way) > 0.0f ? normalize(way) : otherwise;
}

// Solid-angle pdf: the integral of t^2 over the ray's segment in the bounds, divided by the volume of the bounds.
CM_FN float cm_emissive_pdf(CmLightHit hit) {
  vec2 range = cm_box_range(hit.o, cm_to_cube(hit.w));
  if (!(range.x < range.y)) return 0.0f;
  vec3 box = cm.space.box_max - cm.space.box_min;
  float cubes = (range.y - range.x) * (dot(range, range) + range.x * range.y);
  return min(1e30f, cubes / max(3.0f * cm.space.unit_volume * box.x * box.y * box.z, 1e-30f));
}

#endif

// ---- All kinds

CM_FN float cm_no_pdf(CmLightHit hit) { return 0.0f; }

// Hook for tests (tests/unit/support/disc_light.glsl).
#ifndef CM_MORE_LIGHTS
#define CM_MORE_LIGHTS(LIGHT)
#endif

#if CM_ENVIRONMENT
#define CM_FAR_LIGHTS(LIGHT)                                                                                \
  LIGHT(CM_LIGHT_ENVIRONMENT, cm.lights.environment_probability, cm_environment_sample, cm_environment_pdf, \
        cm_environment_radiance) CM_MORE_LIGHTS(LIGHT)
#else
#define CM_FAR_LIGHTS(LIGHT) \
  LIGHT(CM_LIGHT_SKY, cm.lights.sky_probability, cm_sky_sample, cm_sky_pdf, cm_sky_radiance) CM_MORE_LIGHTS(LIGHT)
#endif

#if CM_CELL_LIGHTS
#define CM_GLOWING_LIGHTS(LIGHT) LIGHT(CM_LIGHT_CELL, cm.lights.cell_probability, cm_cell_sample, cm_no_pdf, cm_unused)
#else
#define CM_GLOWING_LIGHTS(LIGHT)
#endif

#if CM_SURFACES > 1
#define CM_NEAR_LIGHTS(LIGHT)                                                                                          \
  LIGHT(CM_LIGHT_TRIANGLE, cm.lights.triangle_probability, cm_triangle_sample, cm_triangle_pdf, cm_unused)             \
  LIGHT(CM_LIGHT_ANALYTIC_LIGHT, cm.lights.analytic_light_probability, cm_analytic_light_sample, cm_no_pdf, cm_unused) \
  CM_GLOWING_LIGHTS(LIGHT)
#elif CM_ANALYTIC_LIGHTS
#define CM_NEAR_LIGHTS(LIGHT)                                                                                          \
  LIGHT(CM_LIGHT_ANALYTIC_LIGHT, cm.lights.analytic_light_probability, cm_analytic_light_sample, cm_no_pdf, cm_unused) \
  CM_GLOWING_LIGHTS(LIGHT)
#else
#define CM_NEAR_LIGHTS(LIGHT) CM_GLOWING_LIGHTS(LIGHT)
#endif

// The balance heuristic: MIS weight of a technique with pdf `mine` against one with pdf `other`.
CM_FN float cm_balance(float mine, float other) { return mine / max(mine + other, 1e-30f); }

// The sun's probability is the rest to 1.
#define CM_LEAVE(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE) -PROBABILITY
CM_FN float cm_sun_probability() { return max(0.0f, 1.0f CM_FAR_LIGHTS(CM_LEAVE) CM_NEAR_LIGHTS(CM_LEAVE)); }

#define CM_DENSITY(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE) \
  if (hit.kind == NUMBER) return PROBABILITY * PDF(hit);

// Solid-angle pdf with which NEE samples the light that a ray has reached.
CM_FN float cm_light_pdf(CmLightHit hit) {
  CM_FAR_LIGHTS(CM_DENSITY)
  CM_NEAR_LIGHTS(CM_DENSITY)
  if (hit.kind == CM_LIGHT_SUN) return cm_sun_probability() * cm_sun_pdf(hit);
#if CM_SURFACES || CM_GROUND_AIMS
  if (hit.kind == CM_LIGHT_EMISSIVE) return cm.lights.emissive_probability * cm_emissive_pdf(hit);
#endif
  return 0.0f;
}

#define CM_NEE(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE)                 \
  if (u.z >= before && u.z < before + PROBABILITY) {                       \
    light = SAMPLE(p, here, vec3(u.x, u.y, (u.z - before) / PROBABILITY)); \
    light.pdf *= PROBABILITY;                                              \
  }                                                                        \
  before += PROBABILITY;

// Samples a light for NEE. u.z picks the kind.
CM_FN CmLightSample cm_light_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  CmLightSample light = cm_sun_sample(u);
  float before = 0.0f;
  CM_FAR_LIGHTS(CM_NEE)
#if CM_ANALYTIC_LIGHTS
  // A new random number for the near kinds. The individual light is picked by the random state after it.
  if (u.z >= before && cm.lights.triangle_probability + cm.lights.analytic_light_probability > 0.0f) {
    u.z = before + (1.0f - before) * cm_random(p.random, p.stream);
  }
#endif
  CM_NEAR_LIGHTS(CM_NEE)
  if (light.kind == CM_LIGHT_SUN) light.pdf *= max(0.0f, 1.0f - before);
  return light;
}

// Returns true if scattered rays reach the light of this sample by escaping.
#define CM_IS_FAR(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE) || light.kind == NUMBER
CM_FN bool cm_is_far(CmLightSample light) {
  return (light.kind == CM_LIGHT_SUN && cm_sun_is_disk()) CM_FAR_LIGHTS(CM_IS_FAR);
}

// Fraction of NEE samples of uniform distant light that are worth a shadow ray. Scattered rays also reach that light:
// each one that is neither absorbed nor at its last event escapes in the end, with the same contribution.
CM_FN float cm_nee_even_probability(CmPath p) {
  vec3 albedo = CM_MEDIUM.albedo;
#if CM_CHANNELS && defined(CM_MARCH)
  if (CM_MEDIUM.colored != 0u) albedo *= cm_march_color(p.start_cell, cm_in_volume_point(p.o));
#endif
  float absorbed = 1.0f - max(albedo.x, max(albedo.y, albedo.z));
  float left = float(cm.integrator.max_bounces) + 1.0f - float(p.bounces);
  return min(1.0f, max(3.0f * absorbed, cm.integrator.max_bounces != 0u ? 4.0f / left : 0.0f));
}

// Probability of tracing the shadow ray of a light sample. In media, samples with a small expected contribution are
// skipped by Russian roulette; tests/bench/results/shadow_rays.csv has measurements. pdf: that of the light sample,
// including the probability of its kind. scattering_pdf: pdf of the same direction by the phase function.
CM_FN float cm_nee_probability(CmPath p, uint kind, float scattering_pdf, float pdf) {
  if (p.start != CM_IN_MEDIUM) return 1.0f;
  if (kind == CM_LIGHT_SKY) return cm_nee_even_probability(p);
  // In proportion to the phase function, and lower after many events. For near lights the number of events is ignored,
  // because their distance matters more.
  float share = 12.5663706f * scattering_pdf;
  bool near = kind == CM_LIGHT_ANALYTIC_LIGHT || kind == CM_LIGHT_TRIANGLE || kind == CM_LIGHT_CELL;
  if (!near) share *= clamp(8.0f / float(p.bounces), 0.25f, 1.0f);
#if CM_ENVIRONMENT
  // Where the environment is much brighter than its mean, such as a sun in it, scattered rays seldom find it.
  float bright = 12.5663706f * pdf / max(cm.lights.environment_probability, 1e-30f);
  if (kind == CM_LIGHT_ENVIRONMENT) share *= max(cm_nee_even_probability(p), min(1.0f, 0.125f * bright));
#endif
  return min(1.0f, share);
}

// Solid-angle pdf of NEE for the light that the path's scattered ray has reached, including the roulette on shadow
// rays.
CM_FN float cm_nee_pdf(CmPath p, CmLightHit hit) {
  float pdf = cm_light_pdf(hit);
  return pdf * cm_nee_probability(p, hit.kind, hit.scattering_pdf, pdf);
}

// Weighted radiance of the distant lights that a scattered ray reaches when it escapes with this transmittance.
#if CM_GROUPS
#define CM_ESCAPED(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE)                                \
  of_kind = RADIANCE(p.w) * cm_balance(transmittance * p.pdf,                                 \
                                       cm_nee_pdf(p, cm_light_hit(NUMBER, p.o, p.w, p.pdf))); \
  brought += of_kind;                                                                         \
  cm_add_to_group(cm_group_of(NUMBER), p.throughput * of_kind);
#else
#define CM_ESCAPED(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE) \
  brought += RADIANCE(p.w) * cm_balance(transmittance * p.pdf, \
                                        cm_nee_pdf(p, cm_light_hit(NUMBER, p.o, p.w, p.pdf)));
#endif
CM_FN vec3 cm_far_light(CmPath p, float transmittance) {
  vec3 brought = vec3(0.0f, 0.0f, 0.0f);
#if CM_GROUPS
  vec3 of_kind;
#endif
  CM_FAR_LIGHTS(CM_ESCAPED)
  CM_ESCAPED(CM_LIGHT_SUN, unused, unused, unused, cm_sun_radiance)
  return brought;
}

// Radiance of the background as seen by cameras.
#define CM_SEEN(NUMBER, PROBABILITY, SAMPLE, PDF, RADIANCE) seen += RADIANCE(w);
CM_FN vec3 cm_background_radiance(vec3 w) {
  vec3 seen = cm_sun_radiance(w);
  CM_FAR_LIGHTS(CM_SEEN)
  return seen;
}

#endif
