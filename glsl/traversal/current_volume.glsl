// The current volume, which a path traverses or has an event in: CM_GRID, its data; CM_MEDIUM; CM_EMISSIVE. With
// CM_INSTANCES it is an entry of a table, with index cm_here. Then cube space means the scene's frame in all other
// code, and that volume has its own cube space. Shared by GLSL and C++; the includer has parameters.glsl before this,
// and with CM_INSTANCES
//   uint cm_here   where functions may change it
#ifndef CM_HERE_GLSL
#define CM_HERE_GLSL

#include "common/numbers.glsl"
#include "traversal/moment.glsl"

#undef CM_GRID
#undef CM_MEDIUM
#undef CM_EMISSIVE
#if CM_INSTANCES
#define CM_GRID cm_instances[cm_here].grid
#define CM_MEDIUM cm_instances[cm_here].medium
#define CM_EMISSIVE cm_instances[cm_here].emissive
#ifndef __cplusplus
#include "traversal/instance_table.glsl"
uint cm_here = 0u;
#endif
#include "traversal/instance.glsl"

// Transform a vector and a point from ray space to the cube space of the current volume.
CM_FN vec3 cm_in_volume(vec3 v) { return cm_in_instance(cm_here, v); }
CM_FN vec3 cm_in_volume_point(vec3 p) { return cm_in_instance_point(cm_here, p); }
#else
#define CM_GRID cm.grid
#define CM_MEDIUM cm.medium
#define CM_EMISSIVE cm.emissive

CM_FN vec3 cm_in_volume(vec3 v) { return v; }
CM_FN vec3 cm_in_volume_point(vec3 p) { return p; }
#endif

#endif
