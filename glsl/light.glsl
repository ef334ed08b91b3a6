// Lights: what each kind sends, how paths look for them, and how likely they find them so. src/light has the table of
// which there are and how likely each kind is looked for. Shared by GLSL and C++.
//
// A look for light at a vertex is for one kind, by its chance: cm_light_sample. Flights come to some kinds as well, by
// escaping to what is far away or by meeting a triangle. What either finds counts by the balance heuristic (Veach and
// Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995), in which the density of
// looks is cm_light_pdf, whoever asks.
//
// A kind is a number and a line of CM_FAR_LIGHTS or CM_NEAR_LIGHTS, which is
//   its number, its chance, a sample, a density, and, if it is far away, a radiance, with
//   CmLightSample sample(path, here, u)   here: world, where looks start; u.xy for a point of the light, u.z for which
//   float density(hit)                    by solid angle; 0 of kinds without extent, which no flight comes to
//   vec3 radiance(w)
#ifndef CM_LIGHT_GLSL
#define CM_LIGHT_GLSL

#include "luminance.glsl"

#define CM_LIGHT_SKY 0u       // everywhere: looked for in a direction that a flight might take
#define CM_LIGHT_SUN 1u       // far away: a disc, or without extent
#define CM_LIGHT_TRIANGLE 2u  // emissive
#define CM_LIGHT_LAMP 3u      // of punctual.glsl
#define CM_LIGHT_GLOW 4u      // the medium's own: flights that leave surfaces are aimed at its box
#define CM_LIGHT_OTHER 5u     // of CM_MORE_LIGHTS
#define CM_LIGHT_ENVIRONMENT 6u  // a picture of all that is far away, instead of the sky
#define CM_LIGHT_CELL 7u  // a cell that gives off light

#if CM_GROUPS
uint cm_look_group = 0u;           // of the lamp, triangle or cell that was picked last
uint cm_group_lane = 0u;           // glsl/groups.glsl
void cm_add_to_group(uint group, vec3 radiance);

// Of lights of that kind, which a look has picked last where each has its own.
uint cm_group_of(uint kind) {
  if (kind == CM_LIGHT_SUN) return cm.integrator.sun_group;
  if (kind == CM_LIGHT_SKY || kind == CM_LIGHT_ENVIRONMENT) return cm.integrator.sky_group;
  return cm_look_group;
}
#endif

// What a look has found.
struct CmLightSample {
  uint kind;
  vec3 radiance;   // that comes from there; of kinds without extent an irradiance
  vec3 direction;  // world, unit
  float distance;  // 3e38: far away
  float density;   // with which it is found: by solid angle; without extent, the chance
};

// What a ray comes to.
struct CmLightHit {
  uint kind;
  vec3 o;         // cube space: where the ray starts
  vec3 w;         // world, unit: its direction
  float flight;   // density with which flights take that
  uint triangle;  // met
  vec3 point;     // world: of the triangle
  vec3 normal;    // world, unit: the triangle's
};

CM_FN CmLightHit cm_light_hit(uint kind, vec3 o, vec3 w, float flight) {
  CmLightHit hit;
  hit.kind = kind;
  hit.o = o;
  hit.w = w;
  hit.flight = flight;
  hit.triangle = 0u;
  hit.point = vec3(0.0f, 0.0f, 0.0f);
  hit.normal = w;
  return hit;
}

// ---- The sky

CM_FN vec3 cm_sky_radiance(vec3 w) { return cm.lights.sky_radiance; }
CM_FN float cm_sky_pdf(CmLightHit hit) { return hit.flight; }
CM_FN CmLightSample cm_sky_along(vec3 w, float flight) {
  return CmLightSample(CM_LIGHT_SKY, cm_sky_radiance(w), w, 3.0e38f, flight);
}
// To be had by cm_sky_along, once it is known where flights might go; the density is the chance alone until then.
CM_FN CmLightSample cm_sky_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  return cm_sky_along(vec3(0.0f, 1.0f, 0.0f), 1.0f);
}

#if CM_ENVIRONMENT

// ---- The environment

#include "environment.glsl"

#endif

// ---- The sun: a disc of even radiance. One of spread 0 is a direction, which no flight comes to.

CM_FN bool cm_on_sun(vec3 w) {
  vec3 apart = w - cm.lights.sun_direction;
  return dot(apart, apart) < 2.0f * cm.lights.sun_spread;
}
CM_FN vec3 cm_sun_radiance(vec3 w) { return cm_on_sun(w) ? cm.lights.sun_radiance : vec3(0.0f, 0.0f, 0.0f); }
CM_FN float cm_sun_pdf(CmLightHit hit) {
  return cm_on_sun(hit.w) ? 0.159154943f / cm.lights.sun_spread : 0.0f;
}
// Evenly over the disc.
CM_FN CmLightSample cm_sun_sample(vec3 u) {
  CmLightSample light =
      CmLightSample(CM_LIGHT_SUN, cm.lights.sun_irradiance, cm.lights.sun_direction, 3.0e38f, 1.0f);
  if (cm.lights.sun_spread > 0.0f) {
    float spread = cm.lights.sun_spread * u.x;
    float sine = sqrt(spread * (2.0f - spread));
    float angle = 6.28318531f * u.y;
    vec3 across;
    vec3 along;
    cm_frame(light.direction, across, along);
    light.direction =
        normalize(across * (sine * cos(angle)) + along * (sine * sin(angle)) + light.direction * (1.0f - spread));
    light.radiance = cm.lights.sun_radiance;
    light.density = 0.159154943f / cm.lights.sun_spread;
  }
  return light;
}

#if CM_CHANNELS

#include "channels.glsl"

// ---- Cells that give off light; their table is that of src/scene/glow.hpp
//
// A look picks a cell by what it gives off and a point of it; flights take up what all cells on their way give off. What
// either brings from a cell counts by the balance heuristic, with densities that depend on the cell and on where looks
// and flights start, never on a direction's or a point's own: those of a direction, for flights, and of a point times
// its squared distance, at least, for looks. Points are of a volume, so CmGlow.extent makes one of the other.

CM_FN float cm_glow_pdf_of(vec3 mean, float distance) {
  float least = distance * CM_GLOW.least_stretch;
  return cm_luminance(mean) * CM_GLOW.density * CM_GLOW.extent * least * least;
}
CM_FN float cm_cell_pdf(CmEmission emission) { return cm_glow_pdf_of(emission.mean, emission.distance); }

#endif

#if CM_CELL_LIGHTS

// O(1).
CM_FN CmLightSample cm_cell_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
#if CM_INSTANCES
  uint stood = cm_here;
  uvec2 which = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x7f4a7c15u)));
  cm_here = cm_glowing_instance(cm_below(which.x, cm.space.volumes), which.y);
#endif
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x632be5abu)));
  uint i = cm_below(pick.x, CM_GRID.glowing);
  uvec4 entry = cm_glow_word(2u * i);
  if (pick.y > entry.x) {
    i = entry.y;
    entry = cm_glow_word(2u * i);
  }
  uvec4 record = cm_glow_word(2u * i + 1u);
  uvec4 place = uvec4(entry.z, entry.w, 0u, 0u);
  bool wide = cm_is_wide(CM_GRID.root_exponent);
  uint shape = cm_record_shape(place, wide);
  uint cell_class = cm_shape_class(shape);
  vec3 point = cm_cell_point(cell_class, vec3(u.x, u.y, cm_random(p.random, p.stream)));
  // Not from `here`, which is a little above a surface: flights through the medium start at p.o as well.
  vec3 to_v0 = cm_record_v0(place, wide) - cm_in_volume_point(p.o);
  vec3 way = cm_out_of_volume(to_v0 + cm_from_frame(point * cm_shape_unit(shape), shape));
  float length_2 = max(dot(way, way), 1e-24f);
  vec3 mean = cm_emission_mean(record);
  vec3 from_centroid = cm_to_frame(to_v0, shape) * -cm_shape_inverse_unit(shape) - cm_frame_centroid(cell_class);
  float distance = cm_cell_distance(from_centroid, shape);
  float least = distance * CM_GLOW.least_stretch;
  CmLightSample light;
  light.kind = CM_LIGHT_CELL;
  light.direction = way * inversesqrt(length_2);
  light.distance = sqrt(length_2);
  light.density = cm_glow_pdf_of(mean, distance);
  light.radiance = mean * (cm_emission_at(record, cell_class, point) * CM_GLOW.extent * least * least / length_2);
#if CM_GROUPS
  cm_look_group = CM_MEDIUM.group;
#endif
#if CM_INSTANCES && CM_MOTION
  // The table's chances are of the volumes that cells have at the frame's moment.
  if (cm_instance_moves(cm_here))
    light.radiance *= abs(cm_standing_volume(cm_instance_standing(cm_here))) / cm_instances[cm_here].space.unit_volume;
#endif
#if CM_INSTANCES
  cm_here = stood;
#endif
  return light;
}

#endif

#if CM_LAMPS

// ---- Lamps; no flight meets them. The includer provides CmLamp cm_lamp(uint i)

#include "punctual.glsl"

// By light::share_looks. O(1).
CM_FN CmLamp cm_pick_lamp(CmPath p, uint salt) {
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, salt)));
  uint i = cm_below(pick.x, max(cm.lamps.count, 1u));
  if (pick.y > cm_lamp(i).stays) i = cm_lamp(i).other;
#if CM_GROUPS
  cm_look_group = cm_lamp(i).group;
#endif
  return cm_lamp(i);
}

CM_FN CmLightSample cm_lamp_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  CmLamp lamp = cm_pick_lamp(p, 0x2c1b3c6du);
  vec3 from = lamp.extended != 0u ? cm_lamp_point(lamp, u.x, u.y) : vec3(0.0f, 0.0f, 0.0f);
  CmLightSample light;
  light.kind = CM_LIGHT_LAMP;
  light.radiance = cm_lamp_irradiance(lamp, from, here, light.direction, light.distance);
  light.density = lamp.chance;
  return light;
}

#endif

#if CM_SURFACES

// ---- Emissive triangles; the tables are those of src/light/emitters.hpp, one a mesh

CM_FN uvec4 cm_emitter(uint model, uint i) { return cm_words(cm_models[model].emitters + i); }

// Density by solid angle of a point on one, picked by its model's power, by its own and then by area: `way` from where it
// is looked at, along w; n: its unit normal.
CM_FN float cm_emitter_density(uint model, uvec4 entry, vec3 way, vec3 w, vec3 n) {
  float by_area = cm_models[model].emitter_chance * abs(uintBitsToFloat(entry.w)) * cm_own_area(model, n);
#if CM_MOTION
  // The table's chances are of the areas at the frame's moment.
  if (cm_model_deforms(model)) by_area *= cm_area_share(cm_vertex_mix(model, entry.x, vec2(0.0f)));
#endif
  return by_area * dot(way, way) / max(abs(dot(n, w)), 1e-12f);
}

// 0 of a triangle that is not in a table. O(log n).
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
  return entry.x == triangle ? cm_emitter_density(model, entry, way, hit.w, hit.normal) : 0.0f;
}

// O(1). The distance is to just before it.
CM_FN CmLightSample cm_triangle_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  uvec2 which = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x7f4a7c15u)));
  uint model = cm_below(which.x, cm.surfaces.models);
  if (which.y > cm_models[model].alias || cm_models[model].emitter_count == 0u) model = cm_models[model].alias_other;
  uvec2 pick = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x1b56c4e9u)));
  uvec4 entry = cm_emitter(model, cm_below(pick.x, cm_models[model].emitter_count));
#if CM_GROUPS
  cm_look_group = cm_models[model].group;
#endif
  if (pick.y > entry.y) entry = cm_emitter(model, entry.z);
  float root = sqrt(u.x);
  CmVertexMix m = cm_vertex_mix(model, entry.x, vec2(root * (1.0f - u.y), root * u.y));
  vec3 a = cm_out_of_model_point(model, cm_corner(m, 0).position);
  vec3 b = cm_out_of_model_point(model, cm_corner(m, 1).position);
  vec3 c = cm_out_of_model_point(model, cm_corner(m, 2).position);
  vec3 g = cm_turning_normal(a, b, c);
  vec3 point = m.weight.x * a + m.weight.y * b + m.weight.z * c;
  bool along = dot(g, point - here) > 0.0f;  // seen from where the vertices turn clockwise
  vec3 aside = along ? -g : g;
  vec3 way = cm_offset_origin(point, aside) + cm_model_room(model, point) * aside - here;
  float length_2 = max(dot(way, way), 1e-24f);
  CmLightSample light;
  light.kind = CM_LIGHT_TRIANGLE;
  light.direction = way * inversesqrt(length_2);
  light.distance = sqrt(length_2) * 0.99999f;
  light.density = cm_emitter_density(model, entry, way, light.direction, g);
  uint flags = cm_words(m.material + CM_MATERIAL_FLAGS).x;
  bool clockwise = (uintBitsToFloat(entry.w) < 0.0f) != cm_mirrors(model);
  light.radiance = along == clockwise || (flags & CM_ONE_SIDED) == 0u ? cm_emission(m) : vec3(0.0f, 0.0f, 0.0f);
  if ((flags & (CM_ALPHA_MASK | CM_ALPHA_BLEND)) != 0u) light.radiance *= cm_coverage(m);
  return light;
}

// ---- The glowing medium: points of its box, each as likely

CM_FN vec3 cm_glow_direction(vec3 o, vec3 u, vec3 otherwise) {
  vec3 way = cm_to_world(mix(cm.space.box_min, cm.space.box_max, u) - o);
  return dot(way, way) > 0.0f ? normalize(way) : otherwise;
}

// The integral of t^2 over the ray's part inside, over the box's volume.
CM_FN float cm_glow_pdf(CmLightHit hit) {
  vec2 range = cm_box_range(hit.o, cm_to_cube(hit.w));
  if (!(range.x < range.y)) return 0.0f;
  vec3 box = cm.space.box_max - cm.space.box_min;
  float cubes = (range.y - range.x) * (dot(range, range) + range.x * range.y);
  return min(1e30f, cubes / max(3.0f * cm.space.unit_volume * box.x * box.y * box.z, 1e-30f));
}

#endif

// ---- All kinds

CM_FN float cm_no_pdf(CmLightHit hit) { return 0.0f; }

// A test's own (tests/unit/support/disc_light.glsl).
#ifndef CM_MORE_LIGHTS
#define CM_MORE_LIGHTS(LIGHT)
#endif

#if CM_ENVIRONMENT
#define CM_FAR_LIGHTS(LIGHT)                                                                       \
  LIGHT(CM_LIGHT_ENVIRONMENT, cm.lights.environment_chance, cm_environment_sample, cm_environment_pdf, \
        cm_environment_radiance) CM_MORE_LIGHTS(LIGHT)
#else
#define CM_FAR_LIGHTS(LIGHT) \
  LIGHT(CM_LIGHT_SKY, cm.lights.sky_chance, cm_sky_sample, cm_sky_pdf, cm_sky_radiance) CM_MORE_LIGHTS(LIGHT)
#endif

#if CM_CELL_LIGHTS
#define CM_GLOWING_LIGHTS(LIGHT) LIGHT(CM_LIGHT_CELL, cm.lights.cell_chance, cm_cell_sample, cm_no_pdf, cm_unused)
#else
#define CM_GLOWING_LIGHTS(LIGHT)
#endif

#if CM_SURFACES > 1
#define CM_NEAR_LIGHTS(LIGHT)                                                                         \
  LIGHT(CM_LIGHT_TRIANGLE, cm.lights.triangle_chance, cm_triangle_sample, cm_triangle_pdf, cm_unused) \
  LIGHT(CM_LIGHT_LAMP, cm.lights.lamp_chance, cm_lamp_sample, cm_no_pdf, cm_unused)                   \
  CM_GLOWING_LIGHTS(LIGHT)
#elif CM_LAMPS
#define CM_NEAR_LIGHTS(LIGHT)                                                       \
  LIGHT(CM_LIGHT_LAMP, cm.lights.lamp_chance, cm_lamp_sample, cm_no_pdf, cm_unused) \
  CM_GLOWING_LIGHTS(LIGHT)
#else
#define CM_NEAR_LIGHTS(LIGHT) CM_GLOWING_LIGHTS(LIGHT)
#endif

// The share of what one technique finds that counts, where another might have found it.
CM_FN float cm_balance(float mine, float other) { return mine / max(mine + other, 1e-30f); }

// The sun's chance is what the others leave.
#define CM_LEAVE(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE) -CHANCE
CM_FN float cm_sun_chance() { return max(0.0f, 1.0f CM_FAR_LIGHTS(CM_LEAVE) CM_NEAR_LIGHTS(CM_LEAVE)); }

#define CM_DENSITY(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE) \
  if (hit.kind == NUMBER) return CHANCE * PDF(hit);

// Of looks for light, to come to what a ray has come to.
CM_FN float cm_light_pdf(CmLightHit hit) {
  CM_FAR_LIGHTS(CM_DENSITY)
  CM_NEAR_LIGHTS(CM_DENSITY)
  if (hit.kind == CM_LIGHT_SUN) return cm_sun_chance() * cm_sun_pdf(hit);
#if CM_SURFACES
  if (hit.kind == CM_LIGHT_GLOW) return cm.lights.glow_chance * cm_glow_pdf(hit);
#endif
  return 0.0f;
}

#define CM_LOOK(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE)                 \
  if (u.z >= before && u.z < before + CHANCE) {                        \
    light = SAMPLE(p, here, vec3(u.x, u.y, (u.z - before) / CHANCE));  \
    light.density *= CHANCE;                                           \
  }                                                                    \
  before += CHANCE;

// A look for light: u.z decides for which kind.
CM_FN CmLightSample cm_light_sample(CM_INOUT(CmPath) p, vec3 here, vec3 u) {
  CmLightSample light = cm_sun_sample(u);
  float before = 0.0f;
  CM_FAR_LIGHTS(CM_LOOK)
#if CM_LAMPS
  // A number of its own for the kinds that share the rest: which of many lights is drawn by the state behind it.
  if (u.z >= before && cm.lights.triangle_chance + cm.lights.lamp_chance > 0.0f) {
    u.z = before + (1.0f - before) * cm_random(p.random, p.stream);
  }
#endif
  CM_NEAR_LIGHTS(CM_LOOK)
  if (light.kind == CM_LIGHT_SUN) light.density *= max(0.0f, 1.0f - before);
  return light;
}

// Whether flights come to what a look has found by escaping to it.
#define CM_IS_FAR(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE) || light.kind == NUMBER
CM_FN bool cm_is_far(CmLightSample light) {
  return (light.kind == CM_LIGHT_SUN && cm.lights.sun_spread > 0.0f) CM_FAR_LIGHTS(CM_IS_FAR);
}

// The share of looks for what is far away and even that are worth making. Flights find it by themselves: those that are
// not absorbed, and are not at their last event, escape to it in the end, each with as much.
CM_FN float cm_look_share_of_even(CmPath p) {
  vec3 albedo = CM_MEDIUM.albedo;
#if CM_CHANNELS && defined(CM_MARCH)
  if (CM_MEDIUM.coloured != 0u) albedo *= cm_march_colour(p.start_cell);
#endif
  float absorbed = 1.0f - max(albedo.x, max(albedo.y, albedo.z));
  float left = float(cm.integrator.max_bounces) + 1.0f - float(p.bounces);
  return min(1.0f, max(3.0f * absorbed, cm.integrator.max_bounces != 0u ? 4.0f / left : 0.0f));
}

// The chance that a look is made, where one of that kind was drawn with that density (its kind's chance in it) along a
// direction that flights take with that one: in the medium, looks that would tell little are left out by Russian roulette
// (tests/bench/README.md has what that is worth).
CM_FN float cm_look_chance(CmPath p, uint kind, float flight, float density) {
  if (p.start != CM_IN_MEDIUM) return 1.0f;
  if (kind == CM_LIGHT_SKY) return cm_look_share_of_even(p);
  // By what comes along, of which a path of many events needs less; but of what is near it is the distance that counts.
  float share = 12.5663706f * flight;
  bool near = kind == CM_LIGHT_LAMP || kind == CM_LIGHT_TRIANGLE || kind == CM_LIGHT_CELL;
  if (!near) share *= clamp(8.0f / float(p.bounces), 0.25f, 1.0f);
#if CM_ENVIRONMENT
  // Where it is brighter than its mean, as a sun in it, flights seldom find it.
  float bright = 12.5663706f * density / max(cm.lights.environment_chance, 1e-30f);
  if (kind == CM_LIGHT_ENVIRONMENT) share *= max(cm_look_share_of_even(p), min(1.0f, 0.125f * bright));
#endif
  return min(1.0f, share);
}

// Of looks that are made, to come to what the path's flight has come to.
CM_FN float cm_look_pdf(CmPath p, CmLightHit hit) {
  float density = cm_light_pdf(hit);
  return density * cm_look_chance(p, hit.kind, hit.flight, density);
}

// What a flight brings that escapes with that transmittance.
#if CM_GROUPS
#define CM_ESCAPED(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE)                                         \
  of_kind = RADIANCE(p.w) * cm_balance(transmittance * p.density,                                \
                                       cm_look_pdf(p, cm_light_hit(NUMBER, p.o, p.w, p.density))); \
  brought += of_kind;                                                                            \
  cm_add_to_group(cm_group_of(NUMBER), p.throughput * of_kind);
#else
#define CM_ESCAPED(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE)           \
  brought += RADIANCE(p.w) * cm_balance(transmittance * p.density, \
                                        cm_look_pdf(p, cm_light_hit(NUMBER, p.o, p.w, p.density)));
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

// What is behind all, as cameras see it.
#define CM_SEEN(NUMBER, CHANCE, SAMPLE, PDF, RADIANCE) seen += RADIANCE(w);
CM_FN vec3 cm_background_radiance(vec3 w) {
  vec3 seen = cm_sun_radiance(w);
  CM_FAR_LIGHTS(CM_SEEN)
  return seen;
}

#endif
