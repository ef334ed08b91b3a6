#version 450
// Computes fields of a volume from the fields of an uploaded update, brick by brick, like scene/channels.hpp: one work
// group per brick. CM_PRODUCT: 0: emission, 1: scattering, 2: forward-scattered part of it, 3: the same with a
// scattering color, 4: momentum.
// variants: CM_PRODUCT=0,1,2,3,4
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/luminance.glsl"
#include "grid/brick_emission.glsl"

#if CM_PRODUCT == 0
#define CM_FIELDS 2u  // temperature and flame
#elif CM_PRODUCT == 2
#define CM_FIELDS 2u  // density and anisotropy
#elif CM_PRODUCT == 3
#define CM_FIELDS 5u  // density, red, green and blue, and anisotropy
#else
#define CM_FIELDS 4u  // density, and red, green and blue, or the velocity's components
#endif

#if CM_PRODUCT == 2 || CM_PRODUCT == 3
#define CM_COMPONENTS 1
#else
#define CM_COMPONENTS 3
#endif

layout(std430, binding = CM_STORAGE_BRICKS_TOGETHER) readonly buffer CmTogether { float cm_together[]; };
layout(std430, binding = CM_STORAGE_BRICKS_FIRST) writeonly buffer CmFirst { float cm_first[]; };
#if CM_COMPONENTS > 1
layout(std430, binding = CM_STORAGE_BRICKS_SECOND) writeonly buffer CmSecond { float cm_second[]; };
layout(std430, binding = CM_STORAGE_BRICKS_THIRD) writeonly buffer CmThird { float cm_third[]; };
#endif
layout(location = 0) uniform uvec2 cm_range;    // bricks: first, and one past the last
layout(location = 1) uniform uint cm_to_first;  // destination of brick 0

#if CM_PRODUCT == 0
layout(std430, binding = CM_STORAGE_BRICKS_EMISSIVE) readonly buffer CmGlowing { CmBrickEmissive cm_emissive; };

// Evaluates a ramp like volume::Ramp: 0 stays 0. first: its first part. The binary search has no branch that is the
// same for all voxels, because zink of Mesa 22.3 would keep the first outcome of such a branch.
float cm_ramp(uint first, float value) {
  uint part = first;
  for (uint step = CM_RAMP_PARTS / 2u; step > 0u; step /= 2u)
    part += value >= cm_emissive.ramps[part + step].from ? step : 0u;
  CmRampPart at = cm_emissive.ramps[part];
  return value > 0.0 ? max(0.0, at.start + at.slope * (value - at.from)) : 0.0;
}

vec3 cm_body_color(uint i) {
  return vec3(cm_emissive.colors[3u * i], cm_emissive.colors[3u * i + 1u], cm_emissive.colors[3u * i + 2u]);
}

// The same function as light::BlackBody::emission.
vec3 cm_black_body(float kelvin) {
  const float coldest = 100.0;
  const float log_range = 5.99146455;  // log(40000 / coldest)
  if (!(kelvin >= coldest)) return vec3(0.0);
  float square = kelvin * kelvin;
  float radiance = cm_emissive.unit * (1.0 + cm_emissive.intensity * (square * square - 1.0));
  float at = float(CM_BODY_COLORS - 1) * min(log(kelvin / coldest) / log_range, 1.0);
  uint first = min(uint(at), uint(CM_BODY_COLORS - 2));
  return radiance * mix(cm_body_color(first), cm_body_color(first + 1u), at - float(first));
}

vec3 cm_emission(float temperature_value, float flame_value) {
  vec3 light = cm_ramp(CM_RAMP_PARTS, flame_value) * cm_emissive.flame_color;
  float temperature = cm_ramp(0u, temperature_value);
  if (temperature > 0.0) {
    const float hottest = 1e6;
    float kelvin = min(cm_emissive.offset + cm_emissive.scale * temperature, hottest);
    light += cm_black_body(kelvin) * cm_emissive.tint;
  }
  return min(light, vec3(cm_emissive.most));
}

vec3 cm_product(float fields[CM_FIELDS]) { return cm_emission(fields[0], fields[1]); }
#else

vec3 cm_colored(float density, vec3 color) { return density * clamp(color, vec3(0.0), vec3(1.0)); }

#if CM_PRODUCT == 1
vec3 cm_product(float fields[CM_FIELDS]) { return cm_colored(fields[0], vec3(fields[1], fields[2], fields[3])); }
#elif CM_COMPONENTS == 1
vec3 cm_product(float fields[CM_FIELDS]) {
#if CM_PRODUCT == 3
  float scatters = cm_luminance(cm_colored(fields[0], vec3(fields[1], fields[2], fields[3])));
#else
  float scatters = fields[0];
#endif
  return vec3(scatters * (0.5 + 0.5 * clamp(fields[CM_FIELDS - 1u], -1.0, 1.0)));
}
#else
layout(location = 2) uniform vec3 cm_to_relative[3];  // columns: map a velocity to fractions of the largest speed
layout(location = 5) uniform float cm_most;           // maximum magnitude of a component

vec3 cm_product(float fields[CM_FIELDS]) {
  vec3 given = clamp(vec3(fields[1], fields[2], fields[3]), vec3(-cm_most), vec3(cm_most));
  vec3 relative = cm_to_relative[0] * given.x + cm_to_relative[1] * given.y + cm_to_relative[2] * given.z;
  return fields[0] * (0.5 + 0.5 * clamp(relative, vec3(-1.0), vec3(1.0)));
}
#endif
#endif

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint brick = min(cm_range.x + work, cm_range.y - 1u);  // surplus groups repeat the last brick
  for (uint v = gl_LocalInvocationIndex; v < 512u; v += 64u) {
    float fields[CM_FIELDS];
    for (uint f = 0u; f < CM_FIELDS; ++f) fields[f] = cm_together[(512u * brick + v) * CM_FIELDS + f];
    vec3 product = cm_product(fields);
    uint to = 512u * (cm_to_first + brick) + v;
    cm_first[to] = product.x;
#if CM_COMPONENTS > 1
    cm_second[to] = product.y;
    cm_third[to] = product.z;
#endif
  }
}
