// Shared by GLSL and C++.
#ifndef CM_LUMINANCE_GLSL
#define CM_LUMINANCE_GLSL

// Luminance of a linear Rec. 709 color.
CM_FN float cm_luminance(vec3 color) { return dot(color, vec3(0.2126f, 0.7152f, 0.0722f)); }

#endif
