// Where paths scatter: in the medium, or at a triangle. What glsl/path.glsl does there in either way, with functions of
// the same names where there are no triangles.
#ifndef CM_PATH_VERTEX_GLSL
#define CM_PATH_VERTEX_GLSL

#define CM_EVENT_NONE 0u
#define CM_EVENT_COLLISION 1u
#define CM_EVENT_ESCAPE 2u

// Next-event transmittance below e^-2 is estimated by Russian roulette: an opaque way out costs no more than it tells.
#define CM_SHADOW_DEPTH 2.0f

// Cells marched before events are looked at: keeps neighbouring lanes together.
#ifndef CM_CHUNK
#define CM_CHUNK 8
#endif
// Events between looks at whether a new camera ray is due.
#ifndef CM_EVENTS
#define CM_EVENTS 8
#endif

// What a next-event estimate that is not to the sky looks for.
struct CmLampSample {
  vec3 radiance;    // an irradiance, of lamps and the sun: their density has no solid angle
  vec3 direction;   // world, unit
  float distance;   // 3e38: far away
  float density;    // by solid angle, or the chance; of all ways in which the estimate could come to look there
  bool emitter;     // an emissive triangle: flights may happen on it too
};

// The direction that a ray takes from a vertex (its own, or to the lamp).
struct CmDirection {
  vec3 w;              // sampled; world, unit
  vec3 share;          // of light that goes on along the ray: the phase function, or the BSDF times the cosine
  float density;       // by solid angle, with which flights take it
  float lobe_density;  // the same, of the lobes alone
  vec3 weight;         // share over density
  bool may_meet;       // flights along it may count what they meet of the emissive triangles
};

#if CM_SURFACES

struct CmVertex {
  bool on_triangle;
  CmSurfacePoint surface;  // if so
};

// The density, by solid angle, of directions w (world) from o (cube space) to points of the box, each as likely: the
// integral of t^2 over the ray's part inside, over the box's volume.
float cm_glow_density(vec3 o, vec3 w) {
  vec2 range = cm_box_range(o, cm_to_cube(w));
  vec3 box = cm.grid.box_max - cm.grid.box_min;
  float cubes = max(0.0, range.y - range.x) * (dot(range, range) + range.x * range.y);
  return cubes / max(3.0 * cm.grid.unit_volume * box.x * box.y * box.z, 1e-30);
}

// Whether a triangle ends the ray before the event does: then o, once moved, is on it. Asked after the march, not
// before: in a dense medium the way to a collision is short, and few boxes are near it; and most shadow rays end in the medium.
bool cm_meet(inout CmPath p, uint event) {
  bool flight = p.ray == CM_RAY_FLIGHT;
  if (event == CM_EVENT_NONE || (event == CM_EVENT_COLLISION && !flight)) return false;
  if (p.bounces == 0u && cm.layers.count != 0u) return false;
  vec3 d = cm_to_world(p.d);
  vec3 o = cm_from_cube_point(p.o);
  if (p.start == CM_ON_TRIANGLE) {
    vec3 shift;
    o = cm_surface_origin(p.triangle, p.weights, p.behind != 0u, d, shift);
    // Shadow rays end where they would from the point itself: at a lamp.
    if (!flight) d -= shift / p.reach;
  }
  cm_hit_seed = p.random;
  cm_hit_camera = p.bounces == 0u;
  CmHit hit;
  bool met = cm_bvh_trace(o, d, 0.0, event == CM_EVENT_COLLISION ? p.t : p.reach, !flight, hit);
  if (met && flight) {
    p.triangle = hit.triangle;
    p.weights = hit.barycentrics;
    cm_hit_back = !hit.front;
  }
  if (met && !flight) p.light = vec3(0.0);
  return met && flight;
}

// What a path has met, and its light.
CmVertex cm_vertex(inout CmPath p, bool on_triangle, bool met) {
  CmVertex vertex;
  vertex.on_triangle = on_triangle;
  if (!on_triangle) return vertex;
  vertex.surface = cm_surface_point(p.triangle, p.weights, p.w);
  // Path space regularization: Kaplanyan and Dachsbacher, 2013.
  if (p.blurred != 0u) {
    float least = cm.integrator.blurred_roughness;
    vertex.surface.material.roughness = max(vertex.surface.material.roughness, least);
    vertex.surface.material.clearcoat_roughness = max(vertex.surface.material.clearcoat_roughness, least);
  }
  // The flight that met it, and the next-event estimate before: the balance heuristic, whatever the medium between.
  if (CM_SURFACES > 1 && met && p.bounces > 0u && !vertex.surface.unlit) {
    vec3 way = vertex.surface.position - cm_from_cube_point(p.o);
    float other = cm_emitter_met(p.triangle, way, dot(vertex.surface.geometric, p.w));
    other *= (1.0 - cm.lights.sky_probability) * cm.lights.emitter_probability;
    vertex.surface.emission *= p.density / max(p.density + other, 1e-30);
  }
  if (met) p.radiance += p.throughput * vertex.surface.emission;
  return vertex;
}

// The path is on the triangle that it has met, after cm_arrive. Whether it ends there.
bool cm_stand(inout CmPath p, CmVertex vertex) {
  p.o = cm_to_cube_point(vertex.surface.position);
  p.start = CM_ON_TRIANGLE;
  p.behind = vertex.surface.behind ? 1u : 0u;
  return vertex.surface.unlit;
}

// The sun, a lamp or an emissive triangle, if one is to be looked for.
CmLampSample cm_choose_lamp(inout CmPath p, CmVertex vertex, bool wanted) {
  CmLampSample lamp = CmLampSample(cm.lights.sun_irradiance, cm.lights.sun_direction, 3.0e38,
                                   1.0 - cm.lights.sky_probability, false);
  if (!wanted || (cm.surfaces.lamp_count == 0u && CM_SURFACES == 1)) return lamp;
  vec3 here = cm_from_cube_point(p.o);
  float u = cm_random(p.random, p.stream);
  float share = CM_SURFACES > 1 ? cm.lights.emitter_probability : 0.0;
  if (CM_SURFACES > 1) {
    lamp.emitter = u < share;
    lamp.density *= lamp.emitter ? share : 1.0 - share;
    u = max(0.0, u - share) / max(1.0 - share, 1e-6);
  }
  cm_lamp(here, u, lamp.radiance, lamp.direction, lamp.distance);
  if (CM_SURFACES > 1 && lamp.emitter) {
    uvec2 words = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x1b56c4e9u)));
    float u_a = cm_random(p.random, p.stream);
    float u_b = cm_random(p.random, p.stream);
    if (vertex.on_triangle) here = cm_offset_origin(vertex.surface.position, vertex.surface.geometric);
    float density = 1.0;
    lamp.radiance = cm_emitter_sample(here, words, vec2(u_a, u_b), lamp.direction, lamp.distance, density);
    lamp.density *= density;
  }
  return lamp;
}

// A direction to go on in; what it says of the ray's own is of the lamp's, if the ray is to one.
CmDirection cm_direction(inout CmPath p, CmVertex vertex, CmLampSample lamp, bool to_lamp, float u_0, float u_1) {
  CmDirection next;
  next.w = cm_around(p.w, cm_phase_cosine(cm.medium.anisotropy, u_0), 6.28318531 * u_1);
  next.may_meet = true;
  if (vertex.on_triangle) {
    float u_3 = cm_random(p.random, p.stream);
    // A glowing medium is looked for by some of the flights: towards a point of its box, each as likely.
    float to_glow = cm.lights.glow_probability;
    bool guided = u_3 < to_glow;
    u_3 = guided ? u_3 / to_glow : (u_3 - to_glow) / (1.0 - to_glow);
    vec3 goal = mix(cm.grid.box_min, cm.grid.box_max, vec3(u_0, u_1, u_3));
    vec3 to_goal = cm_to_world(goal - p.o);
    next.w = cm_surface_sample(vertex.surface, p.w, u_0, u_1, u_3);
    if (guided && dot(to_goal, to_goal) > 0.0) next.w = normalize(to_goal);
    vec3 wi = to_lamp ? lamp.direction : next.w;
    next.share = cm_surface_eval(vertex.surface, p.w, wi);
    next.lobe_density = cm_surface_pdf(vertex.surface, p.w, wi);
    next.density = next.lobe_density + to_glow * (cm_glow_density(p.o, wi) - next.lobe_density);
    // Rays that start above the triangle see a lamp at another angle than it is looked for: that alone counts then.
    next.may_meet = !vertex.surface.lifted || cm_lift_share(dot(vertex.surface.geometric, wi)) <= 0.0;
  } else {
    next.lobe_density = cm_phase(cm.medium.anisotropy, dot(p.w, to_lamp ? lamp.direction : next.w));
    next.density = next.lobe_density;
    next.share = vec3(next.lobe_density);
  }
  next.weight = next.density > 0.0 ? next.share / next.density : vec3(0.0);
  return next;
}

// Whether a path is scattered wider than a surface of the least roughness does: a quarter of that lobe's highest
// density, and no matte surface is smooth.
bool cm_blurs(CmDirection next) {
  float alpha = cm_alpha(cm.integrator.blurred_roughness);
  return next.lobe_density < max(0.35, 0.25 * CM_INV_PI * 0.25 / (alpha * alpha));
}

#else

struct CmVertex {
  bool on_triangle;  // never
};

CM_FN bool cm_meet(CM_INOUT(CmPath) p, uint event) { return false; }
CM_FN CmVertex cm_vertex(CM_INOUT(CmPath) p, bool on_triangle, bool met) { return CmVertex(false); }
CM_FN bool cm_stand(CM_INOUT(CmPath) p, CmVertex vertex) { return false; }
CM_FN bool cm_blurs(CmDirection next) { return false; }

// The sun.
CM_FN CmLampSample cm_choose_lamp(CM_INOUT(CmPath) p, CmVertex vertex, bool wanted) {
  CmLampSample lamp;
  lamp.radiance = cm.lights.sun_irradiance;
  lamp.direction = cm.lights.sun_direction;
  lamp.distance = 3.0e38f;
  lamp.density = 1.0f - cm.lights.sky_probability;
  lamp.emitter = false;
  return lamp;
}

// The phase function samples itself exactly.
CM_FN CmDirection cm_direction(CM_INOUT(CmPath) p, CmVertex vertex, CmLampSample lamp, bool to_lamp, float u_0,
                               float u_1) {
  CmDirection next;
  next.w = cm_around(p.w, cm_phase_cosine(cm.medium.anisotropy, u_0), 6.28318531f * u_1);
  next.density = cm_phase(cm.medium.anisotropy, dot(p.w, lamp.direction));
  next.lobe_density = next.density;
  next.share = vec3(next.density, next.density, next.density);
  next.weight = vec3(1.0f, 1.0f, 1.0f);
  next.may_meet = false;
  return next;
}

#endif

#endif
