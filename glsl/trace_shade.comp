#version 450
// What happens on the triangles that paths have met, or whose shadow rays have ended: glsl/path_queue.glsl.
// variants: CM_SURFACES=1,2
layout(local_size_x = 8, local_size_y = 8) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "parameters.glsl"
#include "cell.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "buffers.glsl"
#include "surface.glsl"
#include "path.glsl"
#include "path_store.glsl"
#include "path_queue.glsl"

void main() {
  if (cm_queue_place() >= cm_queue_count(CM_QUEUE_SHADE)) return;
  uint lane = cm_queue_lane(CM_QUEUE_SHADE);
  CmPath p = cm_load_path(lane);
  cm_handle(p, true);
  cm_store_path(p, lane);
  cm_send_on(p, lane);
}
