// A path, as it is kept between dispatches. Shared by GLSL and C++.
#ifndef CM_PATH_STATE_GLSL
#define CM_PATH_STATE_GLSL

// What a path does next.
#define CM_STAGE_CAMERA 0u  // begins: a camera ray is due
#define CM_STAGE_AIM 1u     // its ray's way through the box is to be found
#define CM_STAGE_FLY 2u     // marches
#define CM_STAGE_DONE 3u    // nothing: its pixel has the samples it shall have

// What its ray is.
#define CM_RAY_FLIGHT 0u
#define CM_RAY_TO_LIGHT 1u  // a next-event estimate: a shadow ray

// Where its ray starts.
#define CM_AT_CAMERA 0u
#define CM_IN_MEDIUM 1u
#define CM_ON_TRIANGLE 2u

// The one list of a path's fields: the struct, how it is loaded and stored (glsl/trace.comp), by words, and
// so its size.
//   o               the ray's start, cube space
//   d               its direction, cube space, per unit of world distance
//   w               world direction of flight, kept during shadow rays
//   throughput      of the path
//   radiance        of this sample so far, without what is behind all
//   light           what the ray brings if nothing stops it: a shadow ray; a camera ray, of a layer's colour or of what
//                   is behind all
//   t, t_end        world distance from o, and where the ray leaves the box, or ends
//   depth, depth_0  optical depth left before the collision (or the end of the shadow ray), and at the ray's start
//   cell, cache     that the ray is in, and what the march keeps of it; start_cell: it was in at o, in the medium
//   stage, ray, start     as above
//   bounces         events of the path so far
//   blurred         1: it was scattered wider than a surface of the least roughness does
//   in_volume       1: this sample met the volume first
//   at_layer        1: it is the surface pass's colour, not the background, that waits at the camera ray's end
//   density         of a flight: by solid angle, with which it took its direction; of a shadow ray to what flights may
//                   come to by escaping: the flights' density there over the look's own; else 0
//   random, stream  of its random numbers
// and among triangles
//   triangle, weights     that o is on, of its second and third vertex
//   behind          1: the path met the side from which its vertices turn clockwise
//   reach           the ray's own end: a lamp, the host's surface
//   lifted          1: the ray started above the triangle that its path had met
#define CM_PATH_FIELDS(VEC3, VEC2, UVEC2, FLOAT, UINT)                                                               \
  VEC3(o) VEC3(d) VEC3(w) VEC3(throughput) VEC3(radiance) VEC3(light) FLOAT(t) FLOAT(t_end) FLOAT(depth)             \
  FLOAT(depth_0) UVEC2(cell) UINT(cache) UVEC2(start_cell) UINT(stage) UINT(ray) UINT(start) UINT(bounces)           \
  UINT(blurred) UINT(in_volume) UINT(at_layer) FLOAT(density) UINT(random) UINT(stream)
#define CM_PATH_TRIANGLE_FIELDS(VEC3, VEC2, UVEC2, FLOAT, UINT)                                                      \
  UINT(triangle) VEC2(weights) UINT(behind) FLOAT(reach) UINT(lifted)

#define CM_PATH_VEC3(name) vec3 name;
#define CM_PATH_VEC2(name) vec2 name;
#define CM_PATH_UVEC2(name) uvec2 name;
#define CM_PATH_FLOAT(name) float name;
#define CM_PATH_UINT(name) uint name;

struct CmPath {
  CM_PATH_FIELDS(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT)
  CM_PATH_TRIANGLE_FIELDS(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT)
};

// A pixel's samples so far.
struct CmPixel {
  vec4 sum;         // of radiance in front of the background, and of alpha
  vec4 volume;      // the same of those that met the volume first
  vec3 background;  // mean of radiance that camera rays met behind all: exact where that is the same in each
  float square;     // mean of squared luminance, of both together
  uint samples;     // finished
  uint steps;       // cells marched, of all of them
  uint marches;     // calls of cm_fly in this dispatch
};

#endif
