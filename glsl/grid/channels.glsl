// Values of cells beside density: emission, and scattering color, mean cosine and velocity of the medium. Shared by
// GLSL and C++.
//
// Emission is radiance per world unit of length. Its record has 16 bytes, parallel to the cell's record: the mean
// (three floats, linear Rec. 709), and the variation over the cell. The variation is a gradient over the mean along the
// frame's axes per unit, 10 bits per axis (src/grid/tet_grid.cpp).
#ifndef CM_CHANNELS_GLSL
#define CM_CHANNELS_GLSL
#include "common/numbers.glsl"

// Numbers of the channels (grid::Channel).
#define CM_CHANNEL_EMISSION 0
#define CM_CHANNEL_COLOR 1
#define CM_CHANNEL_ANISOTROPY 2
#define CM_CHANNEL_VELOCITY 3
#define CM_CHANNEL_COUNT 4

// Maximum slope per axis: a linear function that is nowhere negative in a cell and 1 at its centroid is at most 4 at a
// vertex.
#define CM_EMISSION_STEEPEST 4.0f

CM_FN float cm_emission_slope(uint word, uint axis) {
  int bits = int(word << (22u - 10u * axis)) >> 22;
  return float(bits) * (CM_EMISSION_STEEPEST / 511.0f);
}

CM_FN vec3 cm_emission_mean(uvec4 record) {
  return vec3(uintBitsToFloat(record.x), uintBitsToFloat(record.y), uintBitsToFloat(record.z));
}
CM_FN vec3 cm_emission_gradient(uvec4 record) {
  return vec3(cm_emission_slope(record.w, 0u), cm_emission_slope(record.w, 1u), cm_emission_slope(record.w, 2u));
}

// Mean cosine of scattering: 16 bits per cell, two cells per word.
CM_FN float cm_cell_anisotropy(uint word, uint cell) {
  return float(int(word << (16u - 16u * (cell & 1u))) >> 16) * (1.0f / 32767.0f);
}

// Mean velocity weighted by density, along the axes of cube space, voxels per second: 3 halves, and one unused.
CM_FN vec3 cm_cell_velocity(uvec2 words) { return vec3(unpackHalf2x16(words.x), unpackHalf2x16(words.y).x); }

// Scattering color weighted by density: 11, 11 and 10 bits of a word.
CM_FN vec3 cm_cell_color(uint word) {
  return vec3(float(word & 2047u) / 2047.0f, float((word >> 11) & 2047u) / 2047.0f, float(word >> 22) / 1023.0f);
}

#endif
