#version 450
// Writes the records of a grid's cells once their order is known, like src/grid/tet_grid.cpp: of cells in bricks
// (CM_FINE 1), or of larger ones.
// With CM_LINEAR 2, sixths of cells also have the densities of the corners of their cell.
// variants: CM_FINE=0,1 CM_HALVES=0,1 or CM_FINE=0,1 CM_HALVES=0,1 CM_LINEAR=1 or CM_FINE=1 CM_HALVES=0,1 CM_LINEAR=2
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/cell_fit.glsl"
#include "grid/lattice.glsl"
#include "grid/grid_state.glsl"
#include "grid/lattice_lookup.glsl"
#include "grid/grid_leaves.glsl"
#include "grid/grid_parts.glsl"
#include "grid/grid_links.glsl"

layout(std430, binding = CM_STORAGE_GRID_RECORDS) writeonly buffer CmRecords { uvec4 cm_records[]; };
layout(std430, binding = CM_STORAGE_GRID_BRICKS) readonly buffer CmBricks { uint cm_bricks[]; };  // CM_BRICK_VALUES each
#if !CM_FINE
layout(std430, binding = CM_STORAGE_GRID_COARSE) readonly buffer CmCoarse { uint cm_coarse[]; };
#elif CM_LINEAR == 2
layout(std430, binding = CM_STORAGE_GRID_CORNERS) writeonly buffer CmCorners { uvec4 cm_corners[]; };
#endif
layout(location = 3) uniform float cm_to_relative;  // scale from the grid's values
layout(location = 4) uniform bool cm_linear;

float cm_value(uint i) {
#if CM_HALVES
  return unpackHalf2x16(cm_bricks[i / 2u] >> (16u * (i & 1u))).x;
#else
  return uintBitsToFloat(cm_bricks[i]);
#endif
}

struct CmLeaf {
  uvec2 coefficients;  // as in a record
  bool dense;          // has density
};

uvec2 cm_pack(float mean, vec3 gradient) {
  return uvec2(cm_half(mean * cm_to_relative) | (cm_half(gradient.x * cm_to_relative) << 16),
               cm_half(gradient.y * cm_to_relative) | (cm_half(gradient.z * cm_to_relative) << 16));
}

#if CM_FINE

// Averages and fits the cell's values.
CmLeaf cm_leaf(vec3 v0, uint shape, ivec3 voxel) {
  uint level = cm_fine_level(shape);
  uint first_value = CM_BRICK_VALUES * cm_brick_at(voxel);
  int begin = cm_value_at_v0(v0, shape, voxel);
  ivec3 steps = cm_value_steps(shape);
  uint part = cm_first_part[level];
  uint end = cm_first_part[level + 1u];
  float low = 0.0;
  float high = 0.0;
  float reference = 0.0;
  float sum = 0.0;
  vec3 moment = vec3(0.0);
  for (uint i = part; i < end; ++i) {
    uvec4 words = cm_parts[i];
    float value = cm_value(first_value + uint(begin + cm_value_of_part(words.w, steps)));
    if (i == part) low = high = reference = value;
    low = min(low, value);
    high = max(high, value);
    float weighted = float(words.w >> 12) * (value - reference);
    sum += weighted;
    moment += weighted * uintBitsToFloat(words.xyz);
  }
  float inverse_count = 1.0 / float(cm_weights_of_level(level));
  float mean = clamp(reference + sum * inverse_count, low, high);
  vec3 gradient = vec3(0.0);
  if (cm_linear && low < high) gradient = cm_fit_linear(cm_shape_class(shape), moment * inverse_count, mean).gradient;
  return CmLeaf(cm_pack(mean, gradient), high > 0.0);
}

#if CM_LINEAR == 2
// Corner i of a sixth's cell in the sixth's frame (cm_corner_offset).
uint cm_corner_half(uint i, uint first_value, int begin, ivec3 steps) {
  int at = begin + int(i >> 2) * steps.x + int((i >> 1) & 1u) * steps.y + int(i & 1u) * steps.z;
  return cm_half(cm_value(first_value + uint(at)) * cm_to_relative);
}

void cm_put_corners(uint rank, vec3 v0, uint shape, ivec3 voxel) {
  if (cm_fine_level(shape) != 9u) return;
  uint first_value = CM_BRICK_VALUES * cm_brick_at(voxel);
  int begin = cm_value_at_v0(v0, shape, voxel);
  ivec3 steps = cm_value_steps(shape);
  uvec4 words;
  for (uint i = 0u; i < 4u; ++i)
    words[i] = cm_corner_half(2u * i, first_value, begin, steps) |
               (cm_corner_half(2u * i + 1u, first_value, begin, steps) << 16);
  cm_corners[rank] = words;
}
#endif

#else

CmLeaf cm_leaf(vec3 v0, uint shape, ivec3 voxel) {
  uint size = cm_shape_cube_size(shape);
  ivec3 corner = (voxel >> ivec3(int(size))) << ivec3(int(size));
  uint coarse = CM_COARSE_WORDS * cm_coarse_at(corner, size);
  if (coarse == 0u) {
    float value = cm_value(CM_BRICK_VALUES * cm_brick_at(voxel));
    return CmLeaf(cm_pack(value, vec3(0.0)), value > 0.0);
  }
  uint cell = cm_coarse_cell(v0, shape, vec3(corner));
  uint bits = cm_coarse[coarse + 2u * CM_COARSE_CELLS + cell / 32u];
  return CmLeaf(uvec2(cm_coarse[coarse + 2u * cell], cm_coarse[coarse + 2u * cell + 1u]),
                ((bits >> (cell % 32u)) & 1u) != 0u);
}

#endif

// Returns the leaf behind a face. A link may refer to a cell that has split since, but only once: the next split there
// would cut the face, and split this cell too.
uint cm_rank_behind(uint other, uint i) {
  return other == CM_NONE ? CM_NONE : cm_cells[cm_behind_whole(other, i)].rank;
}

void main() {
  uint at = cm_first + gl_GlobalInvocationID.x;
  if (at >= cm_end) return;
  uint i = cm_list[at];
  uvec2 where = cm_cells[i].where;
  uint rank = cm_cells[i].rank;
  vec3 v0 = cm_v0_of(where);
  uint shape = cm_shape_of(where);
  ivec3 voxel = cm_leaf_voxel(v0, shape);
  CmLeaf leaf = cm_leaf(v0, shape, voxel);
#if CM_FINE && CM_LINEAR == 2
  cm_put_corners(rank, v0, shape, voxel);
#endif
  if (leaf.dense) cm_put_in_box(v0, shape);
  uvec4 links = cm_links[i];
  cm_records[2u * rank] = uvec4(cm_rank_behind(links.x, i), cm_rank_behind(links.y, i), cm_rank_behind(links.z, i),
                                cm_rank_behind(links.w, i));
  // If the first coefficient word is 0, the cell is empty and the second must be 0.
  cm_records[2u * rank + 1u] =
      uvec4(where, leaf.coefficients.x, leaf.coefficients.x == 0u ? 0u : leaf.coefficients.y);
}
