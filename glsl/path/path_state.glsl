// The state of a path between dispatches. Shared by GLSL and C++.
#ifndef CM_PATH_STATE_GLSL
#define CM_PATH_STATE_GLSL

// The path's next step.
#define CM_STAGE_CAMERA 0u     // start a camera ray
#define CM_STAGE_AIM 1u        // clip the ray to the bounds and find its first cell
#define CM_STAGE_FLY 2u        // traverse the grid
#define CM_STAGE_INTERSECT 3u  // test in the BVH whether a triangle is nearer than the event of the traversal
#define CM_STAGE_EVENT 4u      // handle the event in the medium or on the ground
#define CM_STAGE_VERTEX 5u     // handle the event on a triangle: a hit, or the end of a shadow ray that started there
#define CM_STAGE_FINISH 6u     // add the sample to its pixel
#define CM_STAGE_DONE 7u       // nothing: the pixel has all its samples

// The event that ended a ray.
#define CM_EVENT_NONE 0u
#define CM_EVENT_COLLISION 1u  // the optical depth is used up in the medium; shadow rays: or a triangle blocks it
#define CM_EVENT_ESCAPE 2u     // the ray left the bounds or reached its end

// The kind of a ray.
#define CM_RAY_SCATTERED 0u
#define CM_RAY_TO_LIGHT 1u  // shadow ray of next-event estimation
#define CM_RAY_EQUIANGULAR 2u  // shadow ray from a point of the scattered ray, after that ray (glsl/path/equiangular.glsl)

// The location of a ray's origin.
#define CM_AT_CAMERA 0u
#define CM_IN_MEDIUM 1u
#define CM_ON_TRIANGLE 2u
#define CM_ON_GROUND 3u

// Result of the BVH query before the traversal. In emissive media the query comes first.
#define CM_FOUND_NOT_ASKED 0u
#define CM_FOUND_NONE 1u
#define CM_FOUND_TRIANGLE 2u  // the ray ends at a triangle

// The only list of a path's fields. It defines the struct, its packing into words (glsl/path/path_store.glsl) and its
// size. It has parts, because a kernel need not store fields that it does not change. CM_PATH_RAY, the current ray:
//   o               its origin, cube space
//   d               its direction, cube space, per unit of world distance
//   t, t_end        world distance from o; distance where the ray leaves the bounds or ends
//   depth, depth_0  optical depth left until the collision (or the end of the shadow ray); the same at the ray's origin
//   cell, cache     current cell, and the traversal's cached data of it; start_cell: cell of o if o is in the medium
//   reach           distance where the ray itself ends: at a light or at the host's surface
// CM_PATH_SUM, the sample so far:
//   radiance        sum, without the background
//   bounces         number of events
//   steps           number of cells traversed
//   number          number of the sample in its pixel
//   slot            slot of its pixel (glsl/path/pixel_slots.glsl)
//   ahead           CM_RAY_EQUIANGULAR only: distance along w from o to the point where the path continues
// CM_PATH_SCATTERED, state that passes to the next ray:
//   w               world direction of the camera or scattered ray; kept while a shadow ray is traced
//   throughput      of the path
//   light           radiance that an unblocked ray adds. Shadow ray: the light's. Camera ray: the layer's color or the
//                   background
//   pdf             Scattered ray: solid-angle pdf of its direction. Shadow ray to a distant light: scattering pdf
//                   over light pdf, for MIS. Other shadow rays: 0
//   random, stream  state of the random generator; its stream, which belongs to the pixel
// CM_PATH_ENDS, the two ends of the ray:
//   triangle, weights     triangle of o; barycentrics of its second and third vertex
//   stage, event, ray, start, found     see the constants above
//   behind          1: the path arrived on the side from which the triangle's vertices are clockwise
//   back            1: the path hit the back face
//   blurred         1: a bounce was wider than the lobe of a surface with the minimum roughness (path regularization)
//   in_volume       1: the sample's first event was in the volume
//   at_layer        1: the camera ray ends at the surface pass and gets its color, not the background
//   lifted          1: the ray's origin is above its triangle (cm_lift)
//   to_ground       1: a ray that nothing blocks hits the ground
//   finishes        CM_RAY_EQUIANGULAR only, 1: the path ends after this ray
//   seen            CM_RAY_EQUIANGULAR only, 1: the ray that it samples is a camera ray
//   group           CM_GROUPS only: light group of the shadow ray's light
// CM_PATH_VISIT, only with CM_INSTANCES, and only in kernels that traverse volumes:
//   instance        volume instance that the ray traverses or entered last; after a collision, the instance it is with
//   entry           distance where the ray entered that instance; -1 for the instance that contains o
//   start_instance  instance that contains o if o is in a medium; start_cell is a cell of it
//   collision_instance, collision_cell   scattered or camera ray: instance (or CM_NONE) and cell of the nearest
//                   collision so far, at t_end
//   gathers         1: the ray's end is known, and a second sweep visits the emissive overlapping instances
// CM_PATH_WITHIN, only with CM_EXTENDED_BSDF, and only in kernels that use triangle materials:
//   within          first word of the material whose volume contains the ray, plus one; 0: none
//   outside         the same for the volume that encloses `within`
//   through         1: the ray's origin is on the other side of its triangle than the path came from
//   dispersed       1: the path has a single wavelength
// BITS fields have a number of bits in a word that they share with their neighbors.
#define CM_PATH_RAY(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                            \
  VEC3(o) FLOAT(t) VEC3(d) FLOAT(t_end) FLOAT(depth) FLOAT(depth_0) UVEC2(cell) UINT(cache) UVEC2(start_cell)        \
  FLOAT(reach)
#define CM_PATH_SUM(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                            \
  VEC3(radiance) UINT(bounces) UINT(steps) UINT(number) UINT(slot) CM_PATH_AHEAD(FLOAT)
#if CM_EQUIANGULAR
#define CM_PATH_AHEAD(FLOAT) FLOAT(ahead)
#else
#define CM_PATH_AHEAD(FLOAT)
#endif
#define CM_PATH_SCATTERED(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                         \
  VEC3(w) UINT(random) VEC3(throughput) UINT(stream) VEC3(light) FLOAT(pdf)
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
  UINT(instance) FLOAT(entry) UINT(start_instance) UINT(collision_instance) UVEC2(collision_cell) BITS(gathers, 1)

#define CM_PATH_WITHIN(VEC3, VEC2, UVEC2, FLOAT, UINT, BITS)                                                         \
  UINT(within) UINT(outside) BITS(through, 1) BITS(dispersed, 1)

#define CM_PATH_VEC3(name) vec3 name;
#define CM_PATH_VEC2(name) vec2 name;
#define CM_PATH_UVEC2(name) uvec2 name;
#define CM_PATH_FLOAT(name) float name;
#define CM_PATH_UINT(name) uint name;
#define CM_PATH_BITS(name, bits) uint name;

// Number of 4-word quads per part: the words of the part, and one word per 32 bits of its bit fields.
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
#define CM_SCATTERED_QUADS ((CM_PATH_WORDS(CM_PATH_SCATTERED) + 3) / 4)
#define CM_ENDS_QUADS ((CM_PATH_WORDS(CM_PATH_ENDS) + 3) / 4)
#define CM_VISIT_QUADS ((CM_PATH_WORDS(CM_PATH_VISIT) + 3) / 4)
#define CM_WITHIN_QUADS ((CM_PATH_WORDS(CM_PATH_WITHIN) + 3) / 4)
#define CM_PATH_QUADS (CM_RAY_QUADS + CM_SUM_QUADS + CM_SCATTERED_QUADS + CM_ENDS_QUADS)

struct CmPath {
  CM_PATH_RAY(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_SUM(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_SCATTERED(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
  CM_PATH_ENDS(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#if CM_INSTANCES
  CM_PATH_VISIT(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#endif
#if CM_EXTENDED_BSDF
  CM_PATH_WITHIN(CM_PATH_VEC3, CM_PATH_VEC2, CM_PATH_UVEC2, CM_PATH_FLOAT, CM_PATH_UINT, CM_PATH_BITS)
#endif
};

// The sums of a pixel's samples.
struct CmPixel {
  vec4 sum;         // radiance in front of the background, and alpha
  vec4 volume;      // the same, only samples whose first event was in the volume
  vec3 background;  // mean background radiance of camera rays; exact where it is the same for all of them
  float square;     // mean squared luminance of front and background together
  uint samples;     // number of finished samples
  uint steps;       // number of cells traversed by all of them
  uint unsound;     // number of samples in this update whose radiance the film cannot hold
};

#endif
