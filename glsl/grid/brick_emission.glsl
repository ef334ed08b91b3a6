// Parameters of the emission of temperature and flame fields. Shared by GLSL and C++.
#ifndef CM_BRICK_EMISSIVE_GLSL
#define CM_BRICK_EMISSIVE_GLSL

#define CM_RAMP_PARTS 64u
#define CM_BODY_COLORS 1024

// A part of a ramp, which begins at value `from`: its result there, and its slope.
struct CmRampPart {
  float from;
  float start;
  float slope;
};

struct CmBrickEmissive {
  vec3 flame_color;  // color times strength
  float intensity;   // of black-body emission
  vec3 tint;         // of black-body emission
  float unit;        // radiance of a black body at 1 kelvin; 0: no black-body emission
  float offset;      // kelvin = offset + scale * value of the field
  float scale;
  float most;                           // maximum radiance
  CmRampPart ramps[2 * CM_RAMP_PARTS];  // of temperature, then of flame; the first part has any value, unused ones none
  float colors[3 * CM_BODY_COLORS];     // of black bodies, uniform in the temperature's logarithm
};

#endif
