// The path tracer: one path at a time, as a machine that can stop after any number of steps and go on later with the
// same result. Shared by GLSL and C++; the includer provides
//   cm                                            the parameters
//   uvec3 cm_march_enter(vec3 p)                  the cell (or voxel) that holds point p of cube space
//   void cm_march_step(uvec3 cell, o, d, inv_d, t, t_1, r_0, r_1, next)
//   float cm_surface_z(uvec2 pixel, vec2 within, uint layer)   view depth of the host's surface there
// which gives the part of the ray inside the cell, from t to t_1, the density at both ends (linear between them), and
// the next cell; next.x == CM_NONE outside. The third word of a cell is the march's own cache, CM_NONE when unknown.
//
// The stages: cm_camera, cm_aim, cm_fly, cm_meet, and cm_handle, which is cm_escape, cm_glow, cm_arrive and cm_scatter.
// glsl/path_vertex.glsl has what differs where there are triangles.
//
// Free paths are sampled exactly: an optical depth -ln(1 - u) is used up along the march; inside a cell the depth is a
// quadratic in t, inverted in closed form. No majorant, no step size.
//
// With CM_SURFACES 1 flights end at triangles as well, and go on from them; the includer then has bvh.glsl, bsdf.glsl
// and surface.glsl before this. With 2 next-event estimates are for emissive triangles, too. With CM_LAYERS 1 (which
// CM_SURFACES implies) camera rays may end at the surface pass instead:
//   float cm_layer_surface(uvec2 pixel, vec2 within, uint sample_number, float u, out vec4 colour)   its view depth
// With CM_AOVS 1 samples that first met the volume are summed apart, too.
#ifndef CM_PATH_GLSL
#define CM_PATH_GLSL

#include "ray.glsl"
#include "path_state.glsl"
#include "light.glsl"
#include "path_vertex.glsl"

// Marches at most CM_CHUNK cells. Leaves t, cell and depth at the event, or where it got.
CM_FN uint cm_fly(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel) {
  vec3 inv_d = vec3(1.0f, 1.0f, 1.0f) / p.d;
  pixel.marches += 1u;
  uint event = CM_SURFACES != 0 && p.cell.x == CM_NONE ? CM_EVENT_ESCAPE : CM_EVENT_NONE;
  uvec3 cell = uvec3(p.cell.x, p.cell.y, p.cache);
  float e_0 = 0.0f;
  float e_1 = 0.0f;
  float span = 0.0f;
  for (int i = 0; i < CM_CHUNK && event == CM_EVENT_NONE; ++i) {
    float t_1 = 0.0f;
    float r_0 = 0.0f;
    float r_1 = 0.0f;
    uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
    cm_march_step(cell, p.o, p.d, inv_d, p.t, t_1, r_0, r_1, next);
    pixel.steps += 1u;
    e_0 = cm.medium.extinction * r_0;
    e_1 = cm.medium.extinction * r_1;
    span = t_1 - p.t;
    float used = 0.5f * (e_0 + e_1) * span;
    // To a surface or a lamp inside the cell, not beyond.
    if (CM_SURFACES != 0 && t_1 > p.t_end) used = cm_depth_of(e_0, e_1, span, p.t_end - p.t);
    if (used > p.depth) {
      event = CM_EVENT_COLLISION;
    } else {
      p.depth -= used;
      p.t = t_1;
      cell = next;
      if (next.x == CM_NONE || t_1 >= p.t_end) event = CM_EVENT_ESCAPE;
    }
  }
  p.cell = uvec2(cell.x, cell.y);
  p.cache = cell.z;
  // After the loop, not in it: software drivers run both sides of every branch, each step.
  if (event == CM_EVENT_COLLISION) {
    float left = p.t_end - p.t;
    float way = cm_depth_distance(e_0, e_1, span, p.depth);
    p.t += way;
    p.depth = way < left ? -1.0f : max(0.0f, p.depth - cm_depth_of(e_0, e_1, span, left));
    if (way >= left) event = CM_EVENT_ESCAPE;  // behind a surface
  } else if (CM_SURFACES == 0 && event == CM_EVENT_ESCAPE && p.t > p.t_end) {
    p.depth += cm_depth_of(e_1, e_0, span, p.t - p.t_end);
  }
  return event;
}

// A sample is done: what is in front of the background, and the background itself, apart, for pictures over what a host
// has drawn.
CM_FN void cm_finish(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel) {
  bool covers = p.bounces > 0u || p.at_layer != 0u;
  vec3 background = covers ? vec3(0.0f, 0.0f, 0.0f) : p.light;
  if (p.in_volume != 0u) pixel.volume += vec4(p.radiance, 1.0f);
  if (p.bounces == 0u && p.at_layer != 0u) p.radiance += p.light;
  pixel.sum += vec4(p.radiance, covers ? 1.0f : 0.0f);
  pixel.samples += 1u;
  float share = 1.0f / float(pixel.samples);
  pixel.background += share * (background - pixel.background);
  float luminance = dot(p.radiance + background, vec3(0.2126f, 0.7152f, 0.0722f));
  pixel.square += share * (luminance * luminance - pixel.square);
  p.stage = pixel.samples >= cm.dispatch.samples ? CM_STAGE_DONE : CM_STAGE_CAMERA;
}

// A ray's way through the box, as far as it reaches.
CM_FN void cm_aim(CM_INOUT(CmPath) p) {
  vec2 range = cm_box_range(p.o, p.d);
  p.t = range.x;
  p.t_end = max(0.0f, min(range.y, p.reach));
  p.cell = uvec2(CM_NONE, 0u);
  p.cache = CM_NONE;
  if (range.x < p.t_end) {
    p.cell = p.start_cell;
    if (p.start != CM_IN_MEDIUM) {
      uvec3 cell = cm_march_enter(clamp(p.o + range.x * p.d, cm.grid.box_min, cm.grid.box_max));
      p.cell = uvec2(cell.x, cell.y);
      p.cache = cell.z;
    }
  }
  p.stage = CM_STAGE_FLY;
}

// Where the surface pass ends a camera ray, in units of view depth; and whether its colour waits there.
CM_FN float cm_camera_end(CM_INOUT(CmPath) p, uvec2 at, vec2 within, uint layer, float u) {
  float host_z = cm_surface_z(at, within, layer);
#if CM_LAYERS
  if (cm.layers.count != 0u) {
    vec4 colour = vec4(0.0f, 0.0f, 0.0f, 0.0f);
    float layer_z = cm_layer_surface(at, within, layer, u, colour);
    if (layer_z <= host_z && colour.a > 0.0f && cm.layers.coloured != 0u) {
      p.at_layer = 1u;
      p.light = vec3(colour);
    }
    return min(host_z, layer_z);
  }
#endif
  return host_z;
}

// A camera ray for the pixel's next sample. Without triangles it is aimed at once, and finished if it meets nothing of
// the box.
CM_FN void cm_camera(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel, uvec2 at) {
  uint number = at.y * cm.view.size.x + at.x;
  uvec3 h = cm_hash3(uvec3(number, pixel.samples, cm.integrator.seed));
  p.random = h.x;
  p.stream = h.y | 1u;
  // A pixel's samples spread evenly over its area and over the first free path: the three-dimensional Kronecker
  // sequence of Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018, shifted by a random offset a pixel.
  uvec3 shift = cm_hash3(uvec3(number, 0x5bd1e995u, cm.integrator.seed));
  uvec3 even = shift + pixel.samples * uvec3(3518319155u, 2882110345u, 2360945575u);
  vec2 within = vec2(cm_unit_float(even.x), cm_unit_float(even.y));
  float t_per_z = cm_camera_ray(at, within, p.o, p.w);
  p.d = cm_to_cube(p.w);
  p.throughput = vec3(1.0f, 1.0f, 1.0f);
  p.radiance = vec3(0.0f, 0.0f, 0.0f);
  p.bounces = 0u;
  p.blurred = 0u;
  p.in_volume = 0u;
  p.at_layer = 0u;
  p.light = cm_background_radiance(p.w);
  p.depth_0 = -log(1.0f - cm_unit_float(even.z));
  p.depth = p.depth_0;
  p.ray = CM_RAY_FLIGHT;
  p.start = CM_AT_CAMERA;
  // Samples go through the layers in turn, each pixel from one of its own.
  uint layer = (shift.x >> 16) + pixel.samples;
  p.reach = t_per_z * cm_camera_end(p, at, within, layer, cm_unit_float(h.z));
  p.stage = CM_STAGE_AIM;
  if (CM_SURFACES == 0) {
    cm_aim(p);
    if (p.cell.x == CM_NONE) cm_finish(p, pixel);
  }
}

// A ray has left the box, or come to its end: what it brings. A flight that escapes with transmittance T may have been
// found by a look as well, and what a look has found, with transmittance T, by a flight that escapes.
CM_FN void cm_escape(CM_INOUT(CmPath) p) {
  float depth = p.depth_0 - p.depth;
  float transmittance = exp(-depth);
  if (p.ray == CM_RAY_FLIGHT) {
    if (p.bounces > 0u) p.radiance += p.throughput * cm_far_light(p.o, p.w, p.density, transmittance);
  } else {
    float survival = min(1.0f, exp(CM_SHADOW_DEPTH - depth));
    p.radiance += p.light * (transmittance / (survival * (1.0f + transmittance * p.density)));
  }
}

// The medium's own light: S e^-x dx over the flight. A collision tells of S (its chance is 1 - e^-x), but seldom in a
// thin flame. Where the depth x that a flight came through is known, 2 S (1 - e^-x) where it collides and S (1 - e^-x)
// where it does not have the same mean, and next to no noise in thin flames. Among triangles it is not: one may be
// nearer than the march has been.
CM_FN void cm_glow(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel, bool ended, bool collided) {
  float glow = collided ? 1.0f : 0.0f;
  if (CM_SURFACES == 0) glow = (collided ? 2.0f : (ended ? 1.0f : 0.0f)) * (1.0f - exp(max(0.0f, p.depth) - p.depth_0));
  vec3 glowing = p.throughput * (glow * cm.medium.source);
  p.radiance += glowing;
  if (p.bounces == 0u && !collided) pixel.volume += vec4(glowing, 0.0f);
}

// The path goes on from where it collided or met a triangle, unless Russian roulette or the limit ends it: returns
// whether it does.
CM_FN bool cm_arrive(CM_INOUT(CmPath) p, bool collided) {
  if (collided && p.bounces == 0u) p.in_volume = 1u;
  p.bounces += 1u;
  if (collided) p.throughput *= cm.medium.albedo;
  float strongest = max(p.throughput.x, max(p.throughput.y, p.throughput.z));
  float survival = strongest < 0.5f ? max(strongest, 0.05f) : 1.0f;
  float u = cm_random(p.random, p.stream);
  bool last = cm.integrator.max_bounces != 0u && p.bounces > cm.integrator.max_bounces;
  bool ends = !(strongest > 0.0f) || u >= survival || last;
  p.throughput = p.throughput / survival;
  p.o = p.o + p.t * p.d;
  p.start_cell = p.cell;
  p.start = CM_IN_MEDIUM;
  return ends;
}

// A look for light after a collision or on a triangle, if there is light; a new flight after that.
CM_FN void cm_scatter(CM_INOUT(CmPath) p, CmVertex vertex, bool arrived) {
  float u_0 = cm_random(p.random, p.stream);
  float u_1 = cm_random(p.random, p.stream);
  float u_2 = cm_random(p.random, p.stream);
  bool looks = arrived && cm.lights.any != 0u;
  CmLightSample light = cm_sky_sample(p, p.o, u_2);  // flights go where they might find the sky
  if (looks) light = cm_light_sample(p, cm_look_from(p, vertex), u_2);
  vec3 w = cm_turn_direction(p, vertex, u_0, u_1);
  bool along = light.kind == CM_LIGHT_SKY;
  CmTurn turn = cm_turn(p, vertex, along ? w : light.direction);
  if (along) light = cm_sky_along(w, light.density * turn.density);
  p.density = turn.density;
  if (looks) {
    // What escapes weighs looks and flights with the transmittance that it finds; among triangles, without.
    if (light.kind == CM_LIGHT_TRIANGLE && !turn.lifted) light.density += turn.density;
    float rare = 1.0f / max(light.density, 1e-30f);
    p.light = p.throughput * light.radiance * (turn.share * rare);
    p.density = cm_is_far(light) ? turn.density * rare : 0.0f;
  } else {
    p.throughput *= turn.weight;
    p.w = w;
    if (cm_blurs(turn)) p.blurred = 1u;
  }
  p.lifted = turn.lifted ? 1u : 0u;
  p.d = cm_to_cube(light.direction);
  p.ray = looks ? CM_RAY_TO_LIGHT : CM_RAY_FLIGHT;
  p.depth_0 = cm_random_depth(p.random, p.stream) + (looks ? CM_SHADOW_DEPTH : 0.0f);
  p.depth = p.depth_0;
  p.reach = light.distance;
  if (CM_SURFACES == 0) {
    p.t = 0.0f;
    p.t_end = cm_box_range(p.o, p.d).y;
    p.cell = p.start_cell;
    p.cache = CM_NONE;
  } else {
    if (looks && !(max(p.light.x, max(p.light.y, p.light.z)) > 0.0f)) p.reach = 0.0f;  // no light to look for
    p.stage = CM_STAGE_AIM;
  }
}

// What follows an event. Software drivers run both sides of every branch, so each costly step stands here once.
// on_triangle, a constant where it is called: the path is on a triangle, or has just met one (met: a flight ends there,
// whatever event says).
CM_FN void cm_handle(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel, uint event, bool on_triangle, bool met) {
  bool flight = p.ray == CM_RAY_FLIGHT;
  bool escaped = event == CM_EVENT_ESCAPE && !met;
  bool collided = flight && event == CM_EVENT_COLLISION && !met;
  if (escaped) cm_escape(p);
  bool finished = escaped && flight;
  CmVertex vertex = cm_vertex(p, on_triangle, met);
  // Without light among surfaces: what has left one sees the sky alone, and the volume sees none.
  bool dark = CM_SURFACES != 0 && cm.integrator.light_among_surfaces == 0u && p.bounces > 0u &&
              (met || (collided && p.start == CM_ON_TRIANGLE));
  cm_glow(p, pixel, flight && event != CM_EVENT_NONE, collided && !dark);
  if (collided || met) {
    finished = cm_arrive(p, collided) || dark;
    if (met) finished = cm_stand(p, vertex) || finished;
  }
  if (finished) cm_finish(p, pixel);
  if (!finished && event != CM_EVENT_NONE) cm_scatter(p, vertex, collided || met);
}

// At most so many rounds of this pixel's samples; a round is a camera ray, if one is due, and a few events. Surfaces
// are shaded once a round: all lanes pay for what one needs, on software drivers always.
CM_FN void cm_run(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel, uvec2 at, uint rounds) {
  for (uint i = 0u; i < rounds && p.stage != CM_STAGE_DONE; ++i) {
    if (p.stage == CM_STAGE_CAMERA) cm_camera(p, pixel, at);
    uint event = CM_EVENT_NONE;
    bool met = false;
    bool waits = false;  // for a surface's shading
    for (int j = 0; j < CM_EVENTS && (p.stage == CM_STAGE_AIM || p.stage == CM_STAGE_FLY) && !waits; ++j) {
      if (CM_SURFACES != 0 && p.stage == CM_STAGE_AIM) cm_aim(p);
      event = cm_fly(p, pixel);
      met = cm_meet(p, event);
      waits = CM_SURFACES != 0 && event != CM_EVENT_NONE &&
              (met || (p.ray != CM_RAY_FLIGHT && p.start == CM_ON_TRIANGLE));
      if (!waits) cm_handle(p, pixel, event, false, false);
    }
    if (waits) cm_handle(p, pixel, event, true, met);
  }
}

#endif
