// Intersects rays with triangles, through the BVH built by src/surface/bvh.hpp. Shared by GLSL and C++; the includer
// provides
//   uvec4 cm_bvh_node(uint texel)       4 texels per node, node 0 is the root
//   uvec4 cm_bvh_triangle(uint texel)   3 texels per triangle, in the order of the leaves
// If it defines CM_HIT_ACCEPT before this (alpha masks), it also provides, for triangles flagged CM_TRIANGLE_ASK,
//   bool cm_hit_accept(uint triangle, vec2 barycentrics)   false: the ray ignores the triangle
// Without CM_HIT_ACCEPT the flag has no effect. The traversal stack is an array per lane. If the includer defines
// CM_BVH_SHARED_STACK as the size of its work groups, the stack is in shared memory, because GPUs have few registers.
// If it defines CM_BVH_LOW and CM_BVH_HIGH, the bounds of all triangles, cm_bvh_near tests only these. If it defines
// CM_BVH_NUMBER(triangle), hits return that number.
//
// d need not be unit: t counts in lengths of d, and hits have t_min < t < t_max. Components of d may be 0. A ray hits
// nothing if its origin is beyond 1e12, if its largest direction component is not in [1e-12, 1e12], or if it has a NaN.
//
// A node has 64 bytes: boxes and links of both children, {low, link} {high, -} twice. A link below CM_BVH_LEAF is a
// node. Otherwise bits 29 and 30 are the leaf's number of triangles minus one, and bits 0 to 28 its first record. A
// record has 48 bytes: {v0, triangle} {v1, flags} {v2, 0}.
#ifndef CM_BVH_GLSL
#define CM_BVH_GLSL
#include "common/numbers.glsl"

#define CM_BVH_LEAF 0x80000000u
#define CM_BVH_NONE 0xffffffffu
#define CM_BVH_STACK 24  // maximum depth of the builder's trees

// A triangle's flags. The other bits belong to the includer.
#define CM_TRIANGLE_ASK 0x80000000u        // cm_hit_accept decides
#define CM_TRIANGLE_ONE_SIDED 0x40000000u  // rays pass its back
#define CM_TRIANGLE_CLOCKWISE 0x20000000u  // its vertices are clockwise seen from the front
#define CM_TRIANGLE_LEFT_OUT 0x10000000u   // set by the builder: not in the tree
#define CM_TRIANGLE_USER 0x0fffffffu

// True if this ray passes the backs of one-sided triangles; the includer may define it.
#ifndef CM_BVH_CULLS
#define CM_BVH_CULLS true
#endif

#ifndef CM_BVH_NUMBER
#define CM_BVH_NUMBER(triangle) triangle
#endif

struct CmHit {
  float t;
  uint triangle;      // its number; CM_BVH_NONE: no hit
  uint record;        // its index in the tree, for cm_bvh_point and cm_bvh_normal
  uint flags;
  vec2 barycentrics;  // weights of v1 and v2
  bool front;
};

CM_FN vec3 cm_bvh_floats(uvec4 texel) { return uintBitsToFloat(uvec3(texel)); }

// Cyclic permutation that turns the axis into z.
CM_FN vec3 cm_bvh_turn(vec3 v, uint axis) {
  return axis == 2u ? v : (axis == 1u ? vec3(v.z, v.x, v.y) : vec3(v.y, v.z, v.x));
}

#ifdef CM_BVH_SHARED_STACK
shared uint cm_bvh_stack[CM_BVH_STACK * CM_BVH_SHARED_STACK];
#define CM_BVH_KEPT(i) cm_bvh_stack[uint(i) * CM_BVH_SHARED_STACK + gl_LocalInvocationIndex]
#else
#define CM_BVH_KEPT(i) stack[i]
#endif

// Conservative interval [near, far] of a ray in a box: Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013, with a larger
// margin, because the triangle test rounds too. Never NaN: a direction of 0 counts as 1e-37, and its slab is widened by
// slack.
CM_FN vec2 cm_bvh_slabs(vec3 low, vec3 high, vec3 o, vec3 inverse, vec3 slack) {
  vec3 t_0 = (low - o) * inverse;
  vec3 t_1 = (high - o) * inverse;
  vec3 near = min(t_0, t_1) - slack;
  vec3 far = max(t_0, t_1) + slack;
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z) * 1.000001f);
}

// Reciprocal of d, and the slack that belongs to it.
CM_FN vec3 cm_bvh_inverse(vec3 d, CM_OUT(vec3) slack) {
  vec3 size = abs(d);
  float longest = max(max(size.x, size.y), size.z);
  // The slack exceeds any t. A ray within 1e-12 of the slab counts as inside.
  bvec3 flat_axis = lessThan(size, vec3(longest * 1.0e-24f));
  slack = mix(vec3(0.0f), vec3(1.0e25f), flat_axis);
  return mix(1.0f / mix(d, vec3(1.0f), flat_axis), vec3(1.0e37f), flat_axis);
}

#ifdef CM_BVH_LOW
// Returns false if the ray misses the bounds of all triangles.
CM_FN bool cm_bvh_near(vec3 o, vec3 d, float t_min, float t_max) {
  vec3 slack;
  vec3 inverse = cm_bvh_inverse(d, slack);
  vec2 bounds = cm_bvh_slabs(CM_BVH_LOW, CM_BVH_HIGH, o, inverse, slack);
  return max(bounds.x, t_min) <= min(bounds.y, t_max);
}
#endif

// Initializes a hit: none before t_max.
CM_FN void cm_bvh_begin(float t_max, CM_OUT(CmHit) hit) {
  hit.t = min(t_max, 1.0e25f);  // beyond any hit, but before the position where the builder puts empty boxes
  hit.triangle = CM_BVH_NONE;
  hit.record = 0u;
  hit.flags = 0u;
  hit.barycentrics = vec2(0.0f, 0.0f);
  hit.front = true;
}

// Replaces the given hit by a nearer one with t > t_first >= 0: the nearest, or with `any` the first one found.
CM_FN void cm_bvh_search(vec3 o, vec3 d, float t_first, bool any, CM_INOUT(CmHit) hit) {
  vec3 size = abs(d);
  float longest = max(max(size.x, size.y), size.z);
  bool sound = longest >= 1.0e-12f && cm_is_within(d, 1.0e12f) && cm_is_within(o, 1.0e12f);
  vec3 slack;
  vec3 inverse = cm_bvh_inverse(d, slack);
  // Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: shears the ray to the z axis.
  uint axis = size.z >= size.x && size.z >= size.y ? 2u : (size.y >= size.x ? 1u : 0u);
  vec3 turned = cm_bvh_turn(d, axis);
  float inverse_z = 1.0f / turned.z;
  float shear_x = turned.x * inverse_z;
  float shear_y = turned.y * inverse_z;

#ifndef CM_BVH_SHARED_STACK
  uint stack[CM_BVH_STACK];
#endif
  int top = 0;
  uint link = sound ? 0u : CM_BVH_NONE;
  while (link != CM_BVH_NONE) {
    while (link < CM_BVH_LEAF) {
      uint texel = link * 4u;
      uvec4 low_0 = cm_bvh_node(texel);
      uvec4 low_1 = cm_bvh_node(texel + 2u);
      vec2 slabs_0 = cm_bvh_slabs(cm_bvh_floats(low_0), cm_bvh_floats(cm_bvh_node(texel + 1u)), o, inverse, slack);
      vec2 slabs_1 = cm_bvh_slabs(cm_bvh_floats(low_1), cm_bvh_floats(cm_bvh_node(texel + 3u)), o, inverse, slack);
      bool hit_0 = max(slabs_0.x, t_first) <= min(slabs_0.y, hit.t);
      bool hit_1 = max(slabs_1.x, t_first) <= min(slabs_1.y, hit.t);
      bool first = hit_0 && (!hit_1 || slabs_0.x <= slabs_1.x);
      link = first ? low_0.w : low_1.w;
      if (hit_0 && hit_1) {
        CM_BVH_KEPT(top) = first ? low_1.w : low_0.w;
        ++top;
      }
      if (!hit_0 && !hit_1) {
        --top;
        link = top >= 0 ? CM_BVH_KEPT(max(top, 0)) : CM_BVH_NONE;
      }
    }
    uint record = link & 0x1fffffffu;
    uint end = link == CM_BVH_NONE ? record : record + ((link >> 29) & 3u) + 1u;
    for (; record < end; ++record) {
      uvec4 texel_0 = cm_bvh_triangle(record * 3u);
      uvec4 texel_1 = cm_bvh_triangle(record * 3u + 1u);
      uvec4 texel_2 = cm_bvh_triangle(record * 3u + 2u);
      vec3 a = cm_bvh_turn(cm_bvh_floats(texel_0) - o, axis);
      vec3 b = cm_bvh_turn(cm_bvh_floats(texel_1) - o, axis);
      vec3 c = cm_bvh_turn(cm_bvh_floats(texel_2) - o, axis);
      // Precise: triangles that share a vertex or an edge must round alike, or rays slip between them. Rounding can
      // turn an edge function into 0, but never flip its sign; 0 counts as inside.
      CM_PRECISE float a_x = a.x - shear_x * a.z;
      CM_PRECISE float a_y = a.y - shear_y * a.z;
      CM_PRECISE float b_x = b.x - shear_x * b.z;
      CM_PRECISE float b_y = b.y - shear_y * b.z;
      CM_PRECISE float c_x = c.x - shear_x * c.z;
      CM_PRECISE float c_y = c.y - shear_y * c.z;
      CM_PRECISE float u = c_x * b_y - c_y * b_x;
      CM_PRECISE float v = a_x * c_y - a_y * c_x;
      CM_PRECISE float w = b_x * a_y - b_y * a_x;
      bool inside = (u >= 0.0f && v >= 0.0f && w >= 0.0f) || (u <= 0.0f && v <= 0.0f && w <= 0.0f);
      float determinant = u + v + w;
      float inverse_determinant = determinant != 0.0f ? 1.0f / determinant : 0.0f;
      vec2 barycentrics = vec2(v, w) * inverse_determinant;
      float t = (u * a.z + v * b.z + w * c.z) * inverse_determinant * inverse_z;
      bool front = (determinant < 0.0f) == ((turned.z < 0.0f) == ((texel_1.w & CM_TRIANGLE_CLOCKWISE) == 0u));
      bool hits = inside && determinant != 0.0f && t > t_first && t < hit.t &&
                   (front || !CM_BVH_CULLS || (texel_1.w & CM_TRIANGLE_ONE_SIDED) == 0u);
#ifdef CM_HIT_ACCEPT
      // A loop of at most one iteration: software drivers execute the body of an `if` for every lane.
      for (bool ask = hits && (texel_1.w & CM_TRIANGLE_ASK) != 0u; ask; ask = false) {
        hits = cm_hit_accept(texel_0.w, barycentrics);
      }
#endif
      if (hits) {
        hit.t = t;
        hit.triangle = CM_BVH_NUMBER(texel_0.w);
        hit.record = record;
        hit.flags = texel_1.w;
        hit.barycentrics = barycentrics;
        hit.front = front;
      }
    }
    --top;
    link = top >= 0 && !(any && hit.triangle != CM_BVH_NONE) ? CM_BVH_KEPT(max(top, 0)) : CM_BVH_NONE;
  }
}

// Finds the nearest hit, or with `any` the first one found.
CM_FN bool cm_bvh_trace(vec3 o, vec3 d, float t_min, float t_max, bool any, CM_OUT(CmHit) hit) {
  cm_bvh_begin(t_max, hit);
  cm_bvh_search(o, d, max(t_min, 0.0f), any, hit);
  return hit.triangle != CM_BVH_NONE;
}

// Finds the nearest triangle with t_min < t < t_max, t_min >= 0. O(log n) in a good tree.
CM_FN bool cm_bvh_closest(vec3 o, vec3 d, float t_min, float t_max, CM_OUT(CmHit) hit) {
  return cm_bvh_trace(o, d, t_min, t_max, false, hit);
}

// Returns true if any triangle has t_min < t < t_max.
CM_FN bool cm_bvh_occluded(vec3 o, vec3 d, float t_min, float t_max) {
  CmHit hit;
  return cm_bvh_trace(o, d, t_min, t_max, true, hit);
}

// Point of a hit, interpolated on the triangle: more exact than o + t d.
CM_FN vec3 cm_bvh_point(uint record, vec2 barycentrics) {
  vec3 v_0 = cm_bvh_floats(cm_bvh_triangle(record * 3u));
  vec3 v_1 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 1u));
  vec3 v_2 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 2u));
  return v_0 + (v_1 - v_0) * barycentrics.x + (v_2 - v_0) * barycentrics.y;
}

// Geometric normal of the front side, unit.
CM_FN vec3 cm_bvh_normal(uint record) {
  vec3 v_0 = cm_bvh_floats(cm_bvh_triangle(record * 3u));
  uvec4 texel_1 = cm_bvh_triangle(record * 3u + 1u);
  vec3 e_1 = cm_bvh_floats(texel_1) - v_0;
  vec3 e_2 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 2u)) - v_0;
  // Scaled first, because products of short edges would underflow.
  vec3 size = max(abs(e_1), abs(e_2));
  float scale = 1.0f / max(max(max(size.x, size.y), size.z), 1.0e-30f);
  vec3 n = cross(e_1 * scale, e_2 * scale);
  float n_n = dot(n, n);
  n = n_n > 0.0f ? n * inversesqrt(n_n) : vec3(0.0f, 0.0f, 1.0f);
  return (texel_1.w & CM_TRIANGLE_CLOCKWISE) == 0u ? n : -n;
}

// Moves a point p on a surface to the side of ng (unit) by some units in the last place: Waechter and Binder, "A Fast
// and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, chapter 6, 2019.
CM_FN vec3 cm_offset_origin(vec3 p, vec3 ng) {
  ivec3 units = ivec3(ng * 256.0f);
  vec3 moved = intBitsToFloat(floatBitsToInt(p) + mix(units, -units, lessThan(p, vec3(0.0f))));
  return mix(moved, p + ng * (1.0f / 65536.0f), lessThan(abs(p), vec3(1.0f / 32.0f)));
}

#endif
