// Emission of a cell, along a ray and at a point. Needs cell.glsl. Shared by GLSL and C++.
#ifndef CM_CELL_EMISSION_GLSL
#define CM_CELL_EMISSION_GLSL
#include "grid/channels.glsl"

// Lower bound of the distance from a point to a cell, in cube space; 0 nearby. The point is given relative to the
// centroid, in the cell's frame in units.
CM_FN float cm_cell_distance(vec3 from_centroid, uint shape) {
  uint cell_class = cm_shape_class(shape);
  float farthest_vertex = cell_class == 0u ? 1.1457f : (cell_class == 1u ? 0.9355f : 1.4791f);
  return max(0.0f, sqrt(dot(from_centroid, from_centroid)) - farthest_vertex) * cm_shape_unit(shape);
}

// Emission along a ray o + t d in the cell's frame: the mean, and the relative value at t = 0 with its slope.
struct CmEmission {
  vec3 mean;
  float at_0;
  float slope;
  float distance;  // cm_cell_distance of o
#if CM_CUBIC_EMISSION
  // The emission of the corners of a cell, and the ray relative to the cell; the mean is then a factor.
  CmCellCorners red;
  CmCellCorners green;
  CmCellCorners blue;
  vec3 o;
  vec3 d;
#endif
};

CM_FN CmEmission cm_cell_emission(uvec4 record, CmFrame f, uint shape) {
  vec3 gradient = cm_emission_gradient(record);
  float inverse_unit = cm_shape_inverse_unit(shape);
  vec3 from_centroid = (f.o - f.v0) * inverse_unit - cm_frame_centroid(cm_shape_class(shape));
  CmEmission e;
  e.mean = cm_emission_mean(record);
  e.at_0 = 1.0f + dot(gradient, from_centroid);
  e.slope = dot(gradient, f.d) * inverse_unit;
  e.distance = cm_cell_distance(from_centroid, shape);
  return e;
}

// Samples a point of a cell uniformly by three random numbers: in its frame, in units. The gaps between the sorted
// numbers are the weights of the vertices.
CM_FN vec3 cm_cell_point(uint cell_class, vec3 u) {
  float low = min(u.x, min(u.y, u.z));
  float high = max(u.x, max(u.y, u.z));
  float middle = max(min(u.x, u.y), min(max(u.x, u.y), u.z));
  return low * cm_frame_vertex(cell_class, 1u) + (middle - low) * cm_frame_vertex(cell_class, 2u) +
         (high - middle) * cm_frame_vertex(cell_class, 3u);
}

// Emission at such a point over the mean.
CM_FN float cm_emission_at(uvec4 record, uint cell_class, vec3 point) {
  return max(0.0f, 1.0f + dot(cm_emission_gradient(record), point - cm_frame_centroid(cell_class)));
}

#if CM_CUBIC_EMISSION
CM_FN vec3 cm_corner_emission(CmEmission e, float t) {
  vec3 at = clamp(e.o + t * e.d, vec3(0.0f, 0.0f, 0.0f), vec3(1.0f, 1.0f, 1.0f));
  return vec3(cm_trilinear(e.red, at), cm_trilinear(e.green, at), cm_trilinear(e.blue, at));
}
#endif

// Emission that a ray collects from t to t_1, without absorption.
CM_FN vec3 cm_emitted(CmEmission e, float t, float t_1) {
#if CM_CUBIC_EMISSION
  // Simpson's rule is exact for cubics.
  vec3 sum = cm_corner_emission(e, t) + 4.0f * cm_corner_emission(e, 0.5f * (t + t_1)) + cm_corner_emission(e, t_1);
  return e.mean * sum * (max(0.0f, t_1 - t) / 6.0f);
#else
  float share = 0.5f * (max(0.0f, e.at_0 + e.slope * t) + max(0.0f, e.at_0 + e.slope * t_1));
  return e.mean * (share * max(0.0f, t_1 - t));
#endif
}

#endif
