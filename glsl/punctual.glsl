// Lamps: KHR_lights_punctual's and the host's. Shared by GLSL and C++.
#ifndef CM_PUNCTUAL_GLSL
#define CM_PUNCTUAL_GLSL

const uint CM_LAMP_DISTANT = 0u;
const uint CM_LAMP_POINT = 1u;  // or a spot
const uint CM_LAMP_DISC = 2u;
const uint CM_LAMP_RECTANGLE = 3u;

struct CmLamp {
  vec3 position;   // of its middle
  uint kind;
  vec3 direction;  // unit, where it shines
  float range;     // 0: no limit
  vec3 intensity;  // radiant: W/sr along its direction, or W/m2 where distant
  uint extended;   // 1: light comes from all over its area; a distant one's is what it covers of the sky at distance 1
  vec3 across;     // from the middle to the edge, of a rectangle to the side
  float cone_scale;  // the cone's share is clamp(scale cosine + offset, 0, 1)^2
  vec3 along;        // likewise, upright to it
  float cone_offset;
  float chance;  // to be the one that is looked for
  uint stays;    // drawn evenly, it is looked for where a random word is at most this, else the other
  uint other;
  uint group;    // of lights
};

// From its middle to a point of it, each as likely by area.
CM_FN vec3 cm_lamp_point(CmLamp lamp, float u_0, float u_1) {
  if (lamp.kind == CM_LAMP_RECTANGLE) return (2.0f * u_0 - 1.0f) * lamp.across + (2.0f * u_1 - 1.0f) * lamp.along;
  float radius = sqrt(u_0);
  float angle = 6.28318531f * u_1;
  return radius * cos(angle) * lamp.across + radius * sin(angle) * lamp.along;
}

// What arrives at a point on a plane that faces the lamp, nothing in its way, were it all at `from` beside its middle:
// intensity / d^2, windowed by clamp(1 - (d / range)^4, 0, 1), times the share that leaves it that way. to_light: unit;
// distance: 3e38 where distant.
CM_FN vec3 cm_lamp_irradiance(CmLamp lamp, vec3 from, vec3 point, CM_OUT(vec3) to_light, CM_OUT(float) distance_to) {
  to_light = -lamp.direction;
  distance_to = 3.0e38f;
  if (lamp.kind == CM_LAMP_DISTANT) {
    if (lamp.extended == 0u) return lamp.intensity;
    // Of one radiance from its whole disc, whose area at distance 1 covers cosine^3 of that of directions.
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
  return min(lamp.intensity * share, vec3(1e30f));  // an infinite one beside a share of 0 would be no number
}

#endif
