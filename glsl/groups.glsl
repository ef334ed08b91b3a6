// Radiance by groups of lights: what a path brings is added up apart by the light that it came from, beside the path, and
// once its sample is done to the film. Only with CM_GROUPS; the includer has path.glsl and path_store.glsl before this.
// A kernel says whose path it has by cm_group_lane.
#ifndef CM_GROUPS_GLSL
#define CM_GROUPS_GLSL
#if CM_GROUPS

// Sums of radiance, a layer a group; behind them what cameras see of the sky and of the sun, which have groups as well.
layout(rgba32f, binding = CM_IMAGE_GROUPS) uniform image2DArray cm_groups;

uint cm_group_place(uint group) { return cm_group_lane + uint(CM_FIRST_GROUPS + int(group)) * cm_lanes(); }

// A group that is not gathered counts in the first.
void cm_add_to_group(uint group, vec3 radiance) {
  if (radiance == vec3(0.0)) return;
  uint at = cm_group_place(group < cm.integrator.groups ? group : 0u);
  cm_paths[at] = uvec4(floatBitsToUint(uintBitsToFloat(cm_paths[at].xyz) + radiance), 0u);
}

void cm_begin_groups() {
  for (uint i = 0u; i < cm.integrator.groups; ++i) cm_paths[cm_group_place(i)] = uvec4(0u);
}

void cm_add_to_layer(uvec2 at, uint layer, vec3 radiance) {
  if (radiance == vec3(0.0)) return;
  ivec3 texel = ivec3(ivec2(at), int(layer));
  imageStore(cm_groups, texel, imageLoad(cm_groups, texel) + vec4(radiance, 0.0));
}

// Before cm_finish.
void cm_finish_groups(CmPath p, uvec2 at) {
  if (!cm_is_sound(p)) return;
  uint count = cm.integrator.groups;
  // What the surface pass has drawn is of no light alone.
  if (p.bounces == 0u && p.at_layer != 0u) cm_add_to_group(0u, p.light);
  for (uint i = 0u; i < count; ++i) cm_add_to_layer(at, i, uintBitsToFloat(cm_paths[cm_group_place(i)].xyz));
  if (p.bounces > 0u || p.at_layer != 0u) return;
  // What is in front of the background tints both alike.
  vec3 sun = cm_sun_radiance(p.w);
  vec3 part = clamp(sun / max(cm_background_radiance(p.w), vec3(1e-30)), vec3(0.0), vec3(1.0)) * p.light;
  cm_add_to_layer(at, count, p.light - part);
  cm_add_to_layer(at, count + 1u, part);
}

#endif
#endif
