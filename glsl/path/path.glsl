// The path tracer: a state machine per path. It can stop after any number of steps and resume later with the same
// result. Shared by GLSL and C++. The includer provides
//   cm                                            the parameters
//   float cm_surface_z(uvec2 pixel, vec2 within, uint layer)   view depth of the host's surface in that pixel
//
// The stages are functions. This file has cm_camera, cm_handle (which calls cm_end_ray, cm_nee and cm_scatter) and
// cm_finish. glsl/path/path_vertex.glsl has cm_intersect and the code that differs with triangles.
// glsl/path/free_flight.glsl has cm_aim and cm_fly, which traverse the grid. Either one megakernel runs all stages
// (glsl/path/trace.comp), or a wavefront of kernels runs one stage each over a queue of paths
// (glsl/path/path_queue.glsl).
//
// CM_SURFACES 1: rays also end and scatter at triangles; the includer has surface.glsl before this file. CM_SURFACES 2:
// next-event estimation (NEE) also samples emissive triangles. CM_LAYERS 1 (implied by CM_SURFACES): camera rays may
// end at the surface pass instead. The includer then provides
//   float cm_layer_surface(uvec2 pixel, vec2 within, uint sample_number, float u, out vec4 color)   its view depth
// CM_AOVS 1: samples whose camera ray scattered in the volume are also summed separately.
#ifndef CM_PATH_GLSL
#define CM_PATH_GLSL

#include "common/numbers.glsl"
#include "traversal/ray.glsl"
#include "surface/ground.glsl"
#include "path/path_state.glsl"
#include "light/light.glsl"
#include "path/path_vertex.glsl"
#if CM_GROUPS  // glsl/path/groups.glsl
void cm_begin_groups();
void cm_finish_groups(CmPath p, uvec2 at);
#endif
#if CM_EQUIANGULAR
#include "path/equiangular.glsl"
#endif

// Returns true if the film can hold the sample's radiance: it is finite, and sums of 100000 such values are finite.
CM_FN bool cm_is_sound(CmPath p) {
  const float most = 1e33f;
  return cm_is_within(p.radiance, most) && (p.bounces > 0u || cm_is_within(p.light, most));
}

// Adds a finished sample to its pixel. The radiance in front of the background and the background are kept separate, so
// that the image can be drawn over the host's. A sample that is not sound counts as black and increments `unsound`.
CM_FN void cm_finish(CM_INOUT(CmPath) p, CM_INOUT(CmPixel) pixel) {
  if (!cm_is_sound(p)) {
    p.radiance = vec3(0.0f, 0.0f, 0.0f);
    p.light = vec3(0.0f, 0.0f, 0.0f);
    pixel.unsound += 1u;
  }
  bool covers = p.bounces > 0u || p.at_layer != 0u;
  vec3 background = covers ? vec3(0.0f, 0.0f, 0.0f) : p.light;
  // Samples without a collision count as well: they may hold emission of the medium in front of the background.
  if (p.in_volume != 0u || p.bounces == 0u) pixel.volume += vec4(p.radiance, float(p.in_volume));
  if (p.bounces == 0u && p.at_layer != 0u) p.radiance += p.light;
  pixel.sum += vec4(p.radiance, covers ? 1.0f : 0.0f);
  pixel.samples += 1u;
  pixel.steps += p.steps;
  float share = 1.0f / float(pixel.samples);
  pixel.background += share * (background - pixel.background);
  float luminance = cm_luminance(p.radiance + background);
  pixel.square += share * (min(luminance * luminance, 1e37f) - pixel.square);
  p.stage = pixel.samples >= cm.dispatch.samples ? CM_STAGE_DONE : CM_STAGE_CAMERA;
}

// Returns where the surface pass or the host's depth ends a camera ray, in units of view depth. If the ray ends at a
// layer with a color, sets at_layer and puts the color into p.light.
CM_FN float cm_camera_end(CM_INOUT(CmPath) p, uvec2 at, vec2 within, uint layer, float u) {
  float host_z = cm_surface_z(at, within, layer);
#if CM_LAYERS
  if (cm.layers.count != 0u) {
    vec4 color = vec4(0.0f, 0.0f, 0.0f, 0.0f);
    float layer_z = cm_layer_surface(at, within, layer, u, color);
    if (layer_z <= host_z && color.a > 0.0f && cm.layers.colored != 0u) {
      p.at_layer = 1u;
      p.light = vec3(color);
    }
    return min(host_z, layer_z);
  }
#endif
  return host_z;
}

// Starts the camera ray of the pixel's next sample. samples: the number of samples that the pixel has.
CM_FN void cm_camera(CM_INOUT(CmPath) p, uint samples, uvec2 at) {
  uint sample_number = cm.integrator.first_sample + samples;
  uint number = at.y * cm.view.size.x + at.x;
  uvec3 pixel = cm_hash3(uvec3(number, 0x5bd1e995u, cm.integrator.seed));
  p.random = cm_hash3(uvec3(number, sample_number, cm.integrator.seed)).x;
  p.stream = pixel.x | 1u;
  p.number = sample_number;
#if CM_MOTION
  cm_now = cm_moment(p.number, p.stream);
#endif
  vec2 within = cm_even_pair(sample_number, p.stream, 0u);
  vec2 along = cm_even_pair(sample_number, p.stream, 1u);
  vec2 lens = vec2(0.0f, 0.0f);
  bool wide = cm.view.lens_right > 0.0f;
#if CM_MOTION
  wide = max(cm.shutter.open.lens_right, cm.shutter.close.lens_right) > 0.0f;
#endif
  if (wide) lens = cm_on_disc(cm_even_pair(sample_number, p.stream, CM_SET_LENS));
  float t_per_z = cm_lens_ray(at, within, lens, p.o, p.w);
  p.d = cm_to_cube(p.w);
  p.throughput = vec3(1.0f, 1.0f, 1.0f);
  p.radiance = vec3(0.0f, 0.0f, 0.0f);
  p.bounces = 0u;
  p.blurred = 0u;
  p.in_volume = 0u;
  p.at_layer = 0u;
#if CM_EXTENDED_BSDF
  p.within = 0u;
  p.outside = 0u;
  p.through = 0u;
  p.dispersed = 0u;
#endif
  vec3 background = cm_background_radiance(p.w);
  p.light = background;
  p.steps = 0u;
  p.depth_0 = cm_free_depth(along.x);
  p.depth = p.depth_0;
  p.ray = CM_RAY_SCATTERED;
  p.found = CM_FOUND_NOT_ASKED;
  p.start = CM_AT_CAMERA;
  // Consecutive samples use consecutive layers; each pixel starts at a random one.
  uint layer = (pixel.y >> 16) + sample_number;
  p.reach = t_per_z * cm_camera_end(p, at, within, layer, along.y);
  float ground = cm_ground_distance(p.o, p.d);
  p.to_ground = cm_ground_ends(ground, p.reach) ? 1u : 0u;
  if (p.to_ground != 0u) {
    p.at_layer = 0u;
    p.light = background;
  }
  p.reach = min(p.reach, ground);
  p.stage = CM_STAGE_AIM;
#if CM_GROUPS
  p.group = 0u;
  cm_begin_groups();
#endif
}

// Adds the contribution of a ray that left the bounds or reached its end. Distant light can be found both by NEE and by
// a scattered ray that escapes. The MIS weights of both include the transmittance, except for rays from a shadow
// catcher. blocked: the ray from the catcher did not escape, and the light that it missed is subtracted.
CM_FN void cm_escape(CM_INOUT(CmPath) p, bool blocked) {
  float depth = p.depth_0 - p.depth;
  float transmittance = blocked ? 1.0f : exp(-depth);
  if (p.ray == CM_RAY_SCATTERED) {
    if (blocked) p.throughput = -p.throughput;
    if (p.bounces > 0u) p.radiance += p.throughput * cm_far_light(p, transmittance);
    if (blocked) p.throughput = -p.throughput;
  } else {
    float survival = min(1.0f, exp(CM_SHADOW_DEPTH - depth));
    p.radiance += p.light * (transmittance / (survival * (1.0f + transmittance * p.pdf)));
#if CM_GROUPS
    cm_add_to_group(p.group, p.light * (transmittance / (survival * (1.0f + transmittance * p.pdf))));
#endif
  }
}

// Adds the medium's own emission, the integral of S e^-x dx along the ray. Adding S at a collision (probability 1 -
// e^-x) is unbiased, but noisy in thin flames. If the optical depth x of the ray is known, the estimator adds 2 S (1 -
// e^-x) at a collision and S (1 - e^-x) without one. It has the same mean and almost no noise in thin flames. With
// triangles x is not known, because a triangle may be nearer than the traversal went. With several volumes S is not
// constant.
CM_FN void cm_emissive(CM_INOUT(CmPath) p, bool ended, bool collided) {
  float emissive = collided ? 1.0f : 0.0f;
  if (CM_SURFACES == 0 && CM_INSTANCES == 0) emissive = (collided ? 2.0f : (ended ? 1.0f : 0.0f)) * (1.0f - exp(max(0.0f, p.depth) - p.depth_0));
  p.radiance += p.throughput * (emissive * CM_MEDIUM.source);
#if CM_GROUPS
  cm_add_to_group(CM_MEDIUM.group, p.throughput * (emissive * CM_MEDIUM.source));
#endif
}

// In an opaque medium of albedo 1 a path could have millions of events. At this number of events, and at each further
// doubling, the survival probability is halved.
#define CM_LONG_PATH 16384u

// Moves the path to its collision or to its point on a triangle or the ground, and applies the albedo there. Returns
// true if the path ends, by Russian roulette or by the bounce limit.
CM_FN bool cm_arrive(CM_INOUT(CmPath) p, bool collided, bool grounded) {
  if (collided && p.bounces == 0u) p.in_volume = 1u;
  p.bounces += 1u;
  if (collided) p.throughput *= CM_MEDIUM.albedo;
  if (grounded) {
    if (cm_ground_catches()) {
      // A camera ray, whose p.light is the radiance of the background.
      p.radiance += p.throughput * p.light;
#if CM_GROUPS
      cm_add_to_group(cm.integrator.sky_group, p.throughput * p.light);
#endif
      p.throughput *= p.light;
    }
    p.throughput *= cm.ground.albedo;
  }
#if CM_CHANNELS && defined(CM_MARCH)  // without CM_MARCH there are no collisions
  if (collided && CM_MEDIUM.colored != 0u) p.throughput *= cm_march_color(p.cell, cm_in_volume_point(p.o + p.t * p.d));
#endif
  float strongest = max(p.throughput.x, max(p.throughput.y, p.throughput.z));
  // The ground as seen by the camera is large, uniform and dark. There Russian roulette would be the only noise.
  float survival = strongest < 0.5f && !(grounded && p.bounces == 1u) ? max(strongest, 0.05f) : 1.0f;
  if (p.bounces >= CM_LONG_PATH && (p.bounces & (p.bounces - 1u)) == 0u) survival *= 0.5f;
  float u = cm_random(p.random, p.stream);
  bool last = cm.integrator.max_bounces != 0u && p.bounces > cm.integrator.max_bounces;
  bool ends = !cm_is_positive(strongest) || u >= survival || last;
  p.throughput = p.throughput / survival;
  p.o = p.o + p.t * p.d;
  p.start_cell = p.cell;
#if CM_INSTANCES
  if (collided) p.start_instance = p.instance;
#endif
  p.start = grounded ? CM_ON_GROUND : CM_IN_MEDIUM;
  return ends;
}

// A light sample for NEE, taken after a collision or on a triangle.
struct CmNee {
  bool to_light;  // false: there is no shadow ray, and `light` only marks a scattered ray (kind sky)
  CmLightSample light;
  CmDraw draw;
};

CM_FN CmNee cm_nee(CM_INOUT(CmPath) p, CmVertex vertex, bool arrived) {
  CmNee nee;
  nee.to_light = arrived && cm.lights.any != 0u;
  nee.draw = cm_draw(p, nee.to_light);
  vec3 here = cm_nee_origin(p, vertex);
  vec3 u = vec3(nee.draw.u_direction.x, nee.draw.u_direction.y, nee.draw.u_choice);
  nee.light = cm_sky_sample(p, here, u);
  if (nee.to_light) nee.light = cm_light_sample(p, here, u);
#ifdef CM_MARCH  // without CM_MARCH the vertex is on a triangle
  if (nee.to_light) {
    float probability = cm_nee_probability(p, nee.light.kind, cm_scattered(p, nee.light.direction), nee.light.pdf);
    nee.to_light = nee.draw.u_distance < probability;
    float rest = nee.to_light ? nee.draw.u_distance / probability
                              : (nee.draw.u_distance - probability) / (1.0f - probability);
    nee.draw.u_distance = min(rest, 0.99999994f);  // below 1, whatever the rounding of the driver's division
    nee.light.pdf *= probability;
    if (!nee.to_light) {
      // The probability may depend on the light's direction, and thus on the random numbers that chose it. The
      // scattered ray needs new ones.
      nee.draw.u_direction.x = cm_random(p.random, p.stream);
      nee.draw.u_direction.y = cm_random(p.random, p.stream);
      nee.light = cm_sky_sample(p, here, u);
    }
  }
#endif
  // Stretches the sky's range of u.z to [0, 1], so that the number can choose a lobe.
  if (nee.to_light && nee.light.kind == CM_LIGHT_SKY) nee.draw.u_choice = min(1.0f, u.z / cm.lights.sky_probability);
  if (nee.light.kind == CM_LIGHT_CELL && cm_is_dark(p)) nee.light.radiance = vec3(0.0f, 0.0f, 0.0f);
#if CM_EQUIANGULAR && defined(CM_MARCH)
  bool analytic_light = nee.to_light && nee.light.kind == CM_LIGHT_ANALYTIC_LIGHT && nee.light.distance < 3.0e38f;
  if (analytic_light && p.start == CM_IN_MEDIUM && cm_is_passed(p, p.bounces - 1u)) {
    float extinction = cm_extinction_at(p, p.start_cell, p.bounces == 1u).extinction;
    float pdf = cm_equiangular_pdf(p.o, p.w, nee.light.direction, nee.light.distance);
    nee.light.radiance *= 1.0f - cm_equiangular_weight(pdf, extinction);
  }
#endif
  return nee;
}

#if CM_INSTANCES
// Starts the traversal of all volumes, or of the emissive overlapping ones for the second sweep. The volume that
// contains the ray's origin comes first.
CM_FN void cm_begin_visits(CM_INOUT(CmPath) p) {
  uint again = CM_INSTANCE_EMITS | CM_INSTANCE_OVERLAPS;
  bool inside = cm_starts_inside(p) &&
                (p.gathers == 0u || (cm_instances[p.start_instance].flags & again) == again);
  p.t = 0.0f;
  p.entry = -1.0f;
  p.instance = inside ? p.start_instance : CM_INSTANCE_NONE;
  p.cell = inside ? p.start_cell : uvec2(CM_NONE, 0u);
  p.cache = CM_NONE;
  p.stage = CM_STAGE_FLY;
}

CM_FN void cm_begin_march(CM_INOUT(CmPath) p) {
  p.t_end = p.reach;
  p.collision_instance = CM_INSTANCE_NONE;
  p.gathers = 0u;
  if (p.start != CM_IN_MEDIUM) p.start_instance = 0u;  // otherwise stale: kernels store it only for origins in a medium
  cm_begin_visits(p);
}
#endif

// Starts the shadow ray, or the scattered ray if there is none.
CM_FN void cm_scatter(CM_INOUT(CmPath) p, CmVertex vertex, CmNee nee) {
  bool to_light = nee.to_light;
  CmLightSample light = nee.light;
  vec3 w = cm_sample_direction(p, vertex, nee.draw);
  bool along = light.kind == CM_LIGHT_SKY;
  CmScatterSample scatter = cm_scatter_sample(p, vertex, along ? w : light.direction);
  if (along) light = cm_sky_along(w, light.pdf * scatter.pdf);
  p.pdf = scatter.pdf;
  if (to_light) {
    // For distant lights, cm_escape applies the balance heuristic, with the transmittance. For triangles and cells, the
    // heuristic leaves the transmittance out and is applied here.
    if ((light.kind == CM_LIGHT_TRIANGLE && !scatter.lifted) || light.kind == CM_LIGHT_CELL) light.pdf += scatter.pdf;
    float rare = 1.0f / max(light.pdf, 1e-30f);
    p.light = p.throughput * light.radiance * (scatter.share * rare);
    p.pdf = cm_is_far(light) ? scatter.pdf * rare : 0.0f;
#if CM_GROUPS
    p.group = cm_group_of(light.kind);
#endif
    if (cm_on_catcher(p)) {
      p.light /= 1.0f + p.pdf;
      p.pdf = 0.0f;
      if (cm_is_far(light) || light.kind == CM_LIGHT_SUN) {
        p.radiance -= p.light;
#if CM_GROUPS
        cm_add_to_group(p.group, -p.light);
#endif
      }
    }
  } else {
    p.throughput *= scatter.weight;
    p.w = light.direction;
    if (cm_blurs(scatter)) p.blurred = 1u;
  }
  p.lifted = scatter.lifted ? 1u : 0u;
#if CM_EXTENDED_BSDF
  cm_leave_surface(p, vertex, scatter, to_light);
#endif
  p.d = cm_to_cube(light.direction);
  p.ray = to_light ? CM_RAY_TO_LIGHT : CM_RAY_SCATTERED;
  p.found = CM_FOUND_NOT_ASKED;
  p.depth_0 = cm_free_depth(nee.draw.u_distance) + (to_light ? CM_SHADOW_DEPTH : 0.0f);
  p.depth = p.depth_0;
  float ground = cm_solid_ground_distance(p.o, p.d);
  bool ground_ends = cm_ground_ends(ground, light.distance);
  p.to_ground = !to_light && ground_ends ? 1u : 0u;
  bool hidden = to_light && ground_ends;
  if (hidden) p.light = vec3(0.0f, 0.0f, 0.0f);
  p.reach = hidden ? 0.0f : min(light.distance, ground);
#if CM_INSTANCES
  if (CM_SURFACES == 0) {
    cm_begin_march(p);
    return;
  }
#endif
  if (CM_SURFACES == 0) {
    p.t = 0.0f;
    p.t_end = cm_on_ground(p) ? p.reach : min(cm_box_range(p.o, p.d).y, p.reach);
    p.cell = p.start_cell;
    p.cache = CM_NONE;
    p.stage = cm_on_ground(p) ? CM_STAGE_AIM : CM_STAGE_FLY;
  } else {
    if (to_light && !cm_is_positive(max(p.light.x, max(p.light.y, p.light.z)))) p.reach = 0.0f;  // no light
    p.stage = CM_STAGE_AIM;
  }
}

// Adds the contribution of a ray that came to an event. Returns true if the path is finished. arrived: the path
// continues from the ray's end.
CM_FN bool cm_end_ray(CM_INOUT(CmPath) p, CmVertex vertex, CM_OUT(bool) arrived) {
  bool scattered = p.ray == CM_RAY_SCATTERED;
  bool hit_triangle = vertex.on_triangle && scattered;
  bool grounded = scattered && p.event == CM_EVENT_ESCAPE && !hit_triangle && cm_goes_to_ground(p);
  bool escaped = p.event == CM_EVENT_ESCAPE && !hit_triangle && !grounded;
  bool collided = scattered && p.event == CM_EVENT_COLLISION && !hit_triangle;
#if CM_INSTANCES
  cm_here = collided ? p.instance : p.start_instance;
#endif
#if CM_HOLDOUT
  // Emission in front of the holdout stays. Behind it the sample is empty, without the background.
  bool cut = collided && CM_MEDIUM.holdout != 0u;
#if CM_SURFACES
  cut = cut || (hit_triangle && (cm_models[cm_model_of(p.triangle)].flags & CM_MODEL_HOLDOUT) != 0u);
#endif
  if (cut && p.bounces == 0u) {
    p.light = vec3(0.0f, 0.0f, 0.0f);
    arrived = false;
    return true;
  }
#endif
  // Light that escaping rays from a catcher bring is part of the background's radiance.
  bool from_catcher = scattered && cm_on_catcher(p);
  if (escaped != from_catcher) cm_escape(p, from_catcher);
  bool finished = escaped && scattered;
  if (hit_triangle) cm_see(p, vertex);
  bool dark = (hit_triangle && cm_among_surfaces_dark(p) && !cm_came_through(p)) ||
              ((collided || grounded) && cm_is_dark(p));
  cm_emissive(p, scattered, collided && !dark);
  arrived = collided || hit_triangle || grounded;
  if (grounded) p.t = cm_ground_distance(p.o, p.d);
  if (arrived) {
    // Another kernel found the ground, but here rounding puts it just out of reach.
    bool missed = grounded && p.t >= CM_NO_GROUND;
    finished = cm_arrive(p, collided, grounded) || dark || missed;
    if (hit_triangle) finished = cm_stand(p, vertex) || finished;
  }
#if CM_EQUIANGULAR
  if (p.ray == CM_RAY_EQUIANGULAR) {
    finished = p.finishes != 0u;
    arrived = !finished;
    p.o = p.o + p.ahead * cm_to_cube(p.w);
    if (p.bounces == 0u) p.light = cm_background_radiance(p.w);
  }
#endif
  return finished;
}

// Handles an event: end of the ray, then light sample, then scattering. Each costly step has a single call,
// because software drivers execute both sides of every branch. Stage CM_STAGE_VERTEX: the path is on a triangle. Stage
// CM_STAGE_EVENT: it is in the medium or on the ground.
CM_FN void cm_handle(CM_INOUT(CmPath) p, CmVertex vertex) {
#if CM_EQUIANGULAR
  CmPassed passed = cm_pass(p, vertex);
#endif
  bool arrived;
  bool finished = cm_end_ray(p, vertex, arrived);
#if CM_EQUIANGULAR
  if (passed.to_light) {
    cm_equiangular_nee(p, passed, finished);
    return;
  }
#endif
  if (!finished) {
    // Two statements, because both calls change p: in a nested call the outer one may get a copy from before the inner
    // one.
    CmNee nee = cm_nee(p, vertex, arrived);
    cm_scatter(p, vertex, nee);
  }
  if (finished) p.stage = CM_STAGE_FINISH;
}

#endif
