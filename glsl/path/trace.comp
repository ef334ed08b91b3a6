#version 450
// The path tracer as a megakernel, for scenes without triangles. Each lane of the dispatch's blocks loads its path,
// runs it for a bounded number of rounds and stores it.
// variants: VOLUME or VOLUMES or VOLUMES CM_HOLDOUT=1 or VOLUMES CM_HOLDOUT=1 CM_MOTION=1 or VOLUMES CM_CLIP=1 CM_HOLDOUT=1 or VOLUMES CM_CLIP=1 CM_HOLDOUT=1 CM_MOTION=1
// variants: - or CM_SHADOW_CATCHER=0 or CM_GROUND=0 CM_SUN_DISK=0 or CM_GROUND=0 CM_SUN_DISK=0 CM_ISOTROPIC=1 or CM_LAYERS=1 or CM_AOVS=1 or CM_LAYERS=1 CM_AOVS=1 or CM_ANALYTIC_LIGHTS=1 or CM_ANALYTIC_LIGHTS=1 CM_LAYERS=1 or CM_ANALYTIC_LIGHTS=1 CM_AOVS=1 or CM_ANALYTIC_LIGHTS=1 CM_LAYERS=1 CM_AOVS=1 or CM_ANALYTIC_LIGHTS=1 CM_EQUIANGULAR=1 or CM_ANALYTIC_LIGHTS=1 CM_LAYERS=1 CM_GROUPS=1 or CM_ANALYTIC_LIGHTS=1 CM_LAYERS=1 CM_AOVS=1 CM_GROUPS=1 or CM_ANALYTIC_LIGHTS=1 CM_EQUIANGULAR=1 CM_GROUPS=1
// variants: - or CM_SECOND_LOBE=1
// variants: - or CM_CHANNELS=1
// variants: - or CM_ENVIRONMENT=1
// excluded: CM_GROUND=0 CM_INSTANCES=1 or CM_GROUND=0 CM_CHANNELS=1 or CM_SHADOW_CATCHER=0 CM_INSTANCES=1 or CM_SHADOW_CATCHER=0 CM_CHANNELS=1 or CM_ISOTROPIC=1 CM_SECOND_LOBE=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#if CM_MARCH == 0 && !CM_INSTANCES
#define CM_KEEPS_ENTRY 1
#endif
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "traversal/march.glsl"
#include "path/path_state.glsl"
#include "path/path_store.glsl"
#include "path/pixel_store.glsl"
#include "path/pixel_slots.glsl"
#include "path/run.glsl"
#include "path/groups.glsl"

// Constants for the fields that only triangles use, so that they take no registers.
void cm_forget_triangles(inout CmPath p) {
#if !CM_EQUIANGULAR
  p.reach = 0.0;
#endif
  p.triangle = 0u;
  p.weights = vec2(0.0);
  p.behind = 0u;
  p.back = 0u;
  p.lifted = 0u;
  p.found = CM_FOUND_NOT_ASKED;
}

// Measures how many work groups the device runs at once. The lanes of a group that have a path come first.
void cm_count_group() {
  if (gl_LocalInvocationIndex != 0u) return;
  atomicMax(cm_running.y, atomicAdd(cm_running.x, 1u) + 1u);
  atomicAdd(cm_running.z, 1u);
}

void main() {
  uint lane = cm_ranked_lane();
  if (lane >= cm_lanes()) return;
  cm_count_group();
#if CM_GROUPS
  cm_group_lane = lane;
#endif
  CmPath p = cm_begin_path();
  uint samples = 0u;
  if (cm_block_begins()) {
    cm_take_slot(p, lane, samples);
  } else {
    p = cm_load_path(lane);
    cm_load_visit(p, lane);
    samples = cm_pixel_samples(cm_pixel_of(p.slot));
  }
  cm_forget_triangles(p);
  CmRun run = cm_run(p, samples, cm.dispatch.rounds);
  cm_forget_triangles(p);
  cm_store_path(p, lane);
  cm_store_visit(p, lane);
  uint block = cm_block_of(lane);
  if (p.stage != CM_STAGE_DONE) {
    cm_join_ranks(lane);
    atomicAdd(cm_blocks[block].y, 1u);
  }
  if (p.stage != CM_STAGE_DONE && samples == 0u) atomicAdd(cm_blocks[block].z, 1u);
  if (run.finished != 0u) atomicAdd(cm_blocks[block].w, run.finished);
  if (run.marches != 0u) atomicAdd(cm_total.x, (run.marches + CM_EVENTS - 1u) / CM_EVENTS);
  if (gl_LocalInvocationIndex == 0u) atomicAdd(cm_running.x, 0xffffffffu);
}
