// Which instances of volumes a ray comes to. Shared by GLSL and C++; the includer has instance_table.glsl before this.
#ifndef CM_INSTANCE_GLSL
#define CM_INSTANCE_GLSL
#include "numbers.glsl"

#ifndef __cplusplus
layout(std140, binding = CM_STORAGE_INSTANCES) readonly buffer CmInstances { CmInstance cm_instances[]; };
layout(std140, binding = CM_STORAGE_INSTANCE_NODES) readonly buffer CmInstanceNodes {
  CmInstanceNode cm_instance_nodes[];
};
#endif

#if CM_MOTION
CM_FN CmStanding cm_instance_end(uint at) {
  return CmStanding(cm_instances[at].space.from_cube_x, cm_instances[at].space.from_cube_y,
                    cm_instances[at].space.from_cube_z, cm_instances[at].space.cube_origin);
}
// One that moves: behind the table's records are others, of where all stand as the shutter opens and as it closes.
CM_FN bool cm_instance_moves(uint at) { return (cm_instances[at].flags & CM_INSTANCE_MOVES) != 0u; }
CM_FN CmStanding cm_instance_standing(uint at) {
  return cm_between(cm_instance_end(at + cm.space.volumes), cm_instance_end(at + 2u * cm.space.volumes));
}
#endif

// A vector and a point of the scene's frame in an instance's cube space.
CM_FN vec3 cm_in_instance(uint at, vec3 v) {
#if CM_MOTION
  if (cm_instance_moves(at)) return cm_in_standing(cm_instance_standing(at), v);
#endif
  CM_PRECISE vec3 turned = cm_instances[at].space.to_cube_x * v.x + cm_instances[at].space.to_cube_y * v.y +
                           cm_instances[at].space.to_cube_z * v.z;
  return turned;
}
CM_FN vec3 cm_in_instance_point(uint at, vec3 p) {
#if CM_MOTION
  if (cm_instance_moves(at)) {
    CmStanding standing = cm_instance_standing(at);
    return cm_in_standing(standing, p - standing.origin);
  }
#endif
  return cm_in_instance(at, p - cm_instances[at].space.cube_origin);
}

// One over d, as cm_instance_span takes it: 0 counts as next to 0, so that no product of it is NaN.
CM_FN vec3 cm_instance_inverse(vec3 d) {
  return mix(vec3(1.0f, 1.0f, 1.0f) / d, vec3(1.0e30f), lessThan(abs(d), vec3(1.0e-30f)));
}

// Where a ray is in a box: from x to y, nowhere unless x < y. Along a face, only at its lower end: of boxes that share a
// face one has it, and a flat box has none. Monotone, however it rounds: of a larger box x is not larger, y not smaller.
CM_FN vec2 cm_instance_span(vec3 o, vec3 inverse, vec3 low, vec3 high) {
  CM_PRECISE vec3 t_0 = (low - o) * inverse;
  CM_PRECISE vec3 t_1 = (high - o) * inverse;
  vec3 first = min(t_0, t_1);
  vec3 last = max(t_0, t_1);
  return vec2(max(max(first.x, first.y), max(first.z, 0.0f)), min(min(last.x, last.y), last.z));
}

// The instance that a ray o + t d, t >= 0, enters next, after the one that it has entered at `entry`: the least by
// (entry, number) that is more than the one given and enters before t_end; of those alone that have all of these flags.
// Begin with -1 and CM_INSTANCE_NONE. False: there is no other; both are then as they were.
//
// Each instance is met once, and the order depends on their boxes and numbers alone: both tests of an instance are its
// own, and the tree leaves out only what fails them. A ray that is no number comes to none. O(nodes near the ray) a
// call, without a stack.
CM_FN bool cm_next_instance(vec3 o, vec3 d, float t_end, uint flags, CM_INOUT(float) entry, CM_INOUT(uint) instance) {
  vec3 inverse = cm_instance_inverse(d);
  float least = t_end;
  uint next = 0u;  // none enters at t_end
  uint nodes = cm_is_within(o, 1.0e15f) && cm_is_within(d, 1.0e15f) ? cm_instance_nodes[0].skip : 0u;
  uint i = 0u;
  while (i < nodes) {
    CmInstanceNode node = cm_instance_nodes[i];
    vec2 span = cm_instance_span(o, inverse, node.low, node.high);
    bool meets = span.x < span.y && span.x <= least && span.y > entry;
    uint at = node.instance;
    if (meets && at != CM_INSTANCE_NONE) {
      vec2 own = cm_instance_span(cm_in_instance_point(at, o), cm_instance_inverse(cm_in_instance(at, d)),
                                  cm_instances[at].space.box_min, cm_instances[at].space.box_max);
      float enters = max(own.x, span.x);
      bool after = enters > entry || (enters == entry && at > instance);
      bool before = enters < least || (enters == least && at < next);
      if (after && before && enters < min(own.y, span.y) && (cm_instances[at].flags & flags) == flags) {
        least = enters;
        next = at;
      }
    }
    i = meets ? i + 1u : node.skip;
  }
  if (!(least < t_end)) return false;
  entry = least;
  instance = next;
  return true;
}

// Of instances whose cells give off light, in proportion to how much: `drawn` evenly among all, and a random word.
CM_FN uint cm_glowing_instance(uint drawn, uint word) {
  return word < cm_instances[drawn].alias ? drawn : cm_instances[drawn].alias_other;
}

#endif
