// What paths see of the lights. Shared by GLSL and C++.
#ifndef CM_LIGHT_GLSL
#define CM_LIGHT_GLSL

// Radiance from the sky along w (world, unit).
CM_FN vec3 cm_sky_radiance(vec3 w) { return cm.lights.sky_radiance; }

#endif
