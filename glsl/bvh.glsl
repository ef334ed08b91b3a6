// Rays against triangles, through the tree that src/surface/bvh.hpp builds. Shared by GLSL and C++; the includer provides
//   uvec4 cm_bvh_node(uint texel)       4 texels a node, node 0 is the root
//   uvec4 cm_bvh_triangle(uint texel)   3 texels a triangle, in the order of the leaves
// and, if it defines CM_HIT_ACCEPT before it includes this (alpha masks), for triangles flagged CM_TRIANGLE_ASK,
//   bool cm_hit_accept(uint triangle, vec2 barycentrics)   false: the ray goes on as if nothing were there
// Without CM_HIT_ACCEPT they are hit like any other. Nodes to come back to are kept in an array of each lane, or, where
// the includer defines CM_BVH_SHARED_STACK as the size of its work groups, in shared memory: GPUs have few registers.
// Where it defines CM_BVH_LOW and CM_BVH_HIGH, a box around all triangles, cm_bvh_near asks that alone. Where it defines
// CM_BVH_NUMBER(triangle), hits tell of that number.
//
// d need not be unit: t counts in its lengths, and hits have t_min < t < t_max. Components of d may be 0. Nothing is hit
// by a ray that starts beyond 1e12, or whose largest direction component is not in [1e-12, 1e12], or that is NaN.
//
// A node, 64 bytes: the boxes and links of both children, {low, link} {high, -} twice. A link below CM_BVH_LEAF is a
// node; else bits 29 and 30 are the leaf's triangles less one, bits 0 to 28 its first record.
// A record, 48 bytes: {v0, triangle} {v1, flags} {v2, 0}.
#ifndef CM_BVH_GLSL
#define CM_BVH_GLSL
#include "numbers.glsl"

#define CM_BVH_LEAF 0x80000000u
#define CM_BVH_NONE 0xffffffffu
#define CM_BVH_STACK 24  // the builder's trees are no deeper

// A triangle's flags. The other bits are the includer's.
#define CM_TRIANGLE_ASK 0x80000000u        // cm_hit_accept decides
#define CM_TRIANGLE_ONE_SIDED 0x40000000u  // no ray meets its back
#define CM_TRIANGLE_CLOCKWISE 0x20000000u  // its vertices turn clockwise seen from the front
#define CM_TRIANGLE_LEFT_OUT 0x10000000u   // for the builder: not in the tree
#define CM_TRIANGLE_USER 0x0fffffffu

// Whether this ray passes the backs of one-sided triangles; the includer may say.
#ifndef CM_BVH_CULLS
#define CM_BVH_CULLS true
#endif

#ifndef CM_BVH_NUMBER
#define CM_BVH_NUMBER(triangle) triangle
#endif

struct CmHit {
  float t;
  uint triangle;      // its number; CM_BVH_NONE: nothing hit
  uint record;        // its place in the tree, for cm_bvh_point and cm_bvh_normal
  uint flags;
  vec2 barycentrics;  // weights of v1 and v2
  bool front;
};

CM_FN vec3 cm_bvh_floats(uvec4 texel) { return uintBitsToFloat(uvec3(texel)); }

// Cyclic, so that the axis becomes z.
CM_FN vec3 cm_bvh_turn(vec3 v, uint axis) {
  return axis == 2u ? v : (axis == 1u ? vec3(v.z, v.x, v.y) : vec3(v.y, v.z, v.x));
}

#ifdef CM_BVH_SHARED_STACK
shared uint cm_bvh_stack[CM_BVH_STACK * CM_BVH_SHARED_STACK];
#define CM_BVH_KEPT(i) cm_bvh_stack[uint(i) * CM_BVH_SHARED_STACK + gl_LocalInvocationIndex]
#else
#define CM_BVH_KEPT(i) stack[i]
#endif

// Where a ray is in a box, [near, far], on the safe side: Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013, with more
// room, for the triangle's test rounds too. Without NaNs: a direction of 0 counts as 1e-37, its slab widened by slack.
CM_FN vec2 cm_bvh_slabs(vec3 low, vec3 high, vec3 o, vec3 inverse, vec3 slack) {
  vec3 t_0 = (low - o) * inverse;
  vec3 t_1 = (high - o) * inverse;
  vec3 near = min(t_0, t_1) - slack;
  vec3 far = max(t_0, t_1) + slack;
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z) * 1.000001f);
}

// One over d, and the slack that goes with it.
CM_FN vec3 cm_bvh_inverse(vec3 d, CM_OUT(vec3) slack) {
  vec3 size = abs(d);
  float longest = max(max(size.x, size.y), size.z);
  // A product of slack and a box's distance beyond any t; what lies 1e-12 off a slab still counts as inside.
  bvec3 flat_axis = lessThan(size, vec3(longest * 1.0e-24f));
  slack = mix(vec3(0.0f), vec3(1.0e25f), flat_axis);
  return mix(1.0f / mix(d, vec3(1.0f), flat_axis), vec3(1.0e37f), flat_axis);
}

#ifdef CM_BVH_LOW
// Whether the ray comes near any triangle: if not, none is hit.
CM_FN bool cm_bvh_near(vec3 o, vec3 d, float t_min, float t_max) {
  vec3 slack;
  vec3 inverse = cm_bvh_inverse(d, slack);
  vec2 bounds = cm_bvh_slabs(CM_BVH_LOW, CM_BVH_HIGH, o, inverse, slack);
  return max(bounds.x, t_min) <= min(bounds.y, t_max);
}
#endif

// Nothing has been hit yet, short of t_max.
CM_FN void cm_bvh_begin(float t_max, CM_OUT(CmHit) hit) {
  hit.t = min(t_max, 1.0e25f);  // beyond any hit, short of where the builder puts an empty box
  hit.triangle = CM_BVH_NONE;
  hit.record = 0u;
  hit.flags = 0u;
  hit.barycentrics = vec2(0.0f, 0.0f);
  hit.front = true;
}

// A hit that is nearer than the one given, t > t_first >= 0: the nearest, or with `any` the first one found.
CM_FN void cm_bvh_search(vec3 o, vec3 d, float t_first, bool any, CM_INOUT(CmHit) hit) {
  vec3 size = abs(d);
  float longest = max(max(size.x, size.y), size.z);
  bool sound = longest >= 1.0e-12f && cm_is_within(d, 1.0e12f) && cm_is_within(o, 1.0e12f);
  vec3 slack;
  vec3 inverse = cm_bvh_inverse(d, slack);
  // Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: the ray becomes the z axis.
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
      // Precise: triangles that share a vertex or an edge round alike, or rays slip through between them. An edge
      // function's rounding can make it 0, never turn its sign; 0 counts as inside.
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
      bool meets = inside && determinant != 0.0f && t > t_first && t < hit.t &&
                   (front || !CM_BVH_CULLS || (texel_1.w & CM_TRIANGLE_ONE_SIDED) == 0u);
#ifdef CM_HIT_ACCEPT
      // A loop of one turn at most: software drivers run an if's body for every lane, wanted or not.
      for (bool ask = meets && (texel_1.w & CM_TRIANGLE_ASK) != 0u; ask; ask = false) {
        meets = cm_hit_accept(texel_0.w, barycentrics);
      }
#endif
      if (meets) {
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

// The nearest hit, or with `any` the first one found.
CM_FN bool cm_bvh_trace(vec3 o, vec3 d, float t_min, float t_max, bool any, CM_OUT(CmHit) hit) {
  cm_bvh_begin(t_max, hit);
  cm_bvh_search(o, d, max(t_min, 0.0f), any, hit);
  return hit.triangle != CM_BVH_NONE;
}

// The nearest triangle with t_min < t < t_max, t_min >= 0. O(log n) in a good tree.
CM_FN bool cm_bvh_closest(vec3 o, vec3 d, float t_min, float t_max, CM_OUT(CmHit) hit) {
  return cm_bvh_trace(o, d, t_min, t_max, false, hit);
}

// Whether any triangle has t_min < t < t_max.
CM_FN bool cm_bvh_occluded(vec3 o, vec3 d, float t_min, float t_max) {
  CmHit hit;
  return cm_bvh_trace(o, d, t_min, t_max, true, hit);
}

// The point of a hit, from the triangle itself: nearer to it than o + t d.
CM_FN vec3 cm_bvh_point(uint record, vec2 barycentrics) {
  vec3 v_0 = cm_bvh_floats(cm_bvh_triangle(record * 3u));
  vec3 v_1 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 1u));
  vec3 v_2 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 2u));
  return v_0 + (v_1 - v_0) * barycentrics.x + (v_2 - v_0) * barycentrics.y;
}

// Its geometric normal, unit, out of the front.
CM_FN vec3 cm_bvh_normal(uint record) {
  vec3 v_0 = cm_bvh_floats(cm_bvh_triangle(record * 3u));
  uvec4 texel_1 = cm_bvh_triangle(record * 3u + 1u);
  vec3 e_1 = cm_bvh_floats(texel_1) - v_0;
  vec3 e_2 = cm_bvh_floats(cm_bvh_triangle(record * 3u + 2u)) - v_0;
  // Scaled first: products of short edges would vanish.
  vec3 size = max(abs(e_1), abs(e_2));
  float scale = 1.0f / max(max(max(size.x, size.y), size.z), 1.0e-30f);
  vec3 n = cross(e_1 * scale, e_2 * scale);
  float n_n = dot(n, n);
  n = n_n > 0.0f ? n * inversesqrt(n_n) : vec3(0.0f, 0.0f, 1.0f);
  return (texel_1.w & CM_TRIANGLE_CLOCKWISE) == 0u ? n : -n;
}

// p, a point on a surface, moved off it to the side of ng (unit) by some units in its last place: Waechter and Binder,
// "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, chapter 6, 2019.
CM_FN vec3 cm_offset_origin(vec3 p, vec3 ng) {
  ivec3 units = ivec3(ng * 256.0f);
  vec3 moved = intBitsToFloat(floatBitsToInt(p) + mix(units, -units, lessThan(p, vec3(0.0f))));
  return mix(moved, p + ng * (1.0f / 65536.0f), lessThan(abs(p), vec3(1.0f / 32.0f)));
}

#endif
