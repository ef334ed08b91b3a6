// The march of CM_MARCH.
#if CM_EMISSION
#include "emission.glsl"
#endif
#if CM_MARCH == 0
#include "march_tet.glsl"
#else
#include "march_voxel.glsl"
#endif
