// The path tracer: one path at a time, as a machine that can stop after any number of steps and go on later with the
// same result. Shared by GLSL and C++; the includer provides
//   cm                                            the parameters
//   uvec3 cm_march_enter(vec3 p)                  the cell (or voxel) that holds point p of cube space
//   void cm_march_step(uvec3 cell, o, d, inv_d, t, t_1, r_0, r_1, next)
//   float cm_surface_z(uvec2 pixel, vec2 within, uint layer)   view depth of the host's surface there
// which gives the part of the ray inside the cell, from t to t_1, the density at both ends (linear between them), and
// the next cell; next.x == CM_NONE outside. The third word of a cell is the march's own cache, CM_NONE when unknown.
//
// Free paths are sampled exactly: an optical depth -ln(1 - u) is used up along the march; inside a cell the depth is a
// quadratic in t, inverted in closed form. No majorant, no step size.
//
// With CM_SURFACES 1 flights end at triangles as well, and go on from them; the includer then has bvh.glsl, bsdf.glsl and
// surface.glsl before this. With 2 next-event estimates are for emissive triangles, too. With CM_LAYERS 1 (which
// CM_SURFACES implies) camera rays may end at the surface pass instead:
//   float cm_layer_surface(uvec2 pixel, vec2 within, uint sample_number, float u, out vec4 colour)   its view depth
// With CM_AOVS 1 samples that first met the volume are summed apart, too.
#ifndef CM_PATH_GLSL
#define CM_PATH_GLSL

#define CM_MODE_START 0u
#define CM_MODE_FLIGHT 1u
#define CM_MODE_SHADOW_SUN 2u
#define CM_MODE_SHADOW_SKY 3u
#define CM_MODE_DONE 4u

// A bit of CmPath::bounce: the path was scattered wider than a surface with the least roughness of albedo.w does.
#define CM_BLURRED 0x80000000u

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

struct CmPath {
  vec3 o;           // cube space
  float t;          // world distance from o
  vec3 d;           // cube space, per unit of world distance
  float depth;      // optical depth left before the collision (or the end of the shadow ray)
  vec3 w;           // world direction of flight, kept during shadow rays
  float depth_0;    // optical depth at the ray's start
  vec3 throughput;
  uint mode;
  vec3 radiance;    // of this sample so far
  uint bounce;      // events of the path so far, and CM_BLURRED
  vec3 light;       // what the shadow ray carries if nothing stops it; of a flight, x: density of its direction
  uint random;
  uvec3 cell;
  float t_end;      // where the ray leaves the box
  uint stream;
  uvec2 home;       // the cell of o, while a shadow ray is under way; x: CM_NONE where o is on a surface, and on a camera
                    // ray 1 where a layer's colour, in light, waits at its end
  uint samples;     // finished in this pixel
  uint steps;       // of all its samples
  uint marches;     // calls of cm_march so far, for who counts them
  float square;     // sum over its samples of their squared luminance
#if CM_AOVS
  uint in_volume;   // 1 once this sample has met the volume first
  vec4 volume;      // sum of such samples, as cm_finish's
#endif
#if CM_SURFACES
  uint triangle;    // that o is on, if it is on one
  vec2 weights;     // of its second and third vertex
  uint behind;      // 1 where the path met the side from which its vertices turn clockwise
  float reach;      // the ray's own end: a lamp, the host's surface; t_end < 0: cm_begin_ray is due
#endif
};

CM_FN vec3 cm_to_cube(vec3 v) { return cm.grid.to_cube_x * v.x + cm.grid.to_cube_y * v.y + cm.grid.to_cube_z * v.z; }

// Where a ray is inside the box: t.x to t.y, empty if t.x > t.y.
CM_FN vec2 cm_box_range(vec3 o, vec3 d) {
  float t_in = 0.0f;
  float t_out = 3.0e38f;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] != 0.0f) {
      float a = (cm.grid.box_min[axis] - o[axis]) / d[axis];
      float b = (cm.grid.box_max[axis] - o[axis]) / d[axis];
      t_in = max(t_in, min(a, b));
      t_out = min(t_out, max(a, b));
    } else if (o[axis] < cm.grid.box_min[axis] || o[axis] > cm.grid.box_max[axis]) {
      t_out = -1.0f;
    }
  }
  return vec2(t_in, t_out);
}

// The ray through a point of a pixel: o in cube space, w a unit vector in world space. Returns the distance along it per
// unit of view depth.
CM_FN float cm_camera_ray(uvec2 pixel, vec2 within, CM_OUT(vec3) o, CM_OUT(vec3) w) {
  float x = 2.0f * (float(pixel.x) + within.x) / float(cm.view.size.x) - 1.0f;
  float y = 1.0f - 2.0f * (float(pixel.y) + within.y) / float(cm.view.size.y);
  vec3 aside = x * cm.view.right + y * cm.view.up;
  vec3 v = cm.view.forward + (1.0f - float(cm.view.orthographic)) * aside;
  o = cm.view.eye + float(cm.view.orthographic) * cm_to_cube(aside);
  w = normalize(v);
  return length(v);
}

// The optical depth of the first `way` of a cell's part of a ray, span long, with extinctions e_0 and e_1 at its ends.
CM_FN float cm_depth_of(float e_0, float e_1, float span, float way) {
  float part = clamp(way / max(span, 1e-30f), 0.0f, 1.0f);
  return (e_0 + 0.5f * (e_1 - e_0) * part) * part * span;
}

// How far into a cell's part of a ray, span long, with extinctions e_0 and e_1 at its ends, this optical depth is used up:
// e_0 s + (e_1 - e_0) s^2 / (2 span) = depth, in the form that loses nothing.
CM_FN float cm_depth_distance(float e_0, float e_1, float span, float depth) {
  float root = sqrt(max(0.0f, e_0 * e_0 + 2.0f * (e_1 - e_0) / span * depth));
  return min(span, 2.0f * depth / (e_0 + root));
}

// Marches at most CM_CHUNK cells. Leaves t, cell and depth at the event, or where it got.
CM_FN uint cm_march(CM_INOUT(CmPath) p) {
  vec3 inv_d = vec3(1.0f, 1.0f, 1.0f) / p.d;
  p.marches += 1u;
  uint event = CM_EVENT_NONE;
  float e_0 = 0.0f;
  float e_1 = 0.0f;
  float span = 0.0f;
#if CM_SURFACES
  if (p.cell.x == CM_NONE) event = CM_EVENT_ESCAPE;
#endif
  for (int i = 0; i < CM_CHUNK && event == CM_EVENT_NONE; ++i) {
    float t_1 = 0.0f;
    float r_0 = 0.0f;
    float r_1 = 0.0f;
    uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
    cm_march_step(p.cell, p.o, p.d, inv_d, p.t, t_1, r_0, r_1, next);
    p.steps += 1u;
    e_0 = cm.medium.extinction * r_0;
    e_1 = cm.medium.extinction * r_1;
    span = t_1 - p.t;
    float used = 0.5f * (e_0 + e_1) * span;
#if CM_SURFACES
    // To a surface or a lamp inside the cell, not beyond.
    used = t_1 > p.t_end ? cm_depth_of(e_0, e_1, span, p.t_end - p.t) : used;
#endif
    if (used > p.depth) {
      event = CM_EVENT_COLLISION;
    } else {
      p.depth -= used;
      p.t = t_1;
      p.cell = next;
      if (next.x == CM_NONE || t_1 >= p.t_end) event = CM_EVENT_ESCAPE;
    }
  }
  // After the loop, not in it: software drivers run both sides of every branch, each step.
  if (event == CM_EVENT_COLLISION) {
    float left = p.t_end - p.t;
    float way = cm_depth_distance(e_0, e_1, span, p.depth);
    p.t += way;
    p.depth = way < left ? -1.0f : max(0.0f, p.depth - cm_depth_of(e_0, e_1, span, left));
    if (way >= left) event = CM_EVENT_ESCAPE;  // behind a surface
#if !CM_SURFACES
  } else if (event == CM_EVENT_ESCAPE && p.t > p.t_end) {
    p.depth += cm_depth_of(e_1, e_0, span, p.t - p.t_end);
#endif
  }
  return event;
}

// What lies behind the volume is added to the finished picture, not here.
CM_FN void cm_finish(CM_INOUT(CmPath) p, CM_INOUT(vec4) sum) {
#if CM_LAYERS
  float alpha = p.bounce > 0u || p.home.x == 1u ? 1.0f : 0.0f;
#else
  float alpha = p.bounce > 0u ? 1.0f : 0.0f;
#endif
#if CM_AOVS
  if (p.in_volume != 0u) p.volume += vec4(p.radiance, 1.0f);
#endif
  sum += vec4(p.radiance, alpha);
  float luminance = dot(p.radiance + (1.0f - alpha) * cm.lights.sky_radiance, vec3(0.2126f, 0.7152f, 0.0722f));
  p.square += luminance * luminance;
  p.samples += 1u;
  p.mode = p.samples >= cm.dispatch.samples ? CM_MODE_DONE : CM_MODE_START;
}

#if CM_SURFACES
// Begins a ray from o along d: its way through the box, as far as it reaches.
CM_FN void cm_begin_ray(CM_INOUT(CmPath) p) {
  vec2 range = cm_box_range(p.o, p.d);
  p.t = range.x;
  p.t_end = max(0.0f, min(range.y, p.reach));
  bool inside = p.home.x != CM_NONE && p.bounce > 0u;
  p.cell = uvec3(CM_NONE, 0u, CM_NONE);
  if (range.x < p.t_end) {
    p.cell = uvec3(p.home.x, p.home.y, CM_NONE);
    if (!inside) p.cell = cm_march_enter(clamp(p.o + range.x * p.d, cm.grid.box_min, cm.grid.box_max));
  }
}

// The density, by solid angle, of directions w (world) from o (cube space) to points of the box, each as likely: the
// integral of t^2 over the ray's part inside, over the box's volume.
CM_FN float cm_glow_density(vec3 o, vec3 w) {
  vec2 range = cm_box_range(o, cm_to_cube(w));
  vec3 box = cm.grid.box_max - cm.grid.box_min;
  float cubes = max(0.0f, range.y - range.x) * (dot(range, range) + range.x * range.y);
  return cubes / max(3.0f * cm.grid.unit_volume * box.x * box.y * box.z, 1e-30f);
}

// Whether a triangle ends the ray before the event does: then o, once moved, is on it. Asked after the march, not before:
// in a dense medium the way to a collision is short, and few boxes are near it; and most shadow rays end in the medium.
CM_FN bool cm_meet(CM_INOUT(CmPath) p, uint event) {
  bool flight = p.mode == CM_MODE_FLIGHT;
  if (event == CM_EVENT_NONE || (event == CM_EVENT_COLLISION && !flight)) return false;
  if (p.bounce == 0u && cm.layers.count != 0u) return false;
  vec3 d = cm_to_world(p.d);
  vec3 o = cm_from_cube_point(p.o);
  if (p.home.x == CM_NONE) {
    vec3 shift;
    o = cm_surface_origin(p.triangle, p.weights, p.behind != 0u, d, shift);
    // Shadow rays end where they would from the point itself: at a lamp.
    if (!flight) d -= shift / p.reach;
  }
  cm_hit_seed = p.random;
  cm_hit_camera = p.bounce == 0u;
  CmHit hit;
  bool met = cm_bvh_trace(o, d, 0.0f, event == CM_EVENT_COLLISION ? p.t : p.reach, !flight, hit);
  if (met && flight) {
    p.triangle = hit.triangle;
    p.weights = hit.barycentrics;
    cm_hit_back = !hit.front;
  }
  if (met && !flight) p.light = vec3(0.0f, 0.0f, 0.0f);
  return met && flight;
}
#endif

// A camera ray for the next sample; finishes at once if it meets nothing of the box.
CM_FN void cm_start(CM_INOUT(CmPath) p, uvec2 pixel, CM_INOUT(vec4) sum) {
  uvec3 h = cm_hash3(uvec3(pixel.y * cm.view.size.x + pixel.x, p.samples, cm.integrator.seed));
  p.random = h.x;
  p.stream = h.y | 1u;
  // A pixel's samples spread evenly over its area and over the first free path: the three-dimensional Kronecker sequence
  // of Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018, shifted by a random offset a pixel.
  uvec3 shift = cm_hash3(uvec3(pixel.y * cm.view.size.x + pixel.x, 0x5bd1e995u, cm.integrator.seed));
  uvec3 even = shift + p.samples * uvec3(3518319155u, 2882110345u, 2360945575u);
  vec2 within = vec2(cm_unit_float(even.x), cm_unit_float(even.y));
  float t_per_z = cm_camera_ray(pixel, within, p.o, p.w);
  p.d = cm_to_cube(p.w);
  p.throughput = vec3(1.0f, 1.0f, 1.0f);
  p.radiance = vec3(0.0f, 0.0f, 0.0f);
  p.bounce = 0u;
  p.depth_0 = -log(1.0f - cm_unit_float(even.z));
  p.depth = p.depth_0;
  p.mode = CM_MODE_FLIGHT;
  // Samples go through the layers in turn, each pixel from one of its own.
  uint layer = (shift.x >> 16) + p.samples;
  float surface_t = t_per_z * cm_surface_z(pixel, within, layer);
  p.home = uvec2(0u, 0u);
#if CM_AOVS
  p.in_volume = 0u;
#endif
#if CM_LAYERS
  if (cm.layers.count != 0u) {
    vec4 colour = vec4(0.0f, 0.0f, 0.0f, 0.0f);
    float layer_t = t_per_z * cm_layer_surface(pixel, within, layer, cm_unit_float(h.z), colour);
    bool nearest = layer_t <= surface_t;
    surface_t = min(surface_t, layer_t);
    if (nearest && colour.a > 0.0f && cm.layers.coloured != 0u) {
      p.home.x = 1u;
      p.light = vec3(colour);
    }
  }
#endif
#if CM_SURFACES
  p.reach = surface_t;
  p.t_end = -1.0f;
#else
  vec2 range = cm_box_range(p.o, p.d);
  p.t = range.x;
  p.t_end = min(range.y, surface_t);
  p.cell = cm_march_enter(clamp(p.o + range.x * p.d, cm.grid.box_min, cm.grid.box_max));
  if (!(range.x < p.t_end)) {
#if CM_LAYERS
    if (p.home.x == 1u) p.radiance = p.light;
#endif
    cm_finish(p, sum);
  }
#endif
}

// What follows an event. Software drivers run both sides of every branch, so each costly step stands here once.
// on_surface, a constant where it is called: the path is on a triangle, or has just met one (met: a flight ends there,
// whatever event says).
CM_FN void cm_handle(CM_INOUT(CmPath) p, uint event, bool on_surface, bool met, CM_INOUT(vec4) sum) {
  float q = cm.lights.sky_probability;
  bool flight = p.mode == CM_MODE_FLIGHT;
  bool finished = false;
  if (event == CM_EVENT_ESCAPE && !met) {
    // Sky: the flight escapes with probability T, next-event estimation has density q of the same directions. The
    // balance heuristic gives T / (q + T) to the one, and q / (q + T), times T / q, to the other.
    float depth = p.depth_0 - p.depth;
    float transmittance = exp(-depth);
    float balanced = transmittance / max(q + transmittance, 1e-30f);
    float survival = flight ? 1.0f : min(1.0f, exp(CM_SHADOW_DEPTH - depth));
    float weight = p.mode == CM_MODE_SHADOW_SUN ? transmittance : (p.bounce == 0u ? 0.0f : balanced);
    vec3 light = flight ? p.throughput * cm.lights.sky_radiance : p.light;
    p.radiance += light * (weight / survival);
#if CM_LAYERS
    if (p.bounce == 0u && p.home.x == 1u) p.radiance += p.light;
#endif
    finished = flight;
  }
  bool collided = flight && event == CM_EVENT_COLLISION && !met;
#if CM_SURFACES
  CmSurfacePoint surface;
  if (on_surface) {
    surface = cm_surface_point(p.triangle, p.weights, p.w);
    // Path space regularization: Kaplanyan and Dachsbacher, 2013.
    if ((p.bounce & CM_BLURRED) != 0u) {
      surface.material.roughness = max(surface.material.roughness, cm.integrator.blurred_roughness);
      surface.material.clearcoat_roughness = max(surface.material.clearcoat_roughness, cm.integrator.blurred_roughness);
    }
#if CM_SURFACES > 1
    // The flight that met it, and the next-event estimate before: the balance heuristic, whatever the medium between.
    if (met && p.bounce > 0u && !surface.unlit) {
      vec3 way = surface.position - cm_from_cube_point(p.o);
      float other = cm_emitter_met(p.triangle, way, dot(surface.geometric, p.w));
      other *= (1.0f - q) * cm.lights.emitter_probability;
      surface.emission *= p.light.x / max(p.light.x + other, 1e-30f);
    }
#endif
    if (met) p.radiance += p.throughput * surface.emission;
  }
  // Without light between surfaces: what has left one sees the sky alone, and the volume sees none.
  bool dark = cm.integrator.light_among_surfaces == 0u && p.bounce > 0u && (met || (collided && p.home.x == CM_NONE));
#endif
  // The medium's own light: S e^-x dx over the flight. A collision tells of S (its chance is 1 - e^-x), but seldom in a
  // thin flame. Where the depth x that a flight came through is known, 2 S (1 - e^-x) where it collides and S (1 - e^-x)
  // where it does not have the same mean, and next to no noise in thin flames.
#if CM_SURFACES
  float glow = collided && !dark ? 1.0f : 0.0f;  // a triangle may be nearer than the march has been
#else
  float glow = flight && event != CM_EVENT_NONE ? 1.0f - exp(max(0.0f, p.depth) - p.depth_0) : 0.0f;
  if (collided) glow *= 2.0f;
#endif
  vec3 glowing = p.throughput * (glow * cm.medium.source);
  p.radiance += glowing;
#if CM_AOVS
  if (p.bounce == 0u && !collided) p.volume += vec4(glowing, 0.0f);
#endif
  if (collided || met) {
#if CM_AOVS
    if (collided && p.bounce == 0u) p.in_volume = 1u;
#endif
    p.bounce += 1u;
    if (collided) p.throughput *= cm.medium.albedo;
    float strongest = max(p.throughput.x, max(p.throughput.y, p.throughput.z));
    float survival = strongest < 0.5f ? max(strongest, 0.05f) : 1.0f;
    float u = cm_random(p.random, p.stream);
    bool last = cm.integrator.max_bounces != 0u && (p.bounce & ~CM_BLURRED) > cm.integrator.max_bounces;
    finished = !(strongest > 0.0f) || u >= survival || last;
    p.throughput = p.throughput / survival;
    p.o = p.o + p.t * p.d;
    p.home = uvec2(p.cell.x, p.cell.y);
#if CM_SURFACES
    if (met) {
      p.o = cm_to_cube_point(surface.position);
      p.home.x = CM_NONE;
      p.behind = surface.behind ? 1u : 0u;
      finished = finished || surface.unlit;
    }
    finished = finished || dark;
#endif
  }
  if (finished) cm_finish(p, sum);
  if (!finished && event != CM_EVENT_NONE) {
    // A shadow ray after a collision (if there is light), a new flight after that: each along a direction of the phase
    // function, but for the sun's. One next-event estimate: to the sky with probability q, else to the sun.
    float u_0 = cm_random(p.random, p.stream);
    float u_1 = cm_random(p.random, p.stream);
    float u_2 = cm_random(p.random, p.stream);
    vec3 w = cm_around(p.w, cm_phase_cosine(cm.medium.anisotropy, u_0), 6.28318531f * u_1);
    bool shadow = (collided || met) && cm.lights.any != 0u;
    bool to_sun = shadow && u_2 >= q;
    vec3 sky_light = cm.lights.sky_radiance;
    vec3 sun_light = cm.lights.sun_irradiance;
    vec3 to_light = cm.lights.sun_direction;
#if CM_SURFACES
    float light_distance = 3.0e38f;
    float light_density = 1.0f - q;
    vec3 here = cm_from_cube_point(p.o);
#if CM_SURFACES > 1
    bool emitter = false;
#endif
    if (to_sun && (cm.surfaces.lamp_count > 0u || CM_SURFACES > 1)) {
      float u_light = cm_random(p.random, p.stream);
#if CM_SURFACES > 1
      float share = cm.lights.emitter_probability;
      emitter = u_light < share;
      light_density *= emitter ? share : 1.0f - share;
      u_light = max(0.0f, u_light - share) / max(1.0f - share, 1e-6f);
#endif
      cm_lamp(here, u_light, sun_light, to_light, light_distance);
    }
#if CM_SURFACES > 1
    if (emitter) {
      uvec2 words = uvec2(cm_hash3(uvec3(p.random, p.stream, 0x1b56c4e9u)));
      float u_a = cm_random(p.random, p.stream);
      float u_b = cm_random(p.random, p.stream);
      if (on_surface) here = cm_offset_origin(surface.position, surface.geometric);
      float density = 1.0f;
      sun_light = cm_emitter_sample(here, words, vec2(u_a, u_b), to_light, light_distance, density);
      light_density *= density;
    }
#endif
    // Of the direction that the ray takes: the share of its light that goes on, and the density of flights.
    vec3 facing = vec3(0.0f, 0.0f, 0.0f);
    float lobe_density = 0.0f;
    float direction_density = 0.0f;
#if CM_SURFACES > 1
    bool happened_on = true;  // flights along it may count what they meet of the emissive triangles
#endif
    if (on_surface) {
      float u_3 = cm_random(p.random, p.stream);
      // A glowing medium is looked for by half of the flights: towards a point of its box, each as likely.
      float to_glow = cm.lights.glow_probability;
      bool guided = u_3 < to_glow;
      u_3 = guided ? u_3 / to_glow : (u_3 - to_glow) / (1.0f - to_glow);
      vec3 goal = mix(cm.grid.box_min, cm.grid.box_max, vec3(u_0, u_1, u_3));
      vec3 to_goal = cm_to_world(goal - p.o);
      w = cm_surface_sample(surface, p.w, u_0, u_1, u_3);
      if (guided && dot(to_goal, to_goal) > 0.0f) w = normalize(to_goal);
      vec3 wi = to_sun ? to_light : w;
      facing = cm_surface_eval(surface, p.w, wi);
      lobe_density = cm_surface_pdf(surface, p.w, wi);
      direction_density = lobe_density + to_glow * (cm_glow_density(p.o, wi) - lobe_density);
#if CM_SURFACES > 1
      // Rays that start above the triangle see a lamp at another angle than it is looked for: that alone counts then.
      happened_on = !surface.lifted || cm_lift_share(dot(surface.geometric, wi)) <= 0.0f;
#endif
    } else {
      lobe_density = cm_phase(cm.medium.anisotropy, dot(p.w, to_sun ? to_light : w));
      direction_density = lobe_density;
      facing = vec3(lobe_density, lobe_density, lobe_density);
    }
    vec3 scattered = direction_density > 0.0f ? facing / direction_density : vec3(0.0f, 0.0f, 0.0f);
#if CM_SURFACES > 1
    if (emitter && happened_on) light_density += direction_density;
#endif
    sky_light *= scattered;
    if (!shadow) {
      p.throughput *= scattered;
      // A quarter of the lobe's highest density with that roughness, and no matte surface is smooth.
      float alpha = cm_alpha(cm.integrator.blurred_roughness);
      if (lobe_density < max(0.35f, 0.25f * CM_INV_PI * 0.25f / (alpha * alpha))) p.bounce |= CM_BLURRED;
    }
#else
    float facing = cm_phase(cm.medium.anisotropy, dot(p.w, to_light));
    float light_density = 1.0f - q;
#endif
    p.light = p.throughput * (to_sun ? sun_light * (facing / max(light_density, 1e-30f)) : sky_light);
#if CM_SURFACES > 1
    if (!shadow) p.light.x = happened_on ? direction_density : 1e-30f;
#endif
#if CM_SURFACES
    p.d = cm_to_cube(to_sun ? to_light : w);
#else
    p.d = to_sun ? cm.lights.sun_in_cube : cm_to_cube(w);
#endif
    if (!shadow) p.w = w;
    p.mode = to_sun ? CM_MODE_SHADOW_SUN : (shadow ? CM_MODE_SHADOW_SKY : CM_MODE_FLIGHT);
    p.depth_0 = cm_random_depth(p.random, p.stream) + (shadow ? CM_SHADOW_DEPTH : 0.0f);
    p.depth = p.depth_0;
    p.t = 0.0f;
#if CM_SURFACES
    p.reach = to_sun ? light_distance : 3.0e38f;
    if (shadow && !(max(p.light.x, max(p.light.y, p.light.z)) > 0.0f)) p.reach = 0.0f;  // no light to look for
    p.t_end = -1.0f;
#else
    p.t_end = cm_box_range(p.o, p.d).y;
    p.cell = uvec3(p.home.x, p.home.y, CM_NONE);
#endif
  }
}

// At most `iterations` rounds of this pixel's samples; a round is a camera ray, if one is due, and a few events.
CM_FN void cm_run(CM_INOUT(CmPath) p, uvec2 pixel, uint iterations, CM_INOUT(vec4) sum) {
  for (uint i = 0u; i < iterations && p.mode != CM_MODE_DONE; ++i) {
    if (p.mode == CM_MODE_START) cm_start(p, pixel, sum);
#if CM_SURFACES
    // Surfaces are shaded once a round: all lanes pay for what one needs, on software drivers always.
    uint event = CM_EVENT_NONE;
    bool met = false;
    bool waits = false;
    for (int j = 0; j < CM_EVENTS && p.mode != CM_MODE_START && p.mode != CM_MODE_DONE && !waits; ++j) {
#else
    for (int j = 0; j < CM_EVENTS && p.mode != CM_MODE_START && p.mode != CM_MODE_DONE; ++j) {
#endif
#if CM_SURFACES
      if (p.t_end < 0.0f) cm_begin_ray(p);
      event = cm_march(p);
      met = cm_meet(p, event);
      waits = event != CM_EVENT_NONE && (met || (p.mode != CM_MODE_FLIGHT && p.home.x == CM_NONE));
      if (!waits) cm_handle(p, event, false, false, sum);
#else
      uint event = cm_march(p);
      cm_handle(p, event, false, false, sum);
#endif
    }
#if CM_SURFACES
    if (waits) cm_handle(p, event, true, met, sum);
#endif
  }
}

#endif
