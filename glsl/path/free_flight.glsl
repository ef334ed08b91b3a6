// The traversal stages of a path: free-flight distance sampling on the grid. Shared by GLSL and C++. The includer
// provides the functions that glsl/path/path.glsl names, and
//   uvec3 cm_march_enter(vec3 p)                  the cell (or voxel) that contains point p of cube space
//   CmMarchRay cm_march_ray(vec3 o, vec3 d)
//   void cm_march_step(uvec3 cell, CmMarchRay ray, t, t_1, CmBernstein r, next)
// The step returns the end t_1 of the ray's segment in the cell, which begins at t; the density r along it
// (segment.glsl); and the next cell. next.x is CM_NONE outside the grid, or where nothing lies ahead. The third word of
// a cell is a cache of the traversal, CM_NONE if it is empty. With CM_CHANNELS also
//   CmEmission cm_march_emission(uvec3 cell, vec3 o, vec3 d)
//   vec3 cm_march_color(uvec2 cell, vec3 p)        scattering color at point p of cube space in the cell
//   float cm_march_anisotropy(uvec2 cell, vec3 p)   mean cosine of scattering
// and with CM_KEEPS_ENTRY
//   uint cm_kept_cell(uint slot)                  entry cell of the pixel's last camera ray; CM_NONE: unknown
//   void cm_keep_cell(uint slot, uint cell)
//
// Free-flight distances are sampled exactly ("regular tracking" in Novak et al., "Monte Carlo Methods for Volumetric
// Light Transport Simulation", 2018). An optical depth -ln(1 - u) is used up along the traversal. In a cell the depth
// is a quadratic in t and is inverted in closed form, or a quartic whose root is found to rounding (segment.glsl).
// There is no majorant and no step size.
//
// The emission of cells is integrated along scattered rays up to their end (Simon, Hanika, Zirr and Dachsbacher, "Line
// Integration for Rendering Heterogeneous Emissive Volumes", EGSR 2017). A ray gets as far as t with a probability
// equal to the transmittance. So the only weight is that against NEE of the same cells (light.glsl).
//
// With CM_INSTANCES the ray traverses the volumes one by one, in the order in which it enters their boxes, up to t_end.
// Extinctions add where volumes overlap, so the nearest of their independent free-flight distances is distributed as
// that of their sum. Free-flight sampling is memoryless, so the depth left after one volume continues in the next. A
// new depth is drawn only after a collision, which becomes the new end of the ray. A shadow ray uses up one depth
// through all volumes. With CM_CLIP it enters and leaves a volume at the planes of that volume's clip.
#ifndef CM_FREE_FLIGHT_GLSL
#define CM_FREE_FLIGHT_GLSL

#include "path/path_state.glsl"
#if CM_EQUIANGULAR
#include "traversal/extinction_at.glsl"
#endif
#include "path/path.glsl"

// Maximum number of cells traversed before events are handled. Keeps neighboring lanes together.
#ifndef CM_CHUNK
#define CM_CHUNK 8
#endif
// Maximum number of events before the kernel does something else.
#ifndef CM_EVENTS
#define CM_EVENTS 8
#endif

#ifndef CM_KEEPS_ENTRY
#define CM_KEEPS_ENTRY 0
#endif

// Finds the cell where the ray enters, at p.t. With CM_KEEPS_ENTRY, the entry cell of the pixel's last camera ray is
// tried first. Most others enter it, too.
CM_FN void cm_enter(CM_INOUT(CmPath) p) {
#if CM_KEEPS_ENTRY
  vec3 point = cm_march_entry(p.o, p.d, p.t);
  uint kept = p.start == CM_AT_CAMERA ? cm_kept_cell(p.slot) : CM_NONE;
  uvec3 cell = uvec3(kept, 0u, CM_NONE);
  if (kept == CM_NONE || !cm_march_contains(kept, point)) {
    cell = cm_march_enter(point);
    if (p.start == CM_AT_CAMERA) cm_keep_cell(p.slot, cell.x);
  }
#else
  uvec3 cell = cm_march_enter_at(p.o, p.d, p.t);
#endif
  p.cell = uvec2(cell.x, cell.y);
  p.cache = cell.z;
}

#if CM_EQUIANGULAR
// Weighs an equi-angular sample by the light scattered towards the path at its origin. Ends the ray if there is no
// medium.
CM_FN void cm_weigh(CM_INOUT(CmPath) p) {
  CmExtinction there = cm_extinction_at(p, p.cell, p.seen != 0u);
#if CM_INSTANCES
  cm_here = there.instance;
#endif
  vec3 to_light = cm_to_world(p.d);
  float pdf = cm_equiangular_pdf(p.o, p.w, to_light, p.reach);
  vec3 share = CM_MEDIUM.albedo;
  float anisotropy = CM_MEDIUM.anisotropy;
#if CM_CHANNELS
  if (CM_MEDIUM.colored != 0u) share *= cm_march_color(there.cell, cm_in_volume_point(p.o));
  if (CM_MEDIUM.anisotropic != 0u) anisotropy = cm_march_anisotropy(there.cell, cm_in_volume_point(p.o));
#endif
  p.light *= share * (there.extinction * cm_equiangular_weight(pdf, there.extinction) *
                      cm_medium_phase(anisotropy, dot(p.w, to_light)));
  if (!(there.extinction > 0.0f)) {
    p.reach = 0.0f;
    p.t_end = 0.0f;
    p.cell = uvec2(CM_NONE, 0u);
  }
}
#endif

#if CM_INSTANCES

CM_FN void cm_aim(CM_INOUT(CmPath) p) {
  cm_begin_march(p);
#if CM_EQUIANGULAR
  if (p.ray == CM_RAY_EQUIANGULAR) cm_weigh(p);
#endif
}

// Finds the next volume of the ray and its entry cell. Returns false if there is none before the ray's end.
CM_FN bool cm_seek(CM_INOUT(CmPath) p) {
  uint own = cm_starts_inside(p) ? p.start_instance : CM_INSTANCE_NONE;
  uint flags = p.start == CM_AT_CAMERA && !cm_is_equiangular(p) ? CM_INSTANCE_SEEN : 0u;
  if (p.gathers != 0u) flags |= CM_INSTANCE_EMITS | CM_INSTANCE_OVERLAPS;
  bool found = false;
  // Repeated if the result is the volume of the origin, which was traversed first.
  for (int i = 0; i < 2 && (i == 0 || (found && p.instance == own)); ++i) {
    found = cm_next_instance(p.o, p.d, p.t_end, flags, p.entry, p.instance);
  }
  if (found) {
    cm_here = p.instance;
    p.t = p.entry;
    cm_enter(p);
  }
  return found;
}

// Converts an event in one volume, or the end of all volumes, into the event of the ray.
CM_FN uint cm_leave(CM_INOUT(CmPath) p, uint event, bool over) {
  uint what = event;
  if (over) {
    bool collided = p.collision_instance != CM_INSTANCE_NONE;
    what = collided ? CM_EVENT_COLLISION : CM_EVENT_ESCAPE;
    if (CM_CHANNELS != 0 && cm.medium.emits != 0u && p.ray == CM_RAY_SCATTERED && p.gathers == 0u) {
      what = CM_EVENT_NONE;
      p.gathers = 1u;
      cm_begin_visits(p);
    } else if (collided) {
      p.t = p.t_end;
      p.cell = p.collision_cell;
      p.cache = CM_NONE;
      p.instance = p.collision_instance;
    }
  } else if (event == CM_EVENT_COLLISION && p.ray == CM_RAY_SCATTERED) {
    p.collision_instance = p.instance;
    p.collision_cell = p.cell;
    p.t_end = p.t;
    p.depth = cm_free_depth(cm_random(p.random, p.stream));
    what = CM_EVENT_NONE;
  } else if (event == CM_EVENT_ESCAPE) {
    what = CM_EVENT_NONE;
  }
  if (!over && event != CM_EVENT_NONE) p.cell = uvec2(CM_NONE, 0u);
  return what;
}

#else

// Clips the ray to the bounds and to its reach.
CM_FN void cm_aim(CM_INOUT(CmPath) p) {
  vec2 range = cm_box_range(p.o, p.d);
  // Without triangles `reach` is not kept beyond this point, and after a ground hit another dispatch may come in
  // between.
  float reach = CM_SURFACES == 0 && cm_on_ground(p) && !cm_is_equiangular(p) ? p.t_end : p.reach;
  p.t = range.x;
  p.t_end = max(0.0f, min(range.y, reach));
  p.cell = uvec2(CM_NONE, 0u);
  p.cache = CM_NONE;
  if (range.x < p.t_end) {
    p.cell = p.start_cell;
    if (!cm_starts_inside(p)) cm_enter(p);
  }
  p.stage = CM_STAGE_FLY;
#if CM_EQUIANGULAR
  if (p.ray == CM_RAY_EQUIANGULAR) cm_weigh(p);
#endif
}

#endif

// Distance at which the ray ends, or leaves the clip of the current volume. o, d: in cube space.
CM_FN float cm_fly_end(CmPath p, vec3 o, vec3 d) {
#if CM_CLIP
  if (p.cell.x != CM_NONE) return min(p.t_end, cm_clip_end(cm_here, o, d));
#endif
  return p.t_end;
}

// Marches at most CM_CHUNK cells. Leaves t, cell and depth at the event, or at the point reached without one.
CM_FN uint cm_fly(CM_INOUT(CmPath) p) {
#if CM_INSTANCES
  cm_here = p.cell.x == CM_NONE ? 0u : p.instance;
#endif
  vec3 o = cm_in_volume_point(p.o);
  vec3 d = cm_in_volume(p.d);
  float extinction = CM_MEDIUM.extinction;
#if CM_INSTANCES
  if (p.gathers != 0u) extinction = 0.0f;
#endif
  CmMarchRay ray = cm_march_ray(o, d);
  float t_end = cm_fly_end(p, o, d);
  uint event = (CM_SURFACES != 0 || CM_INSTANCES != 0) && p.cell.x == CM_NONE ? CM_EVENT_ESCAPE : CM_EVENT_NONE;
  uvec3 cell = uvec3(p.cell.x, p.cell.y, p.cache);
  // Values of the last cell.
  CmBernstein r = CmBernstein(0.0f);
  float span = 0.0f;
#if CM_CHANNELS
  CmEmission emission;
  vec3 emitted = vec3(0.0f, 0.0f, 0.0f);
  // MIS: NEE samples the same cells.
  float scattering_pdf = p.bounces > 0u ? p.pdf : 1.0f;
  float nee_pdf =
      p.bounces > 0u ? cm.lights.cell_probability * cm_nee_probability(p, CM_LIGHT_CELL, p.pdf, 0.0f) : 0.0f;
#endif
  for (int i = 0; i < CM_CHUNK && event == CM_EVENT_NONE; ++i) {
    float t_1 = 0.0f;
    uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
    cm_march_step(cell, ray, p.t, t_1, r, next);
#if CM_CHANNELS
    emission = cm_march_emission(cell, o, d);
    emission.mean *= cm_balance(scattering_pdf, nee_pdf * cm_cell_pdf(emission));
#endif
    p.steps += 1u;
    span = t_1 - p.t;
    float used = extinction * (cm_segment_mean(r) * span);
    // Only up to a surface or light inside the cell.
    if (CM_SURFACES != 0 && t_1 > t_end) used = cm_depth_of(extinction * r, span, t_end - p.t);
    if (used > p.depth) {
      event = CM_EVENT_COLLISION;
    } else {
#if CM_CHANNELS
      emitted += cm_emitted(emission, p.t, min(t_1, t_end));
#endif
      p.depth -= used;
      p.t = t_1;
      cell = next;
      if (next.x == CM_NONE || t_1 >= t_end) event = CM_EVENT_ESCAPE;
    }
  }
  p.cell = uvec2(cell.x, cell.y);
  p.cache = cell.z;
  CmBernstein e = extinction * r;
  // This follows the loop, because software drivers execute both sides of every branch in each step.
  if (event == CM_EVENT_COLLISION) {
    float left = t_end - p.t;
    float way = cm_depth_distance(e, span, p.depth);
#if CM_CHANNELS
    emitted += cm_emitted(emission, p.t, p.t + min(way, left));
#endif
    p.t += way;
    p.depth = way < left ? -1.0f : max(0.0f, p.depth - cm_depth_of(e, span, left));
    if (way >= left) event = CM_EVENT_ESCAPE;  // behind a surface
  } else if (CM_SURFACES == 0 && event == CM_EVENT_ESCAPE && p.t > t_end) {
    p.depth += cm_depth_of(cm_segment_reversed(e), span, p.t - t_end);
  }
#if CM_CHANNELS
  bool takes = p.ray == CM_RAY_SCATTERED && !cm_is_dark(p);
#if CM_INSTANCES
  // In overlapping volumes another one may end the ray earlier. Their emission waits for the second sweep.
  takes = takes && (p.gathers != 0u || (cm_instances[cm_here].flags & CM_INSTANCE_OVERLAPS) == 0u);
#endif
#if CM_HOLDOUT
  takes = takes && !(p.bounces == 0u && CM_MEDIUM.holdout != 0u);
#endif
  if (takes) p.radiance += p.throughput * emitted;
#if CM_GROUPS
  if (takes) cm_add_to_group(CM_MEDIUM.group, p.throughput * emitted);
#endif
#endif
  return event;
}

// What the path does once its ray has come to an event. Returns the next stage.
CM_FN uint cm_stage_after_ray(CmPath p) {
  if (CM_CHANNELS != 0 && cm.medium.emits != 0u && p.ray == CM_RAY_SCATTERED) {
    return p.found == CM_FOUND_TRIANGLE && p.event == CM_EVENT_ESCAPE ? CM_STAGE_VERTEX : CM_STAGE_EVENT;
  }
  if (cm_asks(p)) return CM_STAGE_INTERSECT;
  return p.ray != CM_RAY_SCATTERED && p.start == CM_ON_TRIANGLE ? CM_STAGE_VERTEX : CM_STAGE_EVENT;
}

// Runs the stages in the medium: handles the last event and continues until the path needs triangles, its sample is
// finished, or CM_EVENTS iterations are done. Returns the number of traversals.
CM_FN uint cm_travel(CM_INOUT(CmPath) p) {
  uint marches = 0u;
  for (int j = 0; j < CM_EVENTS && ((CM_SURFACES != 0 && p.stage == CM_STAGE_AIM) || p.stage == CM_STAGE_FLY ||
                                    p.stage == CM_STAGE_EVENT);
       ++j) {
    if (p.stage == CM_STAGE_EVENT) cm_handle(p, cm_in_medium());
    if (CM_SURFACES != 0 && p.stage == CM_STAGE_AIM) {
      if (CM_CHANNELS != 0 && cm.medium.emits != 0u && cm_asks_first(p)) {
        p.stage = CM_STAGE_INTERSECT;
      } else {
        cm_aim(p);
      }
    }
    if (p.stage == CM_STAGE_FLY) {
#if CM_INSTANCES
      bool over = p.cell.x == CM_NONE && !cm_seek(p);
      uint event = cm_fly(p);
      p.event = cm_leave(p, event, over);
#else
      p.event = cm_fly(p);
#endif
      marches += 1u;
      if (p.event != CM_EVENT_NONE) p.stage = cm_stage_after_ray(p);
    }
  }
  return marches;
}

#endif
