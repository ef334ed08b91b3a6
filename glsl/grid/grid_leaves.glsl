// Cells of a built grid: for the kernels that make cells and their records.
#ifndef CM_GRID_LEAVES_GLSL
#define CM_GRID_LEAVES_GLSL

struct CmTreeCell {
  uint child;   // first of two children; 0: a leaf
  uint rank;    // number of leaves before it in the final order
  uvec2 where;  // v0 and shape, as in a record
};
layout(std430, binding = CM_STORAGE_GRID_STATE) buffer CmState { CmGridState cm_state; };
layout(std430, binding = CM_STORAGE_GRID_CELLS) buffer CmCells { CmTreeCell cm_cells[]; };
// Splitting cells, and behind them the leaves, each level by level. Separate lists leave no idle lanes in kernels for
// either kind.
layout(std430, binding = CM_STORAGE_GRID_LIST) buffer CmList { uint cm_list[]; };
layout(location = 0) uniform uint cm_first;
layout(location = 1) uniform uint cm_end;

bool cm_cube_is_wide() { return cm_is_wide(cm_log2_size - 1u); }
vec3 cm_v0_of(uvec2 where) { return cm_record_v0(uvec4(where, 0u, 0u), cm_cube_is_wide()); }
uint cm_shape_of(uvec2 where) { return cm_record_shape(uvec4(where, 0u, 0u), cm_cube_is_wide()); }

// Rounds to the nearest half, ties away from 0, because drivers differ in their rounding.
uint cm_half(float value) {
  uint bits = floatBitsToUint(value);
  uint sign_bit = (bits >> 16) & 0x8000u;
  bits &= 0x7fffffffu;
  if (bits >= 0x47800000u) return sign_bit | 0x7c00u;
  if (bits >= 0x38800000u) return sign_bit | ((bits - 0x38000000u + 0x1000u) >> 13);
  uint shift = 126u - (bits >> 23);
  return shift > 24u ? sign_bit : sign_bit | ((((bits & 0x7fffffu) | 0x800000u) + (1u << (shift - 1u))) >> shift);
}

// A voxel inside the cell.
ivec3 cm_leaf_voxel(vec3 v0, uint shape) {
  return ivec3(v0 + cm_from_frame(cm_frame_centroid(cm_shape_class(shape)) * cm_shape_unit(shape), shape));
}

// Extends the bounds of all nonempty cells by this cell.
void cm_put_in_box(vec3 v0, uint shape) {
  vec3 v1 = cm_cell_vertex(v0, shape, 1u);
  vec3 v2 = cm_cell_vertex(v0, shape, 2u);
  vec3 v3 = cm_cell_vertex(v0, shape, 3u);
  uvec3 low = uvec3(min(min(v0, v1), min(v2, v3)));
  uvec3 high = uvec3(max(max(v0, v1), max(v2, v3)));
  for (uint axis = 0u; axis < 3u; ++axis) {
    if (low[axis] < cm_state.low[axis]) atomicMin(cm_state.low[axis], low[axis]);
    if (high[axis] > cm_state.high[axis]) atomicMax(cm_state.high[axis], high[axis]);
  }
}

#endif
