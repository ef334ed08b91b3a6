// Includes the traversal of grid type CM_MARCH.
#if CM_CHANNELS
#include "channels.glsl"
#endif
#if CM_MARCH == 0
#include "march_tet.glsl"
#else
#include "march_voxel.glsl"
#endif

// Entry cell of a ray, o + t d in ray space, at t. The point is clamped to the bounds, however it rounds.
CM_FN uvec3 cm_march_enter_at(vec3 o, vec3 d, float t) {
  return cm_march_enter(clamp(cm_in_volume_point(o) + t * cm_in_volume(d), CM_GRID.box_min, CM_GRID.box_max));
}
