// The march of CM_MARCH.
#if CM_CHANNELS
#include "channels.glsl"
#endif
#if CM_MARCH == 0
#include "march_tet.glsl"
#else
#include "march_voxel.glsl"
#endif
