#version 450
// Shades the triangles that paths have hit, or where their shadow rays started: glsl/path/path_queue.glsl.
// variants: CM_SURFACES=1,2 or CM_SURFACES=1,2 CM_EQUIANGULAR=1 or CM_SURFACES=2 CM_EXTENDED_BSDF=1,2 or CM_SURFACES=2 CM_GROUPS=1 or CM_SURFACES=2 CM_EQUIANGULAR=1 CM_GROUPS=1 or CM_SURFACES=2 CM_EXTENDED_BSDF=1,2 CM_GROUPS=1
// variants: - or CM_CHANNELS=1 or CM_CHANNELS=1 CM_INSTANCES=1 or CM_MOTION=1 or CM_CHANNELS=1 CM_INSTANCES=1 CM_MOTION=1 or CM_CHANNELS=1 CM_CLIP=1 CM_INSTANCES=1 or CM_CHANNELS=1 CM_CLIP=1 CM_INSTANCES=1 CM_MOTION=1
// variants: - or CM_ENVIRONMENT=1
// variants: - or CM_HOLDOUT=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "surface/surface.glsl"
#include "path/path.glsl"
#include "path/path_store.glsl"
#include "path/path_queue.glsl"
#include "path/groups.glsl"

// Clears the fields that ended with the ray, so that they take no registers.
void cm_forget_ray(inout CmPath p) {
  p.t = 0.0;
  p.d = vec3(0.0);
  p.t_end = 0.0;
  p.depth = 0.0;
  p.depth_0 = 0.0;
  p.cell = uvec2(0u);
  p.cache = 0u;
  p.start_cell = uvec2(0u);
  p.reach = 0.0;
  p.light = vec3(0.0);
  p.pdf = 0.0;
  p.event = CM_EVENT_NONE;
}

// The shading data of a triangle, a light sample and the path together need too many registers for good occupancy. Each
// is loaded when it is needed, and stored or loaded again rather than kept.
void main() {
  if (cm_queue_index() >= cm_queue_count(CM_QUEUE_SHADE)) return;
  uint lane = cm_queue_lane(CM_QUEUE_SHADE);
  CmPath p = cm_begin_path();
#if CM_GROUPS
  cm_group_lane = lane;
#endif
  cm_load_scattered(p, lane);
  cm_load_ends(p, lane);
#if CM_EXTENDED_BSDF || CM_MOTION
  cm_load_sum(p, lane);  // the sample's number
#endif
#if CM_MOTION
  cm_now = cm_moment(p.number, p.stream);
#endif
  cm_load_within(p, lane);
  CmVertex vertex = cm_on_triangle(p);
  p = cm_load_path(lane);
  cm_load_within(p, lane);
#if CM_EQUIANGULAR
  CmPassed passed = cm_pass(p, vertex);
#endif
  bool arrived;
  bool finished = cm_end_ray(p, vertex, arrived);
#if CM_EQUIANGULAR
  if (passed.to_light) {
    cm_equiangular_nee(p, passed, finished);
    cm_store_path(p, lane);
    cm_send_on(p, lane);
    return;
  }
#endif
  cm_store_sum(p, lane);
  cm_forget_ray(p);
  CmPath kept = cm_begin_path();
  if (finished) {
    p.stage = CM_STAGE_FINISH;
  } else {
    cm_store_scattered(p, lane);
    CmNee nee = cm_nee(p, vertex, arrived);
    cm_load_scattered(kept, lane);
    p.w = kept.w;
    p.throughput = kept.throughput;
    cm_scatter(p, vertex, nee);
    cm_store_within(p, lane);
  }
  cm_store_ray(p, lane);
  cm_store_scattered(p, lane);
  cm_load_ends(kept, lane);
  p.triangle = kept.triangle;
  p.weights = kept.weights;
  p.back = kept.back;
  p.in_volume = kept.in_volume;
  p.at_layer = kept.at_layer;
  cm_store_ends(p, lane);
  cm_send_on(p, lane);
}
