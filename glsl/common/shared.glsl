// The subset of GLSL that also compiles as C++ with GLM (src/base/shared_code.hpp defines the macros there).
#ifndef CM_SHARED_GLSL
#define CM_SHARED_GLSL
#ifndef __cplusplus
#define CM_FN
#define CM_INOUT(T) inout T
#define CM_OUT(T) out T
#define CM_PRECISE precise  // all shaders round it alike
#endif
#endif
