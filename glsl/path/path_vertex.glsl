// Scattering vertices of a path: in the medium, on the ground or on a triangle. glsl/path/path.glsl calls the same
// functions in builds with and without triangles.
#ifndef CM_PATH_VERTEX_GLSL
#define CM_PATH_VERTEX_GLSL

// Transmittance of shadow rays below e^-2 is estimated by Russian roulette, so that shadow rays in opaque media stay
// cheap.
#define CM_SHADOW_DEPTH 2.0f

// The first events of a path use low-discrepancy numbers over the pixel's samples. For later events they gain almost
// nothing.
#define CM_EVEN_EVENTS 4u
// A set beyond those of the events.
#define CM_WAVELENGTH_SET 64u

// The random numbers of a ray from an event.
struct CmDraw {
  vec2 u_direction;  // random numbers for the direction, or for the point on the sampled light
  float u_choice;    // for the lobe or the light
  float u_distance;  // for the free-flight distance
};

CM_FN CmDraw cm_draw(CM_INOUT(CmPath) p, bool to_light) {
  CmDraw draw;
  if (p.bounces <= CM_EVEN_EVENTS) {
    uint set = 4u * p.bounces + (to_light ? 0u : 2u);
    draw.u_direction = cm_even_pair(p.number, p.stream, set);
    vec2 second = cm_even_pair(p.number, p.stream, set + 1u);
    draw.u_choice = second.x;
    draw.u_distance = second.y;
  } else {
    draw.u_direction.x = cm_random(p.random, p.stream);
    draw.u_direction.y = cm_random(p.random, p.stream);
    draw.u_choice = cm_random(p.random, p.stream);
    draw.u_distance = cm_random(p.random, p.stream);
  }
  return draw;
}

#if CM_EXTENDED_BSDF
#include "path/dispersion.glsl"
#endif

// Scattering of light at a vertex along a direction: value, pdf and weight of the BSDF or phase function.
struct CmScatterSample {
  vec3 share;      // value: the phase function, or the BSDF times the cosine
  float pdf;       // solid-angle pdf with which scattered rays take the direction
  float lobe_pdf;  // the same, only of the lobes
  vec3 weight;     // share / pdf
  bool lifted;     // the ray's origin is above its triangle (cm_lift)
#if CM_EXTENDED_BSDF
  bool through;        // the ray's origin is behind its triangle
  bool disperses;      // the path has a single wavelength from here on
#endif
};

// 1 if the medium's phase function has a second lobe. This is a variant, because software drivers also execute branches
// that are not taken.
#ifndef CM_SECOND_LOBE
#define CM_SECOND_LOBE 0
#endif

// Mean cosine of the medium at the path's collision.
CM_FN float cm_anisotropy(CmPath p) {
#if CM_CHANNELS && defined(CM_MARCH)
  if (CM_MEDIUM.anisotropic != 0u && p.start == CM_IN_MEDIUM) return cm_march_anisotropy(p.start_cell, cm_in_volume_point(p.o));
#endif
  return CM_MEDIUM.anisotropy;
}

// CM_ISOTROPIC 1: the anisotropy is 0, and there is no second lobe.
#ifndef CM_ISOTROPIC
#define CM_ISOTROPIC 0
#endif

CM_FN bool cm_on_ground(CmPath p) { return CM_GROUND != 0 && p.start == CM_ON_GROUND; }
// Returns true if the ray's origin is the point where the camera ray hit a shadow catcher.
CM_FN bool cm_on_catcher(CmPath p) { return cm_ground_catches() && cm_on_ground(p); }
// Returns true if the ray hits the ground, unless something blocks it.
CM_FN bool cm_goes_to_ground(CmPath p) { return CM_GROUND != 0 && p.to_ground != 0u; }

#if CM_ISOTROPIC
CM_FN float cm_medium_phase(float g, float cosine) { return CM_ISOTROPIC_PHASE; }
CM_FN float cm_medium_cosine(float g, float u) { return 1.0f - 2.0f * u; }
#elif CM_SECOND_LOBE
CM_FN CmPhase cm_lobes(float anisotropy) {
  CmPhase phase;
  phase.anisotropy = anisotropy;
  phase.second_anisotropy = CM_MEDIUM.second_anisotropy;
  phase.second_bend = CM_MEDIUM.second_bend;
  phase.second_weight = CM_MEDIUM.second_weight;
  return phase;
}
CM_FN float cm_medium_phase(float g, float cosine) { return cm_phase(cm_lobes(g), cosine); }
CM_FN float cm_medium_cosine(float g, float u) { return cm_phase_cosine(cm_lobes(g), u); }
#else
CM_FN float cm_medium_phase(float g, float cosine) { return cm_henyey_greenstein(g, cosine); }
CM_FN float cm_medium_cosine(float g, float u) { return cm_henyey_greenstein_cosine(g, u); }
#endif

// Fraction of the light not absorbed that is scattered into wi, in the medium or on the ground, per solid angle. This
// is also the pdf of the sampled directions.
CM_FN float cm_scattered(CmPath p, vec3 wi) {
  return cm_on_ground(p) ? max(0.0f, wi.y) * 0.318309886f : cm_medium_phase(cm_anisotropy(p), dot(p.w, wi));
}
CM_FN vec3 cm_scattered_direction(CmPath p, float u_0, float u_1) {
  bool ground = cm_on_ground(p);
  return cm_around(ground ? vec3(0.0f, 1.0f, 0.0f) : p.w,
                   ground ? sqrt(1.0f - u_0) : cm_medium_cosine(cm_anisotropy(p), u_0), 6.28318531f * u_1);
}

// Rays that leave the ground or a collision. Some from the ground are aimed at the bounds of the emissive medium, because
// few others would find a fire.
CM_FN vec3 cm_scattered_ray(CmPath p, CmDraw draw) {
  vec3 w = cm_scattered_direction(p, draw.u_direction.x, draw.u_direction.y);
#if CM_GROUND_AIMS
  float to_emissive = cm.lights.emissive_probability;
  if (cm_on_ground(p) && draw.u_choice < to_emissive)
    w = cm_emissive_direction(p.o, vec3(draw.u_direction.x, draw.u_direction.y, draw.u_choice / to_emissive), w);
#endif
  return w;
}
// Solid-angle pdf of its direction.
CM_FN float cm_scattered_ray_pdf(CmPath p, vec3 wi) {
  float pdf = cm_scattered(p, wi);
#if CM_GROUND_AIMS
  if (cm_on_ground(p))
    pdf = (1.0f - cm.lights.emissive_probability) * pdf + cm_light_pdf(cm_light_hit(CM_LIGHT_EMISSIVE, p.o, wi, pdf));
#endif
  return pdf;
}

CM_FN bool cm_is_equiangular(CmPath p) { return CM_EQUIANGULAR != 0 && p.ray == CM_RAY_EQUIANGULAR; }

// Returns true if the ray's origin is the path's collision, in cell start_cell.
CM_FN bool cm_starts_inside(CmPath p) { return p.start == CM_IN_MEDIUM && !cm_is_equiangular(p); }

// Returns true without light among surfaces (light_among_surfaces 0) and after the first event: rays that left a
// surface then see only distant light, and surfaces do not light the volume.
CM_FN bool cm_among_surfaces_dark(CmPath p) {
  return CM_SURFACES != 0 && cm.integrator.light_among_surfaces == 0u && p.bounces > 0u;
}
CM_FN bool cm_is_dark(CmPath p) { return cm_among_surfaces_dark(p) && p.start == CM_ON_TRIANGLE; }

#if CM_SURFACES

struct CmVertex {
  bool on_triangle;
  CmSurfacePoint surface;  // valid only if on_triangle
#if CM_EXTENDED_BSDF
  uint bounds;  // first word of the material whose volume the triangle bounds, plus one; 0: none
  bool leaves;  // the path comes from inside
  vec3 color;   // color of the path's wavelength if it is chosen at this vertex; else white
  bool disperses;
#endif
};

// Transmitted rays are not light among surfaces: they are traced even if light_among_surfaces is 0.
CM_FN bool cm_came_through(CmPath p) {
#if CM_EXTENDED_BSDF
  return p.through != 0u && p.start == CM_ON_TRIANGLE;
#else
  return false;
#endif
}

#if CM_EXTENDED_BSDF

// Index of refraction of a material's volume, by its first word plus one; 0: air.
CM_FN float cm_index(uint within) { return within == 0u ? 1.0f : cm_floats(within - 1u + CM_MATERIAL_VOLUME).w; }
CM_FN float cm_index_at(uint within, float wavelength) {
  if (within == 0u) return 1.0f;
  return cm_cauchy(cm_index(within), cm_floats(within - 1u + CM_MATERIAL_ANISOTROPY).w, wavelength);
}
CM_FN bool cm_disperses(uint within) {
  return within != 0u && cm_floats(within - 1u + CM_MATERIAL_ANISOTROPY).w > 0.0f;
}
CM_FN vec3 cm_transmittance_within(uint within, float way) {
  if (within == 0u) return vec3(1.0f);
  return exp(vec3(cm_floats(within - 1u + CM_MATERIAL_VOLUME)) * -way);
}

// Returns the medium on the far side when a path leaves the volume `bounds`; it is in `within`, enclosed by `outside`.
// Closed meshes may be nested, up to two deep.
CM_FN uint cm_beyond(uint bounds, uint within, uint outside) { return within == bounds ? outside : within; }

// Updates `within` and `outside` when the path crosses the boundary.
CM_FN void cm_cross(uint bounds, bool leaves, CM_INOUT(uint) within, CM_INOUT(uint) outside) {
  if (bounds == 0u) return;
  if (leaves) {
    within = cm_beyond(bounds, within, outside);
    if (within == outside || outside == bounds) outside = 0u;
  } else {
    outside = within;
    within = bounds;
  }
}

// Returns the first word plus one of the triangle's material if it bounds a volume, else 0.
CM_FN uint cm_bounds(uint triangle) {
  uint model = cm_model_of(triangle);
  uint number = cm_words(cm_models[model].triangles + triangle - cm_models[model].first).w;
  uint material = cm_models[model].materials + CM_MATERIAL_WORDS * number;
  return cm_floats(material + CM_MATERIAL_VOLUME).w > 0.0f ? material + 1u : 0u;
}

// Sets the indices of refraction on both sides of the path's triangle, and the fields that follow from them.
CM_FN void cm_bound(CmPath p, CM_INOUT(CmVertex) vertex) {
  vertex.bounds = cm_bounds(p.triangle);
  vertex.leaves = p.back != 0u;
  vertex.color = vec3(1.0f);
  vertex.disperses = false;
  if (vertex.bounds == 0u) return;
  uint other = vertex.leaves ? cm_beyond(vertex.bounds, p.within, p.outside) : p.within;
  uint before = vertex.leaves ? vertex.bounds : other;
  uint behind = vertex.leaves ? other : vertex.bounds;
  float ratio = cm_index(behind) / cm_index(before);
  float in_air = vertex.surface.material.eta;
  float eta = ratio;
  if (cm_disperses(before) || cm_disperses(behind)) {
    float wavelength = cm_wavelength(cm_even_pair(p.number, p.stream, CM_WAVELENGTH_SET).x);
    eta = cm_index_at(behind, wavelength) / cm_index_at(before, wavelength);
    if (p.dispersed == 0u) {
      vertex.disperses = true;
      vertex.color = cm_wavelength_color(wavelength);
    }
    // White light is reflected with the index at the middle wavelength.
    if (p.dispersed != 0u || vertex.leaves) ratio = eta;
  }
  float r = (ratio - 1.0f) / (ratio + 1.0f);
  float r_air = (in_air - 1.0f) / (in_air + 1.0f);
  vertex.surface.material.f0 = min(vertex.surface.material.f0 * ((r * r) / (r_air * r_air)), vec3(1.0f));
  vertex.surface.material.eta = cm_apart(eta);
  vertex.surface.material.film_average = cm_film_average(vertex.surface.material);
}

// Applies the absorption of material volumes between a ray's origin and its hit, collision or end.
CM_FN void cm_absorb(CM_INOUT(CmPath) p, bool is_hit, CmHit hit) {
  bool scattered = p.ray == CM_RAY_SCATTERED;
  // Emissive media are traversed after this query. cm_see then dims the light of the triangle that was hit.
  if (scattered && cm.medium.emits != 0u) return;
  uint within = p.within;
  uint outside = p.outside;
  if (!scattered && p.start == CM_ON_TRIANGLE && p.through != 0u) cm_cross(cm_bounds(p.triangle), p.back != 0u, within, outside);
  if (scattered && is_hit && within == 0u && !hit.front) within = cm_bounds(hit.triangle);  // a camera may be inside
  float way = is_hit ? hit.t : (scattered && p.event == CM_EVENT_COLLISION ? p.t : p.reach);
  // A ray without end left through a hole in the mesh.
  if (way > 1e30f) return;
  vec3 transmittance = cm_transmittance_within(within, way);
  if (scattered) p.throughput *= transmittance;
  if (!scattered || p.bounces == 0u) p.light *= transmittance;
}

#endif

// Returns true if a triangle may be nearer than the ray's event, so that the BVH must be queried. The query comes after
// the traversal: in a dense medium the distance to a collision is short and few boxes are near it, and most shadow rays
// end in the medium.
CM_FN bool cm_asks(CmPath p) {
  bool scattered = p.ray == CM_RAY_SCATTERED;
  if (p.event == CM_EVENT_COLLISION && !scattered) return false;
  if (scattered && p.bounces == 0u && cm.layers.count != 0u) return false;
  if (p.start == CM_ON_TRIANGLE && !cm_is_equiangular(p)) return scattered || p.reach > 0.0f;  // from above it
  float reach = p.event == CM_EVENT_COLLISION ? p.t : p.reach;
  return cm_bvh_near(cm_from_cube_point(p.o), cm_to_world(p.d), 0.0f, reach);
}

// Returns true if the BVH must be queried before the traversal, because the emission collected along the ray depends on
// where it ends.
CM_FN bool cm_asks_first(CmPath p) {
  if (p.ray != CM_RAY_SCATTERED || p.found != CM_FOUND_NOT_ASKED) return false;
  if (p.bounces == 0u && cm.layers.count != 0u) return false;
  return p.start == CM_ON_TRIANGLE || cm_bvh_near(cm_from_cube_point(p.o), cm_to_world(p.d), 0.0f, p.reach);
}

// Intersects the ray with the triangles.
CM_FN void cm_intersect(CM_INOUT(CmPath) p) {
  bool scattered = p.ray == CM_RAY_SCATTERED;
  bool first = scattered && cm.medium.emits != 0u;
  vec3 d = cm_to_world(p.d);
  vec3 o = cm_from_cube_point(p.o);
  if (p.start == CM_ON_TRIANGLE && p.ray != CM_RAY_EQUIANGULAR) {
    vec3 shift;
    bool lifts = !cm_came_through(p);
    o = cm_surface_origin(p.triangle, p.weights, p.behind != 0u, lifts, d, shift);
    // The shadow ray ends where a ray from the point itself would: at a light.
    if (!scattered) d -= shift / p.reach;
  }
  cm_hit_seed = p.random + p.ray;  // differs between a shadow ray and the scattered ray after it
  cm_hit_camera = scattered && p.bounces == 0u;
  CmHit hit;
  float reach = !first && p.event == CM_EVENT_COLLISION ? p.t : p.reach;
#if CM_CLEAR_SURFACES
  cm_hit_direction = normalize(d);
  bool is_hit = false;
  // Camera and scattered rays are traced again up to their hit: on the way to it the BVH also visited surfaces behind
  // it.
  for (int turn = 0; turn < 2; ++turn) {
    CmHit found;
    cm_hit_passed = vec3(1.0f);
    bool ends = cm_trace_models(o, d, 0.0f, turn == 0 ? reach : hit.t, !scattered, found);
    if (turn == 0) {
      is_hit = ends;
      hit = found;
    }
    if (!(is_hit && scattered) || cm_hit_passed == vec3(1.0f)) break;
  }
  if (scattered) p.throughput *= cm_hit_passed;
  if (!scattered || p.bounces == 0u) p.light *= cm_hit_passed;
#else
  bool is_hit = cm_trace_models(o, d, 0.0f, reach, !scattered, hit);
#endif
#if CM_EXTENDED_BSDF
  cm_absorb(p, is_hit, hit);
#endif
  if (is_hit && !scattered) p.event = CM_EVENT_COLLISION;
  if (is_hit && scattered) {
    p.triangle = hit.triangle;
    p.weights = hit.barycentrics;
    p.back = hit.front ? 0u : 1u;
  }
  if (first) {
    p.found = is_hit ? CM_FOUND_TRIANGLE : CM_FOUND_NONE;
    if (is_hit) p.reach = hit.t;
  }
  bool vertex = scattered ? is_hit : p.start == CM_ON_TRIANGLE;
  p.stage = first ? CM_STAGE_AIM : (vertex ? CM_STAGE_VERTEX : CM_STAGE_EVENT);
}

CM_FN CmVertex cm_in_medium() {
  CmVertex vertex;
  vertex.on_triangle = false;
  return vertex;
}

// Shading data of the triangle that the path is on or has hit. Reads only w and CM_PATH_ENDS of p.
CM_FN CmVertex cm_on_triangle(CmPath p) {
  CmVertex vertex;
  vertex.on_triangle = true;
  vertex.surface = cm_surface_point(p.triangle, p.weights, p.w, p.back != 0u);
  // Path space regularization: Kaplanyan and Dachsbacher 2013.
  if (p.blurred != 0u) {
    float least = cm.integrator.blurred_roughness;
    vertex.surface.material.roughness = max(vertex.surface.material.roughness, least);
#if CM_EXTENDED_BSDF
    // Clear surfaces still transmit without blur.
    if (vertex.surface.kept == 1.0f) {
      vertex.surface.material.alpha = max(vertex.surface.material.alpha, vec2(cm_alpha(least)));
    }
#endif
    vertex.surface.material.clearcoat_roughness = max(vertex.surface.material.clearcoat_roughness, least);
  }
#if CM_EXTENDED_BSDF
  cm_bound(p, vertex);
#endif
  return vertex;
}

// Distance that a finished ray covered.
CM_FN float cm_scattered_end(CmPath p, CmVertex vertex) {
  if (vertex.on_triangle) return dot(vertex.surface.position - cm_from_cube_point(p.o), p.w);
  return p.event == CM_EVENT_COLLISION ? p.t : p.t_end;
}

// Adds the emission of the triangle that was hit.
CM_FN void cm_see(CM_INOUT(CmPath) p, CmVertex vertex) {
  vec3 emission = vertex.surface.emission;
#if CM_EXTENDED_BSDF
  if (cm.medium.emits != 0u) {
    uint within = p.within == 0u && vertex.leaves ? vertex.bounds : p.within;
    p.throughput *= cm_transmittance_within(within, max(0.0f, cm_scattered_end(p, vertex)));
  }
#endif
  // The triangle may also be found by NEE at the previous vertex, whatever medium is between: weigh by the balance
  // heuristic. If the ray's origin was lifted above its triangle, the two see the light at different angles, and only
  // NEE counts.
  if (CM_SURFACES > 1 && p.bounces > 0u && !vertex.surface.unlit) {
    CmLightHit hit = cm_light_hit(CM_LIGHT_TRIANGLE, p.o, p.w, p.pdf);
    hit.triangle = p.triangle;
    hit.point = vertex.surface.position;
    hit.normal = vertex.surface.geometric;
    emission *= p.lifted != 0u ? 0.0f : cm_balance(p.pdf, cm_nee_pdf(p, hit));
  }
  p.radiance += p.throughput * emission;
#if CM_GROUPS
  cm_add_to_group(cm_models[cm_model_of(p.triangle)].group, p.throughput * emission);
#endif
}

// Moves the path to the triangle that it hit, after cm_arrive. Returns true if the path ends there.
CM_FN bool cm_stand(CM_INOUT(CmPath) p, CmVertex vertex) {
  p.o = cm_to_cube_point(vertex.surface.position);
  p.start = CM_ON_TRIANGLE;
  p.behind = vertex.surface.behind ? 1u : 0u;
  return vertex.surface.unlit;
}

// Origin of light samples, world space.
CM_FN vec3 cm_nee_origin(CmPath p, CmVertex vertex) {
  if (vertex.on_triangle) return cm_offset_origin(vertex.surface.position, vertex.surface.geometric);
  return cm_from_cube_point(p.o);
}

// Samples a direction for the scattered ray. From triangles, some samples are aimed at the bounds of the emissive
// medium.
CM_FN vec3 cm_sample_direction(CM_INOUT(CmPath) p, CmVertex vertex, CmDraw draw) {
  float u_0 = draw.u_direction.x;
  float u_1 = draw.u_direction.y;
  if (!vertex.on_triangle) return cm_scattered_ray(p, draw);
  float u_3 = draw.u_choice;
  float to_emissive = cm.lights.emissive_probability;
  bool aimed = u_3 < to_emissive;
  u_3 = aimed ? u_3 / to_emissive : (u_3 - to_emissive) / (1.0f - to_emissive);
  vec3 w = cm_surface_sample(vertex.surface, p.w, u_0, u_1, u_3);
  return aimed ? cm_emissive_direction(p.o, vec3(u_0, u_1, u_3), w) : w;
}

CM_FN CmScatterSample cm_scatter_sample(CmPath p, CmVertex vertex, vec3 wi) {
  CmScatterSample scatter;
  scatter.lifted = false;
#if CM_EXTENDED_BSDF
  scatter.through = false;
  scatter.disperses = false;
#endif
  if (vertex.on_triangle) {
    scatter.share = cm_surface_eval(vertex.surface, p.w, wi);
    scatter.lobe_pdf = cm_surface_pdf(vertex.surface, p.w, wi);
    scatter.pdf = (1.0f - cm.lights.emissive_probability) * scatter.lobe_pdf +
                   cm_light_pdf(cm_light_hit(CM_LIGHT_EMISSIVE, p.o, wi, scatter.lobe_pdf));
    scatter.lifted = vertex.surface.lifted && cm_lift_share(dot(vertex.surface.geometric, wi)) > 0.0f;
#if CM_EXTENDED_BSDF
    scatter.through = vertex.surface.material.transmission > 0.0f && dot(vertex.surface.geometric, wi) < 0.0f;
    scatter.lifted = scatter.lifted && !scatter.through;
    scatter.disperses = vertex.disperses && (scatter.through || vertex.leaves);
    if (scatter.disperses) scatter.share *= vertex.color;
#endif
  } else {
    scatter.lobe_pdf = cm_scattered(p, wi);
    scatter.pdf = cm_scattered_ray_pdf(p, wi);
    scatter.share = vec3(scatter.lobe_pdf);
  }
  scatter.weight = scatter.pdf > 0.0f ? scatter.share / scatter.pdf : vec3(0.0f);
  return scatter;
}

#if CM_EXTENDED_BSDF

// Sets the side of the ray's origin, and for a scattered ray the volume that it is in.
CM_FN void cm_leave_surface(CM_INOUT(CmPath) p, CmVertex vertex, CmScatterSample scatter, bool to_light) {
  p.through = scatter.through ? 1u : 0u;
  if (!vertex.on_triangle) return;
  p.behind = vertex.surface.behind != scatter.through ? 1u : 0u;
  if (to_light) return;
  if (scatter.through) cm_cross(vertex.bounds, vertex.leaves, p.within, p.outside);
  if (scatter.disperses) p.dispersed = 1u;
}

#endif

// Returns true if the bounce is wider than the lobe of a surface with the minimum roughness. The bound is a quarter of
// that lobe's peak pdf. Diffuse surfaces always count as wide.
CM_FN bool cm_blurs(CmScatterSample scatter) {
  float alpha = cm_alpha(cm.integrator.blurred_roughness);
  return scatter.lobe_pdf < max(0.35f, 0.25f * CM_INV_PI * 0.25f / (alpha * alpha));
}

#else

struct CmVertex {
  bool on_triangle;  // never
};

CM_FN bool cm_came_through(CmPath p) { return false; }
CM_FN bool cm_asks(CmPath p) { return false; }
CM_FN bool cm_asks_first(CmPath p) { return false; }
CM_FN void cm_intersect(CM_INOUT(CmPath) p) {}
CM_FN CmVertex cm_in_medium() { return CmVertex(false); }
CM_FN void cm_see(CM_INOUT(CmPath) p, CmVertex vertex) {}
CM_FN bool cm_stand(CM_INOUT(CmPath) p, CmVertex vertex) { return false; }
CM_FN bool cm_blurs(CmScatterSample scatter) { return false; }
CM_FN float cm_scattered_end(CmPath p, CmVertex vertex) { return p.event == CM_EVENT_COLLISION ? p.t : p.t_end; }
CM_FN vec3 cm_nee_origin(CmPath p, CmVertex vertex) { return cm_from_cube_point(p.o); }

CM_FN vec3 cm_sample_direction(CM_INOUT(CmPath) p, CmVertex vertex, CmDraw draw) {
  return cm_scattered_ray(p, draw);
}

CM_FN CmScatterSample cm_scatter_sample(CmPath p, CmVertex vertex, vec3 wi) {
  CmScatterSample scatter;
  scatter.pdf = cm_scattered_ray_pdf(p, wi);
  scatter.lobe_pdf = cm_scattered(p, wi);
  scatter.share = vec3(scatter.lobe_pdf, scatter.lobe_pdf, scatter.lobe_pdf);
#if CM_GROUND_AIMS
  scatter.weight = scatter.pdf > 0.0f ? scatter.share / scatter.pdf : vec3(0.0f, 0.0f, 0.0f);
#else
  scatter.weight = vec3(1.0f, 1.0f, 1.0f);
#endif
  scatter.lifted = false;
  return scatter;
}

#endif

#endif
