// Includes the traversal of grid type CM_MARCH.
// variants of VOLUME: CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=1,2,6 or CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=6 CM_WIDE=1 or CM_MARCH=0 CM_LINEAR=2 CM_PAGES=6 or CM_MARCH=0 CM_LINEAR=2 CM_PAGES=6 CM_WIDE=1 or CM_MARCH=1,2 CM_LINEAR=0,1 CM_PAGES=1
// variants of VOLUMES: CM_MARCH=0 CM_LINEAR=0,1,2 CM_PAGES=6 CM_INSTANCES=1 ... or CM_MARCH=0 CM_LINEAR=0,1,2 CM_PAGES=6 CM_INSTANCES=1 ... CM_WIDE=1 or CM_MARCH=1,2 CM_LINEAR=0,1 CM_PAGES=1 CM_INSTANCES=1 ...
#include "traversal/segment.glsl"
#if CM_CUBIC
#include "traversal/trilinear.glsl"
#endif
#if CM_CHANNELS
#include "traversal/cell_emission.glsl"
#endif
#if CM_MARCH == 0
#include "traversal/march_tet.glsl"
#else
#include "traversal/march_voxel.glsl"
#endif

// Point of a ray, o + t d in ray space, where it enters the grid at t. It is clamped to the bounds, however it rounds.
CM_FN vec3 cm_march_entry(vec3 o, vec3 d, float t) {
  return clamp(cm_in_volume_point(o) + t * cm_in_volume(d), CM_GRID.box_min, CM_GRID.box_max);
}
CM_FN uvec3 cm_march_enter_at(vec3 o, vec3 d, float t) { return cm_march_enter(cm_march_entry(o, d, t)); }
