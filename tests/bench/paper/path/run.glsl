// The kernel of the paper as a peer: Algorithm 1 of Benyoub and Dupuy, "Adaptive Tetrahedral Grids for Volumetric
// Path-Tracing", SIGGRAPH Talks 2025, as our own code for our cells. In a copy of glsl/ it replaces run.glsl
// (tests/gpu/shader_variants.py).
//
// - Cells have one density. Their record of 36 bytes has the content of ours: neighbors, planes and density.
// - A lane runs whole samples, from the camera to the last event. All rays go on to the boundary of the grid.
// - The only light is the sun. Scattering is isotropic.
// - Each event multiplies the weight w by the albedo and ends the path with probability 1 - w. The weight of the other
//   paths is not divided by w, so the image is too dark.
//
// Lanes take another pixel when theirs is finished, as in our kernel. The paper has one thread per pixel.
#ifndef CM_RUN_GLSL
#define CM_RUN_GLSL

#include "path/free_flight.glsl"

#define CM_PAPER_EVENTS 1024u

struct CmRun {
  uint marches;
  uint finished;  // samples
};

// Marches until `depth` is used up, or to the boundary. Returns true in the first case; t is then the distance.
bool cm_paper_march(inout uvec3 cell, vec3 o, vec3 d, inout float t, inout float depth, inout uint steps) {
  CmMarchRay ray = cm_march_ray(o, d);
  ray.cone = 0u;  // no clear cones
  bool collided = false;
  while (!collided && cell.x != CM_NONE) {
    float t_1 = 0.0;
    CmBernstein r = CmBernstein(0.0);
    uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
    cm_march_step(cell, ray, t, t_1, r, next);
    steps += 1u;
    float extinction = CM_MEDIUM.extinction * cm_segment_mean(r);
    float used = extinction * (t_1 - t);
    collided = used > depth;
    if (collided) {
      t += depth / extinction;
    } else {
      depth -= used;
      t = t_1;
      cell = next;
    }
  }
  return collided;
}

// Runs a path that entered the grid.
void cm_paper_path(inout CmPath p) {
  uvec3 cell = uvec3(p.cell, CM_NONE);
  vec3 o = cm_in_volume_point(p.o);
  vec3 d = cm_in_volume(p.d);
  float t = p.t;
  float weight = 1.0;
  for (uint event = 0u; event < CM_PAPER_EVENTS; ++event) {
    float depth = cm_free_depth(cm_random(p.random, p.stream));
    if (!cm_paper_march(cell, o, d, t, depth, p.steps)) break;
    o += t * d;
    p.bounces += 1u;
    p.in_volume = 1u;
    weight *= CM_MEDIUM.albedo.x;
    if (cm_random(p.random, p.stream) > weight) break;
    uvec3 sun_cell = cell;
    float sun_t = 0.0;
    float sun_depth = 0.0;
    vec3 to_sun = cm_in_volume(cm_to_cube(cm.lights.sun_direction));
    CmMarchRay ray = cm_march_ray(o, to_sun);
    ray.cone = 0u;
    while (sun_cell.x != CM_NONE) {
      float t_1 = 0.0;
      CmBernstein r = CmBernstein(0.0);
      uvec3 next = uvec3(CM_NONE, 0u, CM_NONE);
      cm_march_step(sun_cell, ray, sun_t, t_1, r, next);
      p.steps += 1u;
      sun_depth += CM_MEDIUM.extinction * cm_segment_mean(r) * (t_1 - sun_t);
      sun_t = t_1;
      sun_cell = next;
    }
    p.radiance += (weight * exp(-sun_depth) * 0.0795774715) * cm.lights.sun_irradiance;
    float z = 2.0 * cm_random(p.random, p.stream) - 1.0;
    float angle = 6.28318531 * cm_random(p.random, p.stream);
    float across = sqrt(max(0.0, 1.0 - z * z));
    d = cm_in_volume(cm_to_cube(vec3(across * cos(angle), across * sin(angle), z)));
    t = 0.0;
  }
}

// Runs at most this many samples. samples: the number of samples of the path's pixel.
CmRun cm_run(inout CmPath p, inout uint samples, uint rounds) {
  CmRun run;
  run.marches = 0u;
  run.finished = 0u;
  for (uint i = 0u; i < rounds && p.stage != CM_STAGE_DONE; ++i) {
    uvec2 at = cm_pixel_of(p.slot);
    cm_camera(p, samples, at);
    cm_aim(p);
    if (p.cell.x != CM_NONE) cm_paper_path(p);
    CmPixel pixel = cm_load_pixel(at);
    cm_finish(p, pixel);
    cm_store_pixel(pixel, at);
    samples = pixel.samples;
    run.finished += 1u;
    run.marches += CM_EVENTS;
    if (p.stage == CM_STAGE_DONE) cm_take_next_slot(p, samples);
  }
  return run;
}

#endif
