// A path, as it is kept between dispatches. Shared by GLSL and C++.
#ifndef CM_PATH_STATE_GLSL
#define CM_PATH_STATE_GLSL

// What a path does next.
#define CM_STAGE_CAMERA 0u  // begins: a camera ray is due
#define CM_STAGE_AIM 1u     // its ray's way through the box is to be found
#define CM_STAGE_FLY 2u     // marches
#define CM_STAGE_MEET 3u    // the tree is asked whether a triangle is nearer than the event that the march came to
#define CM_STAGE_EVENT 4u   // what follows the event, in the medium
#define CM_STAGE_VERTEX 5u  // what follows on a triangle: one that a flight has met, or that a shadow ray started on
#define CM_STAGE_FINISH 6u  // its sample is to be added to the pixel
#define CM_STAGE_DONE 7u    // nothing: its pixel has the samples it shall have

// The event that ends a ray.
#define CM_EVENT_NONE 0u
#define CM_EVENT_COLLISION 1u  // with the medium: its optical depth is used up; of shadow rays: or a triangle stops it
#define CM_EVENT_ESCAPE 2u     // out of the box, or at its end

// What its ray is.
#define CM_RAY_FLIGHT 0u
#define CM_RAY_TO_LIGHT 1u  // a next-event estimate: a shadow ray
#define CM_RAY_EQUIANGULAR 2u  // one from a point of the flight's way, after the flight (glsl/equiangular.glsl)

// Where its ray starts.
#define CM_AT_CAMERA 0u
#define CM_IN_MEDIUM 1u
#define CM_ON_TRIANGLE 2u
#define CM_ON_GROUND 3u

// What is known of triangles before a flight marches, in media that give off light.
#define CM_FOUND_NOT_ASKED 0u
#define CM_FOUND_NONE 1u
#define CM_FOUND_TRIANGLE 2u  // it ends there

// The one list of a path's fields: the struct, how it is packed into words (glsl/path_store.glsl), and so its size. In
// parts: a kernel need not store what it does not change.
// CM_PATH_RAY, the ray under way:
//   o               its start, cube space
//   d               its direction, cube space, per unit of world distance
//   t, t_end        world distance from o, and where the ray leaves the box, or ends
//   depth, depth_0  optical depth left before the collision (or the end of the shadow ray), and at the ray's start
//   cell, cache     that the ray is in, and what the march keeps of it; start_cell: it was in at o, in the medium
//   reach           its own end: a lamp, the host's surface
// CM_PATH_SUM, the sample so far:
//   radiance        without what is behind all
//   bounces         events of the path
//   steps           cells marched
//   number          the sample's, of its pixel
//   place           the pixel's (glsl/path_places.glsl)
//   ahead           with CM_EQUIANGULAR, of such a ray: how far ahead of o, along w, the path goes on
// CM_PATH_FLIGHT, what goes on to the next ray:
//   w               world direction of flight, kept during shadow rays
//   throughput      of the path
//   light           what the ray brings if nothing stops it: a shadow ray; a camera ray, of a layer's colour or of what
//                   is behind all
//   density         of a flight: by solid angle, with which it took its direction; of a shadow ray to what flights may
//                   come to by escaping: the flights' density there over the look's own; else 0
//   random, stream  of its random numbers; stream is the pixel's
// CM_PATH_ENDS, what is known of the ray's ends:
//   triangle, weights     that o is on, of its second and third vertex
//   stage, event, ray, start, found     as above
//   behind          1: the path met the side of the triangle from which its vertices turn clockwise
//   back            1: it met the back
//   blurred         1: it was scattered wider than a surface of the least roughness does
//   in_volume       1: this sample met the volume first
//   at_layer        1: it is the surface pass's colour, not the background, that waits at the camera ray's end
//   lifted          1: the ray started above the triangle that its path had met
//   to_ground       1: a flight comes to the ground if nothing stops it
//   finishes        with CM_EQUIANGULAR, of such a ray, 1: the path ends with it
//   seen            likewise, 1: the flight was a camera ray
//   group           with CM_GROUPS, of the light that a shadow ray looks for
// CM_PATH_VISIT, only with CM_INSTANCES, and only for kernels that march:
//   instance        that the ray marches through, or has entered last; of a collision the one that it is with
//   entry           where it entered that; -1 of the one that it started in
//   start_instance  that o is in, in the medium; then start_cell is a cell of that
//   met, met_cell   of a flight: where the nearest collision is that it knows, which is at t_end; CM_NONE: none
//   gathers         1: all is known of its end, and it goes through what glows and overlaps once more
// CM_PATH_WITHIN, only with CM_RICH, and only for kernels that know of triangles' materials:
//   within          first word of the material whose volume the flight is within, plus one; 0: of none
//   outside         likewise, what that lies in
//   through         1: the ray starts on the side of its triangle that the path did not come from
//   dispersed       1: the path is of one wavelength
// BITS have a number of bits of a word that they share with their neighbours.
#define CM_PATH_RAY(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                            \
  VEC3(o) FLOAT(t) VEC3(d) FLOAT(t_end) FLOAT(depth) FLOAT(depth_0) UVEC2(cell) UINT(cache) UVEC2(start_cell)        \
  FLOAT(reach)
#define CM_PATH_SUM(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS) VEC3(radiance) UINT(bounces) UINT(steps) UINT(number) UINT(place)             \
  CM_PATH_AHEAD(FLOAT)
#if CM_EQUIANGULAR
#define CM_PATH_AHEAD(FLOAT) FLOAT(ahead)
#else
#define CM_PATH_AHEAD(FLOAT)
#endif
#define CM_PATH_FLIGHT(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                         \
  VEC3(w) UINT(random) VEC3(throughput) UINT(stream) VEC3(light) FLOAT(density)
#define CM_PATH_ENDS(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                            \
  UINT(triangle) VEC2(weights) BITS(stage, 3) BITS(event, 2) BITS(ray, 2) BITS(start, 2) BITS(found, 2) BITS(behind, 1)            \
  BITS(back, 1) BITS(blurred, 1) BITS(in_volume, 1) BITS(at_layer, 1) BITS(lifted, 1) BITS(to_ground, 1) CM_PATH_PASSED(BITS)

#if CM_EQUIANGULAR || defined(CM_KEEPS_EQUIANGULAR) || CM_GROUPS
#define CM_PATH_PASSED(BITS) BITS(finishes, 1) BITS(seen, 1) CM_PATH_GROUP(BITS)
#else
#define CM_PATH_PASSED(BITS)
#endif
#if CM_GROUPS
#define CM_PATH_GROUP(BITS) BITS(group, 3)
#else
#define CM_PATH_GROUP(BITS)
#endif

#define CM_PATH_VISIT(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                          \
  UINT(instance) FLOAT(entry) UINT(start_instance) UINT(met) UVEC2(met_cell) BITS(gathers, 1)

#define CM_PATH_WITHIN(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                         \
  UINT(within) UINT(outside) BITS(through, 1) BITS(dispersed, 1)

#define CM_PATH_VEC3(name) vec3 name;
#define CM_PATH_VEC2(name) vec2 name;
#define CM_PATH_UVEC2(name) uvec2 name;
#define CM_PATH_FLOAT(name) float name;
#define CM_PATH_UINT(name) uint name;
#define CM_PATH_BITS(name, bits) uint name;

// Quads of words that each part takes: a part's words, and one for its bits.
#define CM_PATH_THREE(name) +3
#define CM_PATH_TWO(name) +2
#define CM_PATH_ONE(name) +1
#define CM_PATH_NO_WORD(name, bits)
#define CM_PATH_NO_BITS(name)
#define CM_PATH_BITS_OF(name, bits) +bits
#define CM_PATH_WORDS(PART)                                                                                          \
  (0 PART(CM_PATH_THREE, CM_PATH_TWO, CM_PATH_TWO, CM_PATH_ONE, CM_PATH_ONE, CM_PATH_NO_WORD) +                      \
   (31 PART(CM_PATH_NO_BITS, CM_PATH_NO_BITS, CM_PATH_NO_BITS, CM_PATH_NO_BITS, CM_PATH_NO_BITS, CM_PATH_BITS_OF)) / 32)
#define CM_RAY_QUADS ((CM_PATH_WORDS(CM_PATH_RAY) + 3) / 4)
#define CM_SUM_QUADS ((CM_PATH_WORDS(CM_PATH_SUM) + 3) / 4)
#define CM_FLIGHT_QUADS ((CM_PATH_WORDS(CM_PATH_FLIGHT) + 3) / 4)
#define CM_ENDS_QUADS ((CM_PATH_WORDS(CM_PATH_ENDS) + 3) / 4)
#define CM_VISIT_QUADS ((CM_PATH_WORDS(CM_PATH_VISIT) + 3) / 4)
#define CM_WITHIN_QUADS ((CM_PATH_WORDS(CM_PATH_WITHIN) + 3) / 4)
#define CM_PATH_QUADS (CM_RAY_QUADS + CM_SUM_QUADS + CM_FLIGHT_QUADS + CM_ENDS_QUADS)

struct CmPath {
  CM_PATH_RAY(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_SUM(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_FLIGHT(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_ENDS(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#if CM_INSTANCES
  CM_PATH_VISIT(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#endif
#if CM_RICH
  CM_PATH_WITHIN(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#endif
};

// A pixel's samples so far.
struct CmPixel {
  vec4 sum;         // of radiance in front of the background, and of alpha
  vec4 volume;      // the same of those that met the volume first
  vec3 background;  // mean of radiance that camera rays met behind all: exact where that is the same in each
  float square;     // mean of squared luminance, of both together
  uint samples;     // finished
  uint steps;       // cells marched, of all of them
  uint unsound;     // of those that are added now: whose light no film can hold
};

#endif
