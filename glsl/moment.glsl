// When a path sees the scene, with CM_MOTION. Shared by GLSL and C++; the includer has random.glsl before this, and
//   float cm_now   where functions may change it
//
// A path has one moment, from 0, as the shutter opens, to 1, as it closes, drawn evenly over that time and, as a pixel's
// other numbers, over its samples (Cook, Porter and Carpenter, "Distributed Ray Tracing", SIGGRAPH 1984). All of it, with
// its looks for light, is of that moment: a picture is the mean of still ones. It follows from what a path keeps anyway.
#ifndef CM_MOMENT_GLSL
#define CM_MOMENT_GLSL
#if CM_MOTION

// A set that no event has, nor the lens.
const uint CM_SET_MOMENT = 0xfffffffeu;

CM_FN float cm_moment(uint number, uint stream) { return cm_even_pair(number, stream, CM_SET_MOMENT).x; }

#ifndef __cplusplus
float cm_now = 0.0;
#endif

// Straight from one end to the other. What is no larger at both ends is no larger in between, to the last bit: boxes hold
// what they hold at both.
CM_FN vec3 cm_straight(vec3 open, vec3 close) {
  CM_PRECISE vec3 v = (1.0f - cm_now) * open + cm_now * close;
  return v;
}

// Where something stands that moves: columns of the linear part of its own space to that which rays are in, and where
// its origin is there. All of them go straight from one end to the other, and so does each of its points.
struct CmStanding {
  vec3 x;
  vec3 y;
  vec3 z;
  vec3 origin;
};

// Of the columns at both ends.
CM_FN CmStanding cm_between(CmStanding open, CmStanding close) {
  CM_PRECISE vec3 x = open.x + cm_now * (close.x - open.x);
  CM_PRECISE vec3 y = open.y + cm_now * (close.y - open.y);
  CM_PRECISE vec3 z = open.z + cm_now * (close.z - open.z);
  CM_PRECISE vec3 origin = open.origin + cm_now * (close.origin - open.origin);
  return CmStanding(x, y, z, origin);
}

// Of a unit of its own space: negative where it is mirrored.
CM_FN float cm_standing_volume(CmStanding s) { return dot(s.x, cross(s.y, s.z)); }

// A vector in its own space: by Cramer's rule, for the inverse between two ends is none between their inverses.
CM_FN vec3 cm_in_standing(CmStanding s, vec3 v) {
  CM_PRECISE vec3 x = cross(s.y, s.z);
  CM_PRECISE vec3 y = cross(s.z, s.x);
  CM_PRECISE vec3 z = cross(s.x, s.y);
  CM_PRECISE vec3 own = vec3(dot(x, v), dot(y, v), dot(z, v)) / dot(s.x, x);
  return own;
}
CM_FN vec3 cm_out_of_standing(CmStanding s, vec3 v) { return s.x * v.x + s.y * v.y + s.z * v.z; }

#endif
#endif
