// trace.comp with twice as many paths as lanes, an experiment for GPUs (docs/performance.md, Predicted changes). A group
// of a warp has the rays of its paths in shared memory. In each turn all lanes do the same kind of work, on paths that wait for it.
// So paths with events do not hold back lanes that traverse cells. Paths do not depend on each other, so the pictures
// are those of trace.comp. In a copy of glsl/ it is added to trace.comp (tests/gpu/shader_variants.py). Shared by GLSL
// and CUDA (tests/gpu_cost/cuda/kernels.cu). The includer provides the functions of trace.comp.
#ifndef CM_TWO_PATHS_GLSL
#define CM_TWO_PATHS_GLSL

#define CM_GROUP_LANES 32u
#define CM_GROUP_PATHS 64u
#define CM_ENOUGH 28u         // paths that traverse cells, for which nothing else is done first
#define CM_TURNS_PER_ROUND 32u

// Kinds of work.
#define CM_WORK_MARCH 0u
#define CM_WORK_EVENT 1u
#define CM_WORK_CAMERA 2u  // finish a sample and start the next one
#define CM_WORKS 3u

// The paths: planes of four words per path. A march reads three of them and writes one, CM_QUAD_MARCH. The others are in
// the buffer of the paths, so that a multiprocessor has room for more groups.
#define CM_QUAD_RAY 0u        // o, t_end
#define CM_QUAD_DIRECTION 1u  // d, depth_0
#define CM_QUAD_MARCH 2u      // t, depth, cell, steps
#define CM_SHARED_QUADS 3u
shared uvec4 cm_group_paths[CM_GROUP_PATHS * CM_SHARED_QUADS];
shared uint cm_group_lanes[CM_GROUP_PATHS];    // in the dispatch; cm_lanes() or more: there is no path
shared uint cm_group_stages[CM_GROUP_PATHS];   // with the event, from bit 4 on
shared uint cm_group_lists[CM_WORKS * CM_GROUP_PATHS];
shared uint cm_group_counts[2u * CM_WORKS];    // of the lists; alternate turns
shared uint cm_group_marches;
shared uint cm_group_finished;

CM_FN uvec4 cm_quad(uint slot, uint quad) {
  if (quad < CM_SHARED_QUADS) return cm_group_paths[quad * CM_GROUP_PATHS + slot];
  return cm_paths[cm_group_lanes[slot] + quad * cm_lanes()];
}
CM_FN void cm_set_quad(uint slot, uint quad, uvec4 words) {
  if (quad < CM_SHARED_QUADS) {
    cm_group_paths[quad * CM_GROUP_PATHS + slot] = words;
  } else {
    cm_paths[cm_group_lanes[slot] + quad * cm_lanes()] = words;
  }
}
CM_FN uvec4 cm_words_of(vec3 v, uint w) { return uvec4(floatBitsToUint(v), w); }

CM_FN void cm_take_ray(CM_INOUT(CmPath) p, uint slot) {
  uvec4 ray = cm_quad(slot, CM_QUAD_RAY);
  uvec4 direction = cm_quad(slot, CM_QUAD_DIRECTION);
  uvec4 march = cm_quad(slot, CM_QUAD_MARCH);
  p.o = uintBitsToFloat(uvec3(ray));
  p.t_end = uintBitsToFloat(ray.w);
  p.d = uintBitsToFloat(uvec3(direction));
  p.depth_0 = uintBitsToFloat(direction.w);
  p.t = uintBitsToFloat(march.x);
  p.depth = uintBitsToFloat(march.y);
  p.cell = uvec2(march.z, 0u);
  p.cache = CM_NONE;
  p.steps = march.w;
}
CM_FN void cm_keep_march(CmPath p, uint slot) {
  cm_set_quad(slot, CM_QUAD_MARCH, uvec4(floatBitsToUint(vec2(p.t, p.depth)), p.cell.x, p.steps));
}

// samples: the number of samples of the path's pixel.
CM_FN CmPath cm_take(uint slot, CM_OUT(uint) samples) {
  CmPath p = cm_begin_path();
  cm_take_ray(p, slot);
  uvec4 scattered = cm_quad(slot, 3u);
  uvec4 throughput = cm_quad(slot, 4u);
  uvec4 light = cm_quad(slot, 5u);
  uvec4 radiance = cm_quad(slot, 6u);
  uvec4 rest = cm_quad(slot, 7u);
  p.w = uintBitsToFloat(uvec3(scattered));
  p.random = scattered.w;
  p.throughput = uintBitsToFloat(uvec3(throughput));
  p.stream = throughput.w;
  p.light = uintBitsToFloat(uvec3(light));
  p.pdf = uintBitsToFloat(light.w);
  p.radiance = uintBitsToFloat(uvec3(radiance));
  p.bounces = radiance.w;
  p.start_cell = uvec2(rest.x, 0u);
  p.slot = rest.y;
  // The sample's number is the first one of the picture plus that in the pixel.
  samples = rest.z;
  p.number = cm.integrator.first_sample + samples;
  p.ray = bitfieldExtract(rest.w, 0, 2);
  p.start = bitfieldExtract(rest.w, 2, 2);
  p.in_volume = bitfieldExtract(rest.w, 4, 1);
  p.at_layer = bitfieldExtract(rest.w, 5, 1);
  p.to_ground = bitfieldExtract(rest.w, 6, 1);
  p.stage = bitfieldExtract(cm_group_stages[slot], 0, 4);
  p.event = cm_group_stages[slot] >> 4;
  return p;
}

CM_FN void cm_keep(CmPath p, uint slot, uint samples) {
  cm_set_quad(slot, CM_QUAD_RAY, cm_words_of(p.o, floatBitsToUint(p.t_end)));
  cm_set_quad(slot, CM_QUAD_DIRECTION, cm_words_of(p.d, floatBitsToUint(p.depth_0)));
  cm_keep_march(p, slot);
  cm_set_quad(slot, 3u, cm_words_of(p.w, p.random));
  cm_set_quad(slot, 4u, cm_words_of(p.throughput, p.stream));
  cm_set_quad(slot, 5u, cm_words_of(p.light, floatBitsToUint(p.pdf)));
  cm_set_quad(slot, 6u, cm_words_of(p.radiance, p.bounces));
  uint bits = p.ray | (p.start << 2) | (p.in_volume << 4) | (p.at_layer << 5) | (p.to_ground << 6);
  cm_set_quad(slot, 7u, uvec4(p.start_cell.x, p.slot, samples, bits));
  cm_group_stages[slot] = p.stage | (p.event << 4);
}

// The path's lane in the dispatch: as cm_ranked_lane().
CM_FN uint cm_lane_of(uint slot) {
  uint index = gl_WorkGroupID.x * CM_GROUP_PATHS + slot;
  uint list = cm_list(0u);
  if (index == 0u) cm_active_counts[cm_list(2u) * CM_MAX_BLOCKS + cm_block()] = 0u;
  if (cm_block_begins()) return cm_block() * CM_BLOCK_LANES + index;
  if (index >= cm_active_counts[list * CM_MAX_BLOCKS + cm_block()]) return cm_lanes();
  return cm_slot_words[cm_list_at(list) + index];
}

CM_FN uint cm_work_of(uint stage) {
  if (stage == CM_STAGE_FLY) return CM_WORK_MARCH;
  if (stage == CM_STAGE_EVENT) return CM_WORK_EVENT;
  return stage == CM_STAGE_DONE ? CM_WORKS : CM_WORK_CAMERA;
}

// Begins the ray as cm_run does.
CM_FN void cm_aim_ray(CM_INOUT(CmPath) p) {
  cm_aim(p);
  if (p.cell.x != CM_NONE) return;
  p.event = CM_EVENT_ESCAPE;
  p.stage = p.start == CM_AT_CAMERA && !cm_goes_to_ground(p) ? CM_STAGE_FINISH : CM_STAGE_EVENT;
}

CM_FN void cm_march_turn(uint slot) {
  CmPath p = cm_begin_path();
  cm_take_ray(p, slot);
  uint event = cm_fly(p);
  cm_keep_march(p, slot);
  if (event != CM_EVENT_NONE) cm_group_stages[slot] = CM_STAGE_EVENT | (event << 4);
}

CM_FN void cm_event_turn(uint slot) {
  uint samples;
  CmPath p = cm_take(slot, samples);
  cm_handle(p, cm_in_medium());
  if (p.stage == CM_STAGE_AIM) cm_aim_ray(p);
  cm_keep(p, slot, samples);
}

CM_FN void cm_camera_turn(uint slot) {
  uint samples;
  CmPath p = cm_take(slot, samples);
  if (p.stage == CM_STAGE_FINISH) {
    uvec2 at = cm_pixel_of(p.slot);
    CmPixel pixel = cm_load_pixel(at);
    cm_finish(p, pixel);
    cm_store_pixel(pixel, at);
    samples = pixel.samples;
    atomicAdd(cm_group_finished, 1u);
    if (p.stage == CM_STAGE_DONE) cm_take_next_slot(p, samples);
  }
  if (p.stage == CM_STAGE_CAMERA) cm_camera(p, samples, cm_pixel_of(p.slot));
  if (p.stage == CM_STAGE_AIM) cm_aim_ray(p);
  cm_keep(p, slot, samples);
}

// Loads a path, or gives it its first pixel.
CM_FN void cm_load_slot(uint slot) {
  uint lane = cm_lane_of(slot);
  cm_group_lanes[slot] = lane;
  cm_group_stages[slot] = CM_STAGE_DONE;
  if (lane >= cm_lanes()) return;
  CmPath p = cm_begin_path();
  uint samples = 0u;
  if (cm_block_begins()) {
    cm_take_slot(p, lane, samples);
  } else {
    p = cm_load_path(lane);
    samples = cm_pixel_samples(cm_pixel_of(p.slot));
  }
  cm_keep(p, slot, samples);
}

CM_FN void cm_store_slot(uint slot) {
  uint lane = cm_group_lanes[slot];
  if (lane >= cm_lanes()) return;
  uint samples;
  CmPath p = cm_take(slot, samples);
  cm_store_path(p, lane);
  if (p.stage == CM_STAGE_DONE) return;
  uint block = cm_block_of(lane);
  cm_join_ranks(lane);
  atomicAdd(cm_blocks[block].y, 1u);
  if (samples == 0u) atomicAdd(cm_blocks[block].z, 1u);
}

// Puts the path into the list of its next work.
CM_FN void cm_list_slot(uint slot, uint turn) {
  uint work = cm_work_of(bitfieldExtract(cm_group_stages[slot], 0, 4));
  if (work == CM_WORKS) return;
  uint index = atomicAdd(cm_group_counts[(turn & 1u) * CM_WORKS + work], 1u);
  cm_group_lists[work * CM_GROUP_PATHS + index] = slot;
}

// The kernel.
CM_FN void cm_two_paths() {
  uint self = gl_LocalInvocationIndex;
  for (uint slot = self; slot < CM_GROUP_PATHS; slot += CM_GROUP_LANES) cm_load_slot(slot);
  if (self < 2u * CM_WORKS) cm_group_counts[self] = 0u;
  if (self == 0u) {
    cm_group_marches = 0u;
    cm_group_finished = 0u;
  }
  memoryBarrierBuffer();
  barrier();
  uint lane = cm_group_lanes[0];
  if (lane < cm_lanes()) cm_count_group();
  bool more = true;
  for (uint turn = 0u; turn < cm.dispatch.rounds * CM_TURNS_PER_ROUND && more; ++turn) {
    for (uint slot = self; slot < CM_GROUP_PATHS; slot += CM_GROUP_LANES) cm_list_slot(slot, turn);
    barrier();
    uint first = (turn & 1u) * CM_WORKS;
    uint marching = cm_group_counts[first + CM_WORK_MARCH];
    uint events = cm_group_counts[first + CM_WORK_EVENT];
    uint cameras = cm_group_counts[first + CM_WORK_CAMERA];
    bool marches = marching != 0u && (marching >= CM_ENOUGH || marching >= max(events, cameras));
    uint work = marches ? CM_WORK_MARCH : (events != 0u && events >= cameras ? CM_WORK_EVENT : CM_WORK_CAMERA);
    // The counts of the next turn: all lanes have read them before this turn's barrier.
    if (self < CM_WORKS) cm_group_counts[CM_WORKS - first + self] = 0u;
    more = marching + events + cameras != 0u;
    if (self < cm_group_counts[first + work]) {
      uint slot = cm_group_lists[work * CM_GROUP_PATHS + self];
      if (work == CM_WORK_MARCH) {
        cm_march_turn(slot);
      } else if (work == CM_WORK_EVENT) {
        cm_event_turn(slot);
      } else {
        cm_camera_turn(slot);
      }
    }
    if (self == 0u && marches) cm_group_marches += min(marching, CM_GROUP_LANES);
    memoryBarrierBuffer();
    barrier();
  }
  for (uint slot = self; slot < CM_GROUP_PATHS; slot += CM_GROUP_LANES) cm_store_slot(slot);
  if (self != 0u || lane >= cm_lanes()) return;
  uint block = cm_block_of(lane);
  atomicAdd(cm_blocks[block].w, cm_group_finished);
  // A full round of trace.comp traverses cells in up to 64 steps, as 16 turns do.
  atomicAdd(cm_total.x, (cm_group_marches + 15u) / 16u);
  atomicAdd(cm_running.x, 0xffffffffu);
}

#endif
