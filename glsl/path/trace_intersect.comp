#version 450
// Intersects queued rays with the triangles: glsl/path/path_queue.glsl.
// variants: CM_SURFACES=1
// variants: - or CM_EXTENDED_BSDF=1 or CM_CLEAR_SURFACES=1 CM_EXTENDED_BSDF=1,2
// variants: - or CM_GROUPS=1
// variants: - or CM_MOTION=1
layout(local_size_x = 8, local_size_y = 8) in;

#define CM_KEEPS_EQUIANGULAR  // same layout of a path as the kernels before and after this one

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#define CM_BVH_SHARED_STACK 64u
#include "common/buffers.glsl"
#include "surface/surface.glsl"
#include "path/path.glsl"
#include "path/path_store.glsl"
#include "path/path_queue.glsl"
#include "path/groups.glsl"

void main() {
  if (cm_queue_index() >= cm_queue_count(CM_QUEUE_INTERSECT)) return;
  uint lane = cm_queue_lane(CM_QUEUE_INTERSECT);
  CmPath p = cm_load_path(lane);
  cm_load_within(p, lane);
  cm_intersect(p);
#if CM_EXTENDED_BSDF
  cm_store_scattered(p, lane);  // throughput and light, dimmed by absorption
#endif
  if (cm.medium.emits != 0u) cm_store_ray(p, lane);  // the ray may end earlier
  cm_store_ends(p, lane);
  cm_send_on(p, lane);
}
