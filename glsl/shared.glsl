// The subset of GLSL that also compiles as C++ through GLM (src/base/shared_code.hpp defines the macros there).
#ifndef CM_SHARED_GLSL
#define CM_SHARED_GLSL
#ifndef __cplusplus
#define CM_FN
#define CM_INOUT(T) inout T
#define CM_OUT(T) out T
#define CM_PRECISE precise  // every shader rounds it alike

// Whether paths look for cells that give off light: marches of voxels have none, kernels of surfaces no march.
#if CM_CHANNELS && (!defined(CM_MARCH) || CM_MARCH == 0)
#define CM_CELL_LIGHTS 1
#endif
#endif
#endif
