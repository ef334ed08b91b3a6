// All stages of a path that meets no triangles, in one kernel. Shared by GLSL and C++; the includer provides what glsl/flight.glsl asks for, and
//   CmPixel cm_load_pixel(uvec2 at)               what a pixel's samples have come to
//   void cm_store_pixel(CmPixel pixel, uvec2 at)
#ifndef CM_RUN_GLSL
#define CM_RUN_GLSL

#include "flight.glsl"

// At most so many rounds of the samples of a pixel, which has so many. Returns how often it marched.
CM_FN uint cm_run(CM_INOUT(CmPath) p, CM_INOUT(uint) samples, uvec2 at, uint rounds) {
  uint marches = 0u;
  for (uint i = 0u; i < rounds && p.stage != CM_STAGE_DONE; ++i) {
    if (p.stage == CM_STAGE_CAMERA) cm_camera(p, samples, at);
    if (p.stage == CM_STAGE_AIM) {
      cm_aim(p);
      if (CM_INSTANCES == 0 && p.cell.x == CM_NONE) {
        p.event = CM_EVENT_ESCAPE;
        bool ends = !cm_is_equiangular(p) && p.start == CM_AT_CAMERA && p.to_ground == 0u;
        p.stage = ends ? CM_STAGE_FINISH : CM_STAGE_EVENT;
      }
    }
    marches += cm_travel(p);
    if (p.stage == CM_STAGE_FINISH) {
#if CM_GROUPS
      cm_finish_groups(p, at);
#endif
      CmPixel pixel = cm_load_pixel(at);
      cm_finish(p, pixel);
      cm_store_pixel(pixel, at);
      samples = pixel.samples;
    }
  }
  return marches;
}

#endif
