// What fields of temperature and flame give off, as shaders are told it. Shared by GLSL and C++.
#ifndef CM_BRICK_GLOW_GLSL
#define CM_BRICK_GLOW_GLSL

#define CM_RAMP_POINTS 32
#define CM_BODY_COLOURS 1024

struct CmBrickGlow {
  vec3 flame_colour;  // times its strength
  float intensity;    // of black body light
  vec3 tint;          // of that
  float offset;       // kelvin: this and scale times the field's value
  float scale;
  float most;  // radiance
  uint temperature_points;
  uint flame_points;
  vec2 temperature_ramp[CM_RAMP_POINTS];  // value, and what it becomes; so many of them
  vec2 flame_ramp[CM_RAMP_POINTS];
  float colours[3 * CM_BODY_COLOURS];  // of black bodies, evenly in the temperature's logarithm
};

#endif
