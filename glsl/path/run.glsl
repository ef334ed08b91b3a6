// Runs all stages of a path in one kernel, without triangles. Shared by GLSL and C++. The includer provides what
// glsl/path/free_flight.glsl asks for, and
//   uvec2 cm_pixel_of(uint slot)                  the path's pixel
//   CmPixel cm_load_pixel(uvec2 at)               the sums of its samples
//   void cm_store_pixel(CmPixel pixel, uvec2 at)
//   void cm_take_next_slot(inout CmPath p, inout uint samples)   gives it another pixel, if there is one
#ifndef CM_RUN_GLSL
#define CM_RUN_GLSL

#include "path/free_flight.glsl"

// Work done by lanes.
struct CmRun {
  uint marches;
  uint finished;  // samples
};

// Runs at most this many rounds. samples: the number of samples of the path's pixel.
CM_FN CmRun cm_run(CM_INOUT(CmPath) p, CM_INOUT(uint) samples, uint rounds) {
  CmRun run;
  run.marches = 0u;
  run.finished = 0u;
  for (uint i = 0u; i < rounds && p.stage != CM_STAGE_DONE; ++i) {
    if (p.stage == CM_STAGE_CAMERA) cm_camera(p, samples, cm_pixel_of(p.slot));
    if (p.stage == CM_STAGE_AIM) {
      cm_aim(p);
      if (CM_INSTANCES == 0 && p.cell.x == CM_NONE) {
        p.event = CM_EVENT_ESCAPE;
        bool ends = !cm_is_equiangular(p) && p.start == CM_AT_CAMERA && !cm_goes_to_ground(p);
        p.stage = ends ? CM_STAGE_FINISH : CM_STAGE_EVENT;
      }
    }
    run.marches += cm_travel(p);
    if (p.stage == CM_STAGE_FINISH) {
      uvec2 at = cm_pixel_of(p.slot);
#if CM_GROUPS
      cm_finish_groups(p, at);
#endif
      CmPixel pixel = cm_load_pixel(at);
      cm_finish(p, pixel);
      cm_store_pixel(pixel, at);
      samples = pixel.samples;
      run.finished += 1u;
      if (p.stage == CM_STAGE_DONE) cm_take_next_slot(p, samples);
    }
  }
  return run;
}

#endif
