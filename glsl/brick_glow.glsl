// What fields of temperature and flame give off, as shaders are told it. Shared by GLSL and C++.
#ifndef CM_BRICK_GLOW_GLSL
#define CM_BRICK_GLOW_GLSL

#define CM_RAMP_PARTS 64u
#define CM_BODY_COLOURS 1024

// Of a ramp, from this value on: what it becomes, and how that grows with it.
struct CmRampPart {
  float from;
  float start;
  float slope;
};

struct CmBrickGlow {
  vec3 flame_colour;  // times its strength
  float intensity;    // of black body light
  vec3 tint;          // of that
  float unit;         // of that: a kelvin's radiance, 0: there is none
  float offset;       // kelvin: this and scale times the field's value
  float scale;
  float most;  // radiance
  CmRampPart ramps[2 * CM_RAMP_PARTS];  // temperature's, then flame's: of the first one any value, of the last ones none
  float colours[3 * CM_BODY_COLOURS];  // of black bodies, evenly in the temperature's logarithm
};

#endif
