#version 450
// Traverses the medium in scenes with triangles: glsl/path/path_queue.glsl.
// variants: VOLUME or VOLUMES or VOLUMES CM_HOLDOUT=1 or VOLUMES CM_HOLDOUT=1 CM_MOTION=1 or VOLUMES CM_CLIP=1 CM_HOLDOUT=1 or VOLUMES CM_CLIP=1 CM_HOLDOUT=1 CM_MOTION=1
// variants: CM_SURFACES=1,2 or CM_SURFACES=2 CM_GROUPS=1
// variants: - or CM_SECOND_LOBE=1
// variants: - or CM_CHANNELS=1
// variants: - or CM_ENVIRONMENT=1
// variants: - or CM_EQUIANGULAR=1
layout(local_size_x = 8, local_size_y = 8) in;

// A path that waits for another kernel frees its lane for the next one in the queue: few events per visit, and longer
// traversals.
#define CM_EVENTS 2
#define CM_CHUNK 16

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "surface/surface.glsl"
#include "traversal/march.glsl"
#include "path/free_flight.glsl"
#include "path/path_store.glsl"
#include "path/path_queue.glsl"
#include "path/groups.glsl"

void main() {
  uint count = cm_queue_count(CM_QUEUE_TRAVEL);
  if (cm_queue_index() >= count) return;
  if (cm_queue_index() == 0u) atomicAdd(cm_total.x, count);
  uint lane = cm_queue_lane(CM_QUEUE_TRAVEL);
#if CM_GROUPS
  cm_group_lane = lane;
#endif
  CmPath p = cm_load_path(lane);
  cm_load_visit(p, lane);
  cm_travel(p);
  cm_store_path(p, lane);
  cm_store_visit(p, lane);
  cm_send_on(p, lane);
}
