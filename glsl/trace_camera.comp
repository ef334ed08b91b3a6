#version 450
// Adds the samples that are done to their pixels, and begins the next: glsl/path_queue.glsl. With CM_DENSE it begins a
// dispatch: each lane of its blocks goes on where it was.
// variants: CM_SURFACES=1
// variants: - or CM_AOVS=1
// variants: CM_DENSE=0,1
// variants: - or CM_ENVIRONMENT=1
// variants: - or CM_GROUPS=1
// variants: - or CM_MOTION=1
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
#include "pixel_store.glsl"
#include "path_queue.glsl"
#include "groups.glsl"

#if CM_DENSE
void main() {
  uvec2 local = cm_block_pixel();
  if (!cm_is_live(local)) return;
  uvec2 at = cm.dispatch.tile_corner + local;
  uint samples = cm_pixel_samples(at);
  if (samples >= cm.dispatch.samples) return;
  uint lane = cm_lane_of(local);
#if CM_GROUPS
  cm_group_lane = lane;
#endif
  if (cm_block_begins()) {
    CmPath p = cm_begin_path();
    cm_camera(p, samples, at);
    cm_store_path(p, lane);
    cm_begin_within(lane);
  }
  atomicAdd(cm_blocks[cm_block_of(local)].y, 1u);
  if (samples == 0u) atomicAdd(cm_blocks[cm_block_of(local)].z, 1u);
  cm_enqueue(CM_QUEUE_TRAVEL, 0u, lane);
}
#else
void main() {
  if (cm_queue_place() >= cm_queue_count(CM_QUEUE_CAMERA)) return;
  uint lane = cm_queue_lane(CM_QUEUE_CAMERA);
  uvec2 local = cm_local_of(lane);
  uvec2 at = cm.dispatch.tile_corner + local;
  CmPixel pixel = cm_load_pixel(at);
  CmPath p = cm_load_path(lane);
#if CM_GROUPS
  cm_group_lane = lane;
  cm_finish_groups(p, at);
#endif
  cm_finish(p, pixel);
  cm_store_pixel(pixel, at);
  uint block = cm_block_of(local);
  atomicAdd(cm_blocks[block].w, 1u);
  if (pixel.samples == 1u) atomicAdd(cm_blocks[block].z, 0xffffffffu);
  if (p.stage == CM_STAGE_DONE) {
    atomicAdd(cm_blocks[block].y, 0xffffffffu);
  } else {
    cm_camera(p, pixel.samples, at);
    cm_begin_within(lane);
    cm_enqueue(CM_QUEUE_TRAVEL, cm_round + 1u, lane);
  }
  cm_store_path(p, lane);
}
#endif
