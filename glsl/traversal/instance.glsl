// Finds the volume instances along a ray. Shared by GLSL and C++; the includer has instance_table.glsl before this.
#ifndef CM_INSTANCE_GLSL
#define CM_INSTANCE_GLSL
#include "common/numbers.glsl"

#ifndef __cplusplus
layout(std140, binding = CM_STORAGE_INSTANCES) readonly buffer CmInstances { CmInstance cm_instances[]; };
layout(std140, binding = CM_STORAGE_INSTANCE_NODES) readonly buffer CmInstanceNodes {
  CmInstanceNode cm_instance_nodes[];
};
#endif

#if CM_MOTION
CM_FN CmInstanceTransform cm_instance_end(uint at) {
  return CmInstanceTransform(cm_instances[at].space.from_cube_x, cm_instances[at].space.from_cube_y,
                    cm_instances[at].space.from_cube_z, cm_instances[at].space.cube_origin);
}
// A moving instance has two further records behind the table's: transforms at shutter open and at shutter close.
CM_FN bool cm_instance_moves(uint at) { return (cm_instances[at].flags & CM_INSTANCE_MOVES) != 0u; }
CM_FN CmInstanceTransform cm_instance_transform(uint at) {
  return cm_between(cm_instance_end(at + cm.space.volumes), cm_instance_end(at + 2u * cm.space.volumes));
}
#endif

// Transforms a vector and a point from the scene's frame to an instance's cube space.
CM_FN vec3 cm_in_instance(uint at, vec3 v) {
#if CM_MOTION
  if (cm_instance_moves(at)) return cm_to_instance(cm_instance_transform(at), v);
#endif
  CM_PRECISE vec3 turned = cm_instances[at].space.to_cube_x * v.x + cm_instances[at].space.to_cube_y * v.y +
                           cm_instances[at].space.to_cube_z * v.z;
  return turned;
}
CM_FN vec3 cm_in_instance_point(uint at, vec3 p) {
#if CM_MOTION
  if (cm_instance_moves(at)) {
    CmInstanceTransform standing = cm_instance_transform(at);
    return cm_to_instance(standing, p - standing.origin);
  }
#endif
  return cm_in_instance(at, p - cm_instances[at].space.cube_origin);
}

// Reciprocal of d for cm_instance_span. 0 counts as almost 0, so that no product is NaN.
CM_FN vec3 cm_instance_inverse(vec3 d) {
  return mix(vec3(1.0f, 1.0f, 1.0f) / d, vec3(1.0e30f), lessThan(abs(d), vec3(1.0e-30f)));
}

// Interval of a ray in a box, x to y; empty unless x < y. A ray along a face is inside only at the lower face: of boxes
// that share a face exactly one contains it, and a flat box never does. Rounding is monotone: for a larger box, x is
// not larger and y not smaller.
CM_FN vec2 cm_instance_span(vec3 o, vec3 inverse, vec3 low, vec3 high) {
  CM_PRECISE vec3 t_0 = (low - o) * inverse;
  CM_PRECISE vec3 t_1 = (high - o) * inverse;
  vec3 first = min(t_0, t_1);
  vec3 last = max(t_0, t_1);
  return vec2(max(max(first.x, first.y), max(first.z, 0.0f)), min(min(last.x, last.y), last.z));
}

#if CM_CLIP
// Clips the interval of a ray of cube space to the part where dot(normal, o + t d) + offset >= 0.
CM_FN vec2 cm_clip_by_plane(vec3 normal, float offset, vec3 o, vec3 d, vec2 span) {
  CM_PRECISE float height = normal.x * o.x + normal.y * o.y + normal.z * o.z + offset;
  CM_PRECISE float slope = normal.x * d.x + normal.y * d.y + normal.z * d.z;
  if (slope > 0.0f) return vec2(max(span.x, -height / slope), span.y);
  if (slope < 0.0f) return vec2(span.x, min(span.y, -height / slope));
  return height < 0.0f ? vec2(span.x, -3.0e38f) : span;
}

// Clips the interval of a ray to the planes of an instance, which are convex together. o, d: in its cube space.
CM_FN vec2 cm_clip_span(uint at, vec3 o, vec3 d, vec2 span) {
  uint first = cm_instances[at].clip >> 3u;
  uint end = first + (cm_instances[at].clip & 7u);
  for (uint i = first; i < end; ++i) {
    CmInstanceNode pair = cm_instance_nodes[i];
    span = cm_clip_by_plane(pair.low, uintBitsToFloat(pair.skip), o, d, span);
    span = cm_clip_by_plane(pair.high, uintBitsToFloat(pair.instance), o, d, span);
  }
  return span;
}

// Distance at which a ray leaves the planes of an instance.
CM_FN float cm_clip_end(uint at, vec3 o, vec3 d) { return cm_clip_span(at, o, d, vec2(0.0f, 3.0e38f)).y; }

// Returns false if the planes cut off this point of cube space.
CM_FN bool cm_clip_keeps(uint at, vec3 p) { return cm_clip_end(at, p, vec3(0.0f, 0.0f, 0.0f)) > 0.0f; }
#endif

// Finds the next instance that a ray o + t d, t >= 0, enters after `instance`, which it entered at `entry`. It is the
// minimum of (entry, number) above the given pair, among instances that have all of these flags and are entered before
// t_end. Begin with -1 and CM_INSTANCE_NONE. Returns false if there is none, and leaves both unchanged.
//
// Each instance is found once, and the order depends only on boxes and numbers: both tests of an instance use only its
// own data, and the tree skips only instances that fail them. A ray with NaN finds none. Takes O(nodes near the ray)
// per call, without a stack.
CM_FN bool cm_next_instance(vec3 o, vec3 d, float t_end, uint flags, CM_INOUT(float) entry, CM_INOUT(uint) instance) {
  vec3 inverse = cm_instance_inverse(d);
  float least = t_end;
  uint next = 0u;  // no instance enters at t_end
  uint nodes = cm_is_within(o, 1.0e15f) && cm_is_within(d, 1.0e15f) ? cm_instance_nodes[0].skip : 0u;
  uint i = 0u;
  while (i < nodes) {
    CmInstanceNode node = cm_instance_nodes[i];
    vec2 span = cm_instance_span(o, inverse, node.low, node.high);
    bool hits = span.x < span.y && span.x <= least && span.y > entry;
    uint at = node.instance;
    if (hits && at != CM_INSTANCE_NONE) {
      vec2 own = cm_instance_span(cm_in_instance_point(at, o), cm_instance_inverse(cm_in_instance(at, d)),
                                  cm_instances[at].space.box_min, cm_instances[at].space.box_max);
#if CM_CLIP
      own = cm_clip_span(at, cm_in_instance_point(at, o), cm_in_instance(at, d), own);
#endif
      float enters = max(own.x, span.x);
      bool after = enters > entry || (enters == entry && at > instance);
      bool before = enters < least || (enters == least && at < next);
      if (after && before && enters < min(own.y, span.y) && (cm_instances[at].flags & flags) == flags) {
        least = enters;
        next = at;
      }
    }
    i = hits ? i + 1u : node.skip;
  }
  if (!(least < t_end)) return false;
  entry = least;
  instance = next;
  return true;
}

// Picks an emissive instance in proportion to its power, by an alias table. drawn: a uniformly drawn instance; word: a
// random word.
CM_FN uint cm_glowing_instance(uint drawn, uint word) {
  return word < cm_instances[drawn].alias ? drawn : cm_instances[drawn].alias_other;
}

#endif
