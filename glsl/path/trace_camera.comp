#version 450
// Adds finished samples to their pixels and starts the next ones: glsl/path/path_queue.glsl. With CM_DENSE it is the
// first kernel of a dispatch: each lane of its blocks continues its path or takes its first pixel.
// variants: CM_SURFACES=1
// variants: - or CM_AOVS=1
// variants: CM_DENSE=0,1
// variants: - or CM_ENVIRONMENT=1
// variants: - or CM_GROUPS=1
// variants: - or CM_MOTION=1
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
#include "path/pixel_store.glsl"
#include "path/pixel_slots.glsl"
#include "path/path_queue.glsl"
#include "path/groups.glsl"

#if CM_DENSE
void main() {
  uint lane = cm_block_lane();
  if (lane >= cm_lanes()) return;
#if CM_GROUPS
  cm_group_lane = lane;
#endif
  CmPath p = cm_begin_path();
  uint samples = 0u;
  if (cm_block_begins()) {
    cm_take_slot(p, lane, samples);
    if (p.stage == CM_STAGE_CAMERA) {
      cm_camera(p, samples, cm_pixel_of(p.slot));
      cm_begin_within(lane);
    }
    cm_store_path(p, lane);
  } else {
    cm_load_sum(p, lane);
    cm_load_ends(p, lane);
    if (p.stage != CM_STAGE_DONE) samples = cm_pixel_samples(cm_pixel_of(p.slot));
  }
  if (p.stage == CM_STAGE_DONE) return;
  atomicAdd(cm_blocks[cm_block_of(lane)].y, 1u);
  if (samples == 0u) atomicAdd(cm_blocks[cm_block_of(lane)].z, 1u);
  cm_enqueue(CM_QUEUE_TRAVEL, 0u, lane);
}
#else
void main() {
  if (cm_queue_index() >= cm_queue_count(CM_QUEUE_CAMERA)) return;
  uint lane = cm_queue_lane(CM_QUEUE_CAMERA);
  CmPath p = cm_load_path(lane);
  uvec2 at = cm_pixel_of(p.slot);
  CmPixel pixel = cm_load_pixel(at);
#if CM_GROUPS
  cm_group_lane = lane;
  cm_finish_groups(p, at);
#endif
  cm_finish(p, pixel);
  cm_store_pixel(pixel, at);
  uint block = cm_block_of(lane);
  atomicAdd(cm_blocks[block].w, 1u);
  if (pixel.samples == 1u) atomicAdd(cm_blocks[block].z, 0xffffffffu);
  uint samples = pixel.samples;
  if (p.stage == CM_STAGE_DONE) {
    cm_take_next_slot(p, samples);
    if (p.stage != CM_STAGE_DONE && samples == 0u) atomicAdd(cm_blocks[block].z, 1u);
  }
  if (p.stage == CM_STAGE_DONE) {
    atomicAdd(cm_blocks[block].y, 0xffffffffu);
  } else {
    cm_camera(p, samples, cm_pixel_of(p.slot));
    cm_begin_within(lane);
    cm_enqueue(CM_QUEUE_TRAVEL, cm_round + 1u, lane);
  }
  cm_store_path(p, lane);
}
#endif
