// Radiance by light group. Each contribution of a path is also added to the group of its light, in memory beside the
// path; a finished sample's sums are added to the film. Only with CM_GROUPS; the includer has path.glsl and
// path_store.glsl before this. A kernel sets cm_group_lane to the lane of its path.
#ifndef CM_GROUPS_GLSL
#define CM_GROUPS_GLSL
#if CM_GROUPS

// Sums of radiance, one layer per group. The last two are the sky and the sun as seen by cameras, which also have
// groups.
layout(rgba32f, binding = CM_IMAGE_GROUPS) uniform image2DArray cm_groups;

uint cm_group_index(uint group) { return cm_group_lane + uint(CM_FIRST_GROUPS + int(group)) * cm_lanes(); }

// Groups without a layer are added to the first.
void cm_add_to_group(uint group, vec3 radiance) {
  if (radiance == vec3(0.0)) return;
  uint at = cm_group_index(group < cm.integrator.groups ? group : 0u);
  cm_paths[at] = uvec4(floatBitsToUint(uintBitsToFloat(cm_paths[at].xyz) + radiance), 0u);
}

void cm_begin_groups() {
  for (uint i = 0u; i < cm.integrator.groups; ++i) cm_paths[cm_group_index(i)] = uvec4(0u);
}

void cm_add_to_layer(uvec2 at, uint layer, vec3 radiance) {
  if (radiance == vec3(0.0)) return;
  ivec3 texel = ivec3(ivec2(at), int(layer));
  imageStore(cm_groups, texel, imageLoad(cm_groups, texel) + vec4(radiance, 0.0));
}

// Called before cm_finish.
void cm_finish_groups(CmPath p, uvec2 at) {
  if (!cm_is_sound(p)) return;
  uint count = cm.integrator.groups;
  // The surface pass mixes all lights, so its color counts in the first group.
  if (p.bounces == 0u && p.at_layer != 0u) cm_add_to_group(0u, p.light);
  for (uint i = 0u; i < count; ++i) cm_add_to_layer(at, i, uintBitsToFloat(cm_paths[cm_group_index(i)].xyz));
  if (p.bounces > 0u || p.at_layer != 0u) return;
  // Any tint in front of the background is the same for both.
  vec3 sun = cm_sun_radiance(p.w);
  vec3 part = clamp(sun / max(cm_background_radiance(p.w), vec3(1e-30)), vec3(0.0), vec3(1.0)) * p.light;
  cm_add_to_layer(at, count, p.light - part);
  cm_add_to_layer(at, count + 1u, part);
}

#endif
#endif
