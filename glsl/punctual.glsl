// KHR_lights_punctual. Shared by GLSL and C++.
#ifndef CM_PUNCTUAL_GLSL
#define CM_PUNCTUAL_GLSL

struct CmLight {
  vec4 position;   // w: 0 directional, 1 point or spot
  vec4 direction;  // unit, where it shines; w: range, 0: no limit
  vec4 intensity;  // radiant: W/sr, or W/m2 where directional
  vec4 cone;       // x, y: the cone's share is clamp(x cosine + y, 0, 1)^2
};

// What arrives at a point on a plane that faces the light, nothing in its way: intensity / d^2, windowed by
// clamp(1 - (d / range)^4, 0, 1), times the cone's share. to_light: unit; distance: 3e38 where directional.
CM_FN vec3 cm_punctual_irradiance(CmLight light, vec3 point, CM_OUT(vec3) to_light, CM_OUT(float) distance_to) {
  to_light = -vec3(light.direction);
  distance_to = 3.0e38f;
  if (light.position.w == 0.0f) return vec3(light.intensity);
  vec3 way = vec3(light.position) - point;
  float d2 = max(dot(way, way), 1e-12f);
  distance_to = sqrt(d2);
  to_light = way * (1.0f / distance_to);
  float cone = clamp(light.cone.x * -dot(to_light, vec3(light.direction)) + light.cone.y, 0.0f, 1.0f);
  float share = cone * cone / d2;
  if (light.direction.w > 0.0f) {
    float r2 = d2 / (light.direction.w * light.direction.w);
    share *= clamp(1.0f - r2 * r2, 0.0f, 1.0f);
  }
  return vec3(light.intensity) * share;
}

#endif
