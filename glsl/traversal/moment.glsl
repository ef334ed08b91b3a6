// The shutter time of a path, with CM_MOTION. Shared by GLSL and C++; the includer has random.glsl before this, and
//   float cm_now   where functions may change it
//
// Each path has one time, from 0 (shutter open) to 1 (shutter close), uniform and stratified over the pixel's samples
// (Cook, Porter and Carpenter, "Distributed Ray Tracing", SIGGRAPH 1984). All rays of the path, including its shadow
// rays, use that time, so an image is the mean of still images. The time is recomputed from fields that a path keeps
// anyway.
#ifndef CM_MOMENT_GLSL
#define CM_MOMENT_GLSL
#if CM_MOTION

// A set that neither events nor the lens use.
const uint CM_SET_MOMENT = 0xfffffffeu;

CM_FN float cm_moment(uint number, uint stream) { return cm_even_pair(number, stream, CM_SET_MOMENT).x; }

#ifndef __cplusplus
float cm_now = 0.0;
#endif

// Linear interpolation between both ends of the shutter interval. If a <= b holds at both ends, it holds between them
// to the last bit. So interpolated boxes contain what they contain at both ends.
CM_FN vec3 cm_straight(vec3 open, vec3 close) {
  CM_PRECISE vec3 v = (1.0f - cm_now) * open + cm_now * close;
  return v;
}

// Interpolated instance transform of a moving object: columns of the linear part from its own space to the ray space,
// and the position of its origin there. All of them, and so every point of the object, move linearly.
struct CmInstanceTransform {
  vec3 x;
  vec3 y;
  vec3 z;
  vec3 origin;
};

// Interpolates the columns of both ends.
CM_FN CmInstanceTransform cm_between(CmInstanceTransform open, CmInstanceTransform close) {
  CM_PRECISE vec3 x = open.x + cm_now * (close.x - open.x);
  CM_PRECISE vec3 y = open.y + cm_now * (close.y - open.y);
  CM_PRECISE vec3 z = open.z + cm_now * (close.z - open.z);
  CM_PRECISE vec3 origin = open.origin + cm_now * (close.origin - open.origin);
  return CmInstanceTransform(x, y, z, origin);
}

// Signed volume of a unit cell of its own space; negative if the transform mirrors.
CM_FN float cm_transform_determinant(CmInstanceTransform s) { return dot(s.x, cross(s.y, s.z)); }

// Transforms a vector to its own space by Cramer's rule. The inverse of the interpolated transform is not the
// interpolation of the inverses.
CM_FN vec3 cm_to_instance(CmInstanceTransform s, vec3 v) {
  CM_PRECISE vec3 x = cross(s.y, s.z);
  CM_PRECISE vec3 y = cross(s.z, s.x);
  CM_PRECISE vec3 z = cross(s.x, s.y);
  CM_PRECISE vec3 own = vec3(dot(x, v), dot(y, v), dot(z, v)) / dot(s.x, x);
  return own;
}
CM_FN vec3 cm_from_instance(CmInstanceTransform s, vec3 v) { return s.x * v.x + s.y * v.y + s.z * v.z; }

#endif
#endif
