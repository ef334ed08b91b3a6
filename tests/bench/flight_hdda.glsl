// Scattered rays and shadow rays through a NanoVDB grid by null collisions (Woodcock et al. 1965; Galtier et al. 2013;
// Novak et al., "Monte Carlo Methods for Volumetric Light Transport Simulation", EG 2018), with the majorants of
// march_hdda.glsl. It replaces free_flight.glsl's cm_fly for one volume without emission, triangles and equiangular
// sampling.
//
// Scattered rays use delta tracking: a collision is real with the probability density / majorant. With CM_RATIO, shadow
// rays use ratio tracking: each collision keeps the fraction that is not real, down to the weight at which free_flight.glsl
// switches to Russian roulette; from there on they use delta tracking. Without CM_RATIO, shadow rays use delta tracking
// throughout. Because no transmittance is known, MIS weights between shadow rays and scattered rays that may reach the
// same sky omit it.
//
// p.depth is the remaining optical depth of the majorant. p.depth_0 of a shadow ray is its transmittance so far.
#ifndef CM_FLIGHT_HDDA_GLSL
#define CM_FLIGHT_HDDA_GLSL

#define CM_MIN_PASSED 0.135335283f  // e^-2

// At most CM_CHUNK regions and collisions.
uint cm_fly(inout CmPath p) {
  vec3 inv_d = vec3(1.0) / p.d;
  bool to_light = p.ray != CM_RAY_SCATTERED;
  uint event = CM_EVENT_NONE;
  uvec3 cell = uvec3(p.cell, p.cache);
  for (int i = 0; i < CM_CHUNK && event == CM_EVENT_NONE; ++i) {
    float majorant = cm_nano_majorant(cell);
    float extinction = cm.medium.extinction * majorant;
    float t_1;
    ivec3 axis;
    cm_nano_exit(cell, p.o, p.d, inv_d, p.t, t_1, axis);
    float used = extinction * max(0.0, min(t_1, p.t_end) - p.t);
    p.steps += 1u;
    if (used > p.depth) {
      p.t += p.depth / extinction;
      ivec3 low = cm_nano_corner(cell);
      vec3 at = p.o + p.t * p.d;
      ivec3 voxel = clamp(ivec3(floor(at)), low, low + cm_nano_size(cell) - 1);
      float real = cm_nano_density(cell, voxel, at, majorant) / majorant;
      p.depth = cm_free_depth(cm_random(p.random, p.stream));
      if (CM_RATIO != 0 && to_light && p.depth_0 > CM_MIN_PASSED) {
        p.depth_0 *= 1.0 - real;
        p.light *= 1.0 - real;
        if (real >= 1.0) event = CM_EVENT_COLLISION;
      } else if (cm_random(p.random, p.stream) < real) {
        event = CM_EVENT_COLLISION;
      }
    } else {
      p.depth -= used;
      p.t = t_1;
      if (t_1 >= p.t_end) {
        event = CM_EVENT_ESCAPE;
      } else {
        cell = cm_nano_next(cell, p.o, p.d, t_1, axis);
        if (cell.x == CM_NONE) event = CM_EVENT_ESCAPE;
      }
    }
  }
  p.cell = cell.xy;
  p.cache = cell.z;
  return event;
}

#endif
