// Punctual and area lights: those of KHR_lights_punctual and of the host. Shared by GLSL and C++.
#ifndef CM_PUNCTUAL_GLSL
#define CM_PUNCTUAL_GLSL

const uint CM_LAMP_DISTANT = 0u;
const uint CM_LAMP_POINT = 1u;  // or a spot
const uint CM_LAMP_DISC = 2u;
const uint CM_LAMP_RECTANGLE = 3u;

struct CmLamp {
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
  float chance;  // selection probability for NEE
  uint stays;    // alias table: a uniformly drawn entry stays if a random word is at most this, else `other`
  uint other;
  uint group;    // light group
};

// Samples a point uniformly by area. Returns its offset from the center.
CM_FN vec3 cm_lamp_point(CmLamp lamp, float u_0, float u_1) {
  if (lamp.kind == CM_LAMP_RECTANGLE) return (2.0f * u_0 - 1.0f) * lamp.across + (2.0f * u_1 - 1.0f) * lamp.along;
  float radius = sqrt(u_0);
  float angle = 6.28318531f * u_1;
  return radius * cos(angle) * lamp.across + radius * sin(angle) * lamp.along;
}

// Irradiance at `point` on a plane that faces the light, without occlusion, as if all its power came from `from`, an
// offset from its center. This is intensity / d^2 times clamp(1 - (d / range)^4, 0, 1) times the emission profile.
// to_light: unit; distance_to: 3e38 if distant.
CM_FN vec3 cm_lamp_irradiance(CmLamp lamp, vec3 from, vec3 point, CM_OUT(vec3) to_light, CM_OUT(float) distance_to) {
  to_light = -lamp.direction;
  distance_to = 3.0e38f;
  if (lamp.kind == CM_LAMP_DISTANT) {
    if (lamp.extended == 0u) return lamp.intensity;
    // Uniform radiance over the disk. An area of it at distance 1 covers cosine^3 times that area in solid angle.
    vec3 slanted = from - lamp.direction;
    float cosine = inversesqrt(dot(slanted, slanted));
    to_light = slanted * cosine;
    return lamp.intensity * (cosine * cosine * cosine);
  }
  vec3 way = lamp.position + from - point;
  float d2 = max(dot(way, way), 1e-12f);
  distance_to = sqrt(d2);
  to_light = way * (1.0f / distance_to);
  float cosine = -dot(to_light, lamp.direction);
  float cone = clamp(lamp.cone_scale * cosine + lamp.cone_offset, 0.0f, 1.0f);
  float share = (lamp.kind == CM_LAMP_POINT ? cone * cone : max(cosine, 0.0f)) / d2;
  if (lamp.range > 0.0f) {
    float r2 = d2 / (lamp.range * lamp.range);
    share *= clamp(1.0f - r2 * r2, 0.0f, 1.0f);
  }
  return min(lamp.intensity * share, vec3(1e30f));  // an infinite intensity times a factor of 0 would be NaN
}

#endif
