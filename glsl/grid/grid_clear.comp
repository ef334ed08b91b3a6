#version 450
// Computes the clear cones of a grid's empty cells (clear_cones.glsl), like src/grid/clear_cones.cpp. CM_STAGE 0: full
// cubes. 1: clear cubes, one work group per cone. 2: clear cones of each cube. 3: clear cones of each empty cell.
// variants: CM_STAGE=0,1,2,3
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/clear_cones.glsl"
#include "grid/grid_state.glsl"

layout(std430, binding = CM_STORAGE_GRID_STATE) readonly buffer CmState { CmGridState cm_state; };
layout(std430, binding = CM_STORAGE_GRID_RECORDS) buffer CmRecords { uvec4 cm_records[]; };
// Rows along x and along z of full bits, two words each; then the rows of each cone's clear bits; then one word per
// cube with its clear cones.
layout(std430, binding = CM_STORAGE_GRID_CLEAR) buffer CmClear { uint cm_clear[]; };
layout(location = 0) uniform uint cm_first;
layout(location = 1) uniform uint cm_end;
layout(location = 2) uniform uint cm_log2_size;  // of the root cube

const uint cm_clear_begins = 4u * CM_CLEAR_ROWS;
const uint cm_cubes_begin = cm_clear_begins + 2u * CM_CLEAR_CONES * CM_CLEAR_ROWS;

uvec2 cm_row(uint word) { return uvec2(cm_clear[word], cm_clear[word + 1u]); }

#if CM_STAGE == 1

shared uvec2 cm_behind[CM_CLEAR_SIDE];

void main() {
  uint cone = cm_first + gl_WorkGroupID.x;
  uint row = gl_LocalInvocationID.x;
  uint full = 2u * CM_CLEAR_ROWS * cm_clear_rows(cone);
  uint clear = cm_clear_begins + 2u * CM_CLEAR_ROWS * cone;
  bool bits_up = cm_clear_up(cone, cm_clear_axis_of_bits(cone));
  uint beside = cm_clear_up(cone, cm_clear_axis_of_rows(cone)) ? row + 1u : row - 1u;
  bool inside = beside < CM_CLEAR_SIDE;
  beside = inside ? beside : row;
  cm_behind[row] = uvec2(0xffffffffu);
  barrier();
  for (uint i = 0u; i < CM_CLEAR_SIDE; ++i) {
    uint layer = cm_clear_up(cone, cone >> 3) ? CM_CLEAR_SIDE - 1u - i : i;
    uint at = cm_clear_row_of_layer(cone, layer, row);
    uvec2 full_beside = cm_row(full + 2u * cm_clear_row_of_layer(cone, layer, beside));
    uvec2 here = cm_clear_row(cm_row(full + 2u * at), inside ? full_beside : uvec2(0u), cm_behind[row],
                              inside ? cm_behind[beside] : uvec2(0xffffffffu), bits_up);
    cm_clear[clear + 2u * at] = here.x;
    cm_clear[clear + 2u * at + 1u] = here.y;
    barrier();
    cm_behind[row] = here;
    barrier();
  }
}

#elif CM_STAGE == 2

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  ivec3 cube = ivec3(cm_clear_cube(i));
  uint cones = 0u;
  for (uint cone = 0u; cone < CM_CLEAR_CONES; ++cone) {
    uint bit = cm_clear_bit_of_cube(cone, cube);
    uint word = cm_clear_begins + 2u * (CM_CLEAR_ROWS * cone + cm_clear_row_of_cube(cone, cube)) + bit / 32u;
    cones |= ((cm_clear[word] >> (bit % 32u)) & 1u) << cone;
  }
  cm_clear[cm_cubes_begin + i] = cones;
}

#else

void cm_fill(uint rows, int layer, int y, uvec2 bits) {
  int side = int(CM_CLEAR_SIDE);
  if (layer < 0 || layer >= side || y < 0 || y >= side) return;
  uint at = 2u * (CM_CLEAR_ROWS * rows + uint(layer * side + y));
  if (bits.x != 0u) atomicOr(cm_clear[at], bits.x);
  if (bits.y != 0u) atomicOr(cm_clear[at + 1u], bits.y);
}

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  uvec4 data = cm_records[2u * i + 1u];
  bool wide = cm_is_wide(cm_log2_size - 1u);
  vec3 v0 = cm_record_v0(data, wide);
  uint shape = cm_record_shape(data, wide);
  CmClearMap map = cm_clear_map(uvec3(cm_state.low[0], cm_state.low[1], cm_state.low[2]),
                                uvec3(cm_state.high[0], cm_state.high[1], cm_state.high[2]));
  CmClearRange range = cm_clear_range(v0, shape, map);
  bool empty = cm_record_is_empty(data);
#if CM_STAGE == 0
  if (empty) return;
#else
  if (!empty) return;
  bool found = range.step == 1 && cm_clear_has(range);
  uint cones = found ? (1u << CM_CLEAR_CONES) - 1u : 0u;
  if (!found) range.last = range.first - ivec3(1);
#endif
  ivec3 at;
  for (at.z = range.first.z; at.z <= range.last.z; at.z += range.step) {
    for (at.y = range.first.y; at.y <= range.last.y; at.y += range.step) {
      for (at.x = range.first.x; at.x <= range.last.x; at.x += range.step) {
        if (!cm_clear_touches(v0, shape, map, at, range.step)) continue;
#if CM_STAGE == 0
        for (int y = 0; y < range.step; ++y) {
          for (int k = 0; k < range.step; ++k) {
            cm_fill(CM_CLEAR_ALONG_X, at.z + k, at.y + y, cm_clear_bits(at.x, range.step));
            cm_fill(CM_CLEAR_ALONG_Z, at.x + k, at.y + y, cm_clear_bits(at.z, range.step));
          }
        }
#else
        cones &= cm_clear[cm_cubes_begin + cm_clear_number(at)];
#endif
      }
    }
  }
#if CM_STAGE == 3
  cm_records[2u * i + 1u].w = cones;
#endif
}

#endif
