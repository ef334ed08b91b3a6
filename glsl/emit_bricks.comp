#version 450
// What bricks of temperature and flame give off, as scene::emission_of finds it: a group a brick.
// CM_TEMPERATURE, CM_FLAME: 0: it has none, 1: halves, 2: floats.
// variants: CM_TEMPERATURE=0,1,2 CM_FLAME=0,1,2
layout(local_size_x = 64) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "brick_glow.glsl"

layout(std430, binding = CM_STORAGE_BRICKS_BURNING) readonly buffer CmBurning {
  uint cm_burning[];  // three each: where it goes, which of temperature's, which of flame's
};
layout(std430, binding = CM_STORAGE_BRICKS_TEMPERATURE) readonly buffer CmTemperature { uint cm_temperature[]; };
layout(std430, binding = CM_STORAGE_BRICKS_FLAME) readonly buffer CmFlame { uint cm_flame[]; };
layout(std430, binding = CM_STORAGE_BRICKS_GLOW) readonly buffer CmGlowing { CmBrickGlow cm_glow; };
layout(std430, binding = CM_STORAGE_BRICKS_RED) writeonly buffer CmRed { float cm_red[]; };
layout(std430, binding = CM_STORAGE_BRICKS_GREEN) writeonly buffer CmGreen { float cm_green[]; };
layout(std430, binding = CM_STORAGE_BRICKS_BLUE) writeonly buffer CmBlue { float cm_blue[]; };
layout(location = 0) uniform uvec2 cm_range;  // of those: the first, and the end

float cm_temperature_at(uint i) {
#if CM_TEMPERATURE == 1
  return unpackHalf2x16(cm_temperature[i >> 1u] >> (16u * (i & 1u))).x;
#elif CM_TEMPERATURE == 2
  return uintBitsToFloat(cm_temperature[i]);
#else
  return 0.0;
#endif
}

float cm_flame_at(uint i) {
#if CM_FLAME == 1
  return unpackHalf2x16(cm_flame[i >> 1u] >> (16u * (i & 1u))).x;
#elif CM_FLAME == 2
  return uintBitsToFloat(cm_flame[i]);
#else
  return 0.0;
#endif
}

// As volume::Ramp: 0 stays. first: of its parts. Found by halves: no branch is the same for all voxels, which zink of
// Mesa 22.3 would keep.
float cm_ramp(uint first, float value) {
  uint part = first;
  for (uint step = CM_RAMP_PARTS / 2u; step > 0u; step /= 2u)
    part += value >= cm_glow.ramps[part + step].from ? step : 0u;
  CmRampPart at = cm_glow.ramps[part];
  return value > 0.0 ? max(0.0, at.start + at.slope * (value - at.from)) : 0.0;
}

vec3 cm_body_colour(uint i) {
  return vec3(cm_glow.colours[3u * i], cm_glow.colours[3u * i + 1u], cm_glow.colours[3u * i + 2u]);
}

// As light::BlackBody::emission.
vec3 cm_black_body(float kelvin) {
  const float coldest = 100.0;
  const float log_range = 5.99146455;  // log(40000 / coldest)
  if (!(kelvin >= coldest)) return vec3(0.0);
  float square = kelvin * kelvin;
  float radiance = cm_glow.unit * (1.0 + cm_glow.intensity * (square * square - 1.0));
  float at = float(CM_BODY_COLOURS - 1) * min(log(kelvin / coldest) / log_range, 1.0);
  uint first = min(uint(at), uint(CM_BODY_COLOURS - 2));
  return radiance * mix(cm_body_colour(first), cm_body_colour(first + 1u), at - float(first));
}

vec3 cm_emission(float temperature_value, float flame_value) {
  vec3 light = cm_ramp(CM_RAMP_PARTS, flame_value) * cm_glow.flame_colour;
  float temperature = cm_ramp(0u, temperature_value);
  if (temperature > 0.0) {
    const float hottest = 1e6;
    float kelvin = min(cm_glow.offset + cm_glow.scale * temperature, hottest);
    light += cm_black_body(kelvin) * cm_glow.tint;
  }
  return min(light, vec3(cm_glow.most));
}

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint i = 3u * min(cm_range.x + work, cm_range.y - 1u);  // the last ones do the last once more
  for (uint v = gl_LocalInvocationIndex; v < 512u; v += 64u) {
    vec3 light = cm_emission(cm_temperature_at(512u * cm_burning[i + 1u] + v), cm_flame_at(512u * cm_burning[i + 2u] + v));
    uint to = 512u * cm_burning[i] + v;
    cm_red[to] = light.r;
    cm_green[to] = light.g;
    cm_blue[to] = light.b;
  }
}
