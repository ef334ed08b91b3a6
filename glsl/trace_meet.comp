#version 450
// Asks the tree for paths that wait for it: glsl/path_queue.glsl.
// variants: CM_SURFACES=1
// variants: - or CM_RICH=1
// variants: - or CM_GROUPS=1
// variants: - or CM_MOTION=1
layout(local_size_x = 8, local_size_y = 8) in;

#define CM_KEEPS_EQUIANGULAR  // what kernels before and behind this one have of a path

#include "bindings.glsl"
#include "shared.glsl"
#include "parameters.glsl"
#include "cell.glsl"
#include "random.glsl"
#include "phase.glsl"
#define CM_BVH_SHARED_STACK 64u
#include "buffers.glsl"
#include "surface.glsl"
#include "path.glsl"
#include "path_store.glsl"
#include "path_queue.glsl"
#include "groups.glsl"

void main() {
  if (cm_queue_place() >= cm_queue_count(CM_QUEUE_MEET)) return;
  uint lane = cm_queue_lane(CM_QUEUE_MEET);
  CmPath p = cm_load_path(lane);
  cm_load_within(p, lane);
  cm_meet(p);
#if CM_RICH
  cm_store_flight(p, lane);  // of which what it went through has taken its share
#endif
  if (cm.medium.emits != 0u) cm_store_ray(p, lane);  // which ends there
  cm_store_ends(p, lane);
  cm_send_on(p, lane);
}
