// What cells carry beside density: light that they give off, and the colour of what scatters. Shared by GLSL and C++.
//
// Light is radiance a world unit of length. A record of 16 bytes beside the cell's: the mean, three floats, linear Rec.
// 709; and how the whole varies over the cell, a gradient over the mean along the frame's axes per unit, 10 bits an axis
// (src/grid/tet_grid.cpp).
#ifndef CM_CHANNELS_GLSL
#define CM_CHANNELS_GLSL

// A linear function that is nowhere negative in a cell, and 1 at its centroid, is at most 4 at a vertex: none is steeper
// along an axis.
#define CM_EMISSION_STEEPEST 4.0f

CM_FN float cm_emission_slope(uint word, uint axis) {
  int bits = int(word << (22u - 10u * axis)) >> 22;
  return float(bits) * (CM_EMISSION_STEEPEST / 511.0f);
}

// The mean and, along a ray o + t d in the cell's frame, how much of it there is: at t = 0 and its slope.
struct CmEmission {
  vec3 mean;
  float at_0;
  float slope;
};

CM_FN CmEmission cm_cell_emission(uvec4 record, CmFrame f, uint shape) {
  vec3 gradient =
      vec3(cm_emission_slope(record.w, 0u), cm_emission_slope(record.w, 1u), cm_emission_slope(record.w, 2u));
  float inverse_unit = cm_shape_inverse_unit(shape);
  CmEmission e;
  e.mean = vec3(uintBitsToFloat(record.x), uintBitsToFloat(record.y), uintBitsToFloat(record.z));
  e.at_0 = 1.0f + dot(gradient, (f.o - f.v0) * inverse_unit - cm_frame_centroid(cm_shape_class(shape)));
  e.slope = dot(gradient, f.d) * inverse_unit;
  return e;
}

// What a ray takes up from t to t_1, without what the medium takes away.
CM_FN vec3 cm_emitted(CmEmission e, float t, float t_1) {
  float share = 0.5f * (max(0.0f, e.at_0 + e.slope * t) + max(0.0f, e.at_0 + e.slope * t_1));
  return e.mean * (share * max(0.0f, t_1 - t));
}

// Of what scatters, by density: 11, 11 and 10 bits of a word.
CM_FN vec3 cm_cell_colour(uint word) {
  return vec3(float(word & 2047u) / 2047.0f, float((word >> 11) & 2047u) / 2047.0f, float(word >> 22) / 1023.0f);
}

#endif
