// Display LUTs: a shaper, then tetrahedral interpolation between the points of a lattice. Unlike a filtered texture,
// whose weights have 8 bits, it reproduces linear functions. Shared by GLSL and C++.
#ifndef CM_DISPLAY_LUT_GLSL
#define CM_DISPLAY_LUT_GLSL
#include "display/display.glsl"

#define CM_LUT_SHAPER_LINEAR 0u
#define CM_LUT_SHAPER_LOG2 1u
#define CM_LUT_SHAPER_SRGB 2u

// Position on an axis of the lattice, in [0, 1], of an exposed value that is displayable.
CM_FN float cm_lut_position(float value, uint shaper, vec2 domain) {
  float shaped = value;
  if (shaper == CM_LUT_SHAPER_LOG2) {
    if (!cm_is_positive(value)) return 0.0f;
    shaped = log2(value);
  }
  if (shaper == CM_LUT_SHAPER_SRGB) shaped = cm_srgb_encode(value);
  return clamp((shaped - domain.x) / (domain.y - domain.x), 0.0f, 1.0f);
}

// The tetrahedron of the lattice around a position, and its barycentric weights.
struct CmLutCell {
  ivec3 points[4];
  vec4 weights;
};

CM_FN CmLutCell cm_lut_cell(vec3 position, int size) {
  vec3 at = position * float(size - 1);
  vec3 low = min(floor(at), vec3(float(size - 2)));
  vec3 f = at - low;
  ivec3 x = ivec3(1, 0, 0);
  ivec3 y = ivec3(0, 1, 0);
  ivec3 z = ivec3(0, 0, 1);
  // The axes with the largest and with the smallest fraction. They differ, also if fractions are equal.
  ivec3 first = f.x >= f.y ? (f.x >= f.z ? x : z) : (f.y >= f.z ? y : z);
  ivec3 last = f.x < f.y ? (f.x < f.z ? x : z) : (f.y < f.z ? y : z);
  float most = max(f.x, max(f.y, f.z));
  float least = min(f.x, min(f.y, f.z));
  float middle = max(min(f.x, f.y), min(max(f.x, f.y), f.z));
  CmLutCell cell;
  cell.points[0] = ivec3(low);
  cell.points[1] = cell.points[0] + first;
  cell.points[2] = cell.points[0] + 1 - last;
  cell.points[3] = cell.points[0] + 1;
  cell.weights = vec4(1.0f - most, most - middle, middle - least, least);
  return cell;
}

#endif
