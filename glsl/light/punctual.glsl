// Analytic lights (punctual and area lights): those of KHR_lights_punctual and of the host. Shared by GLSL and C++.
#ifndef CM_PUNCTUAL_GLSL
#define CM_PUNCTUAL_GLSL

const uint CM_ANALYTIC_LIGHT_DISTANT = 0u;
const uint CM_ANALYTIC_LIGHT_POINT = 1u;  // or a spot
const uint CM_ANALYTIC_LIGHT_DISC = 2u;
const uint CM_ANALYTIC_LIGHT_RECTANGLE = 3u;

struct CmAnalyticLight {
  vec3 position;   // of its center
  uint kind;
  vec3 direction;  // unit, direction of emission
  float range;     // 0: no limit
  vec3 intensity;  // radiant: W/sr along its direction, or W/m2 if distant
  uint extended;   // 1: an area light; a distant one's area is the part of the sky that it covers at distance 1
  vec3 across;     // from the center to the edge; of a rectangle, half its width
  float cone_scale;  // cone attenuation: clamp(scale cosine + offset, 0, 1)^2
  vec3 along;        // perpendicular to `across`; of a rectangle, half its height
  float cone_offset;
  float probability;  // selection probability for NEE
  uint stays;    // alias table: a uniformly drawn entry stays if a random word is at most this, else `other`
  uint other;
  uint group;    // light group
};

// Samples a point uniformly by area. Returns its offset from the center.
CM_FN vec3 cm_analytic_light_point(CmAnalyticLight analytic_light, float u_0, float u_1) {
  if (analytic_light.kind == CM_ANALYTIC_LIGHT_RECTANGLE) return (2.0f * u_0 - 1.0f) * analytic_light.across + (2.0f * u_1 - 1.0f) * analytic_light.along;
  float radius = sqrt(u_0);
  float angle = 6.28318531f * u_1;
  return radius * cos(angle) * analytic_light.across + radius * sin(angle) * analytic_light.along;
}

// Irradiance at `point` on a plane that faces the light, without occlusion, as if all its power came from `from`, an
// offset from its center. This is intensity / d^2 times clamp(1 - (d / range)^4, 0, 1) times the emission profile.
// to_light: unit; distance_to: 3e38 if distant.
CM_FN vec3 cm_analytic_light_irradiance(CmAnalyticLight analytic_light, vec3 from, vec3 point, CM_OUT(vec3) to_light, CM_OUT(float) distance_to) {
  to_light = -analytic_light.direction;
  distance_to = 3.0e38f;
  if (analytic_light.kind == CM_ANALYTIC_LIGHT_DISTANT) {
    if (analytic_light.extended == 0u) return analytic_light.intensity;
    // Uniform radiance over the disk. An area of it at distance 1 covers cosine^3 times that area in solid angle.
    vec3 slanted = from - analytic_light.direction;
    float cosine = inversesqrt(dot(slanted, slanted));
    to_light = slanted * cosine;
    return analytic_light.intensity * (cosine * cosine * cosine);
  }
  vec3 way = analytic_light.position + from - point;
  float d2 = max(dot(way, way), 1e-12f);
  distance_to = sqrt(d2);
  to_light = way * (1.0f / distance_to);
  float cosine = -dot(to_light, analytic_light.direction);
  float cone = clamp(analytic_light.cone_scale * cosine + analytic_light.cone_offset, 0.0f, 1.0f);
  float share = (analytic_light.kind == CM_ANALYTIC_LIGHT_POINT ? cone * cone : max(cosine, 0.0f)) / d2;
  if (analytic_light.range > 0.0f) {
    float r2 = d2 / (analytic_light.range * analytic_light.range);
    share *= clamp(1.0f - r2 * r2, 0.0f, 1.0f);
  }
  return min(analytic_light.intensity * share, vec3(1e30f));  // an infinite intensity times a factor of 0 would be NaN
}

#endif
