#version 450
// The cells of a grid, from the lattice of its splits: what src/grid/tet_grid.cpp computes, level by level. Where cells
// stand until they are in order is another in each run; the records are not.
// CM_STAGE 0: cells that split, and places for their children. 1: children and their neighbours. 2: how many leaves are
// below. 3: the order of the roots, one work group. 4: of the others, and the tree of point location. 5: records.
// variants: CM_STAGE=0,1,2,3,4 or CM_STAGE=5 CM_HALVES=0,1
layout(local_size_x = 64) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "cell.glsl"
#include "cell_fit.glsl"
#include "cell_split.glsl"
#include "lattice.glsl"
#include "grid_state.glsl"
#include "grid_places.glsl"
#include "grid_leaves.glsl"

uvec2 cm_where(vec3 v0, uint shape) { return cm_record_place(v0, shape, cm_cube_is_wide()); }

#if CM_STAGE == 0

layout(std430, binding = CM_STORAGE_GRID_PRIORITIES) readonly buffer CmPriorities { uint cm_priorities[]; };
layout(location = 3) uniform uint cm_level;
layout(location = 4) uniform uint cm_next;  // where the next level begins

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  uvec2 where = cm_cells[i].where;
  uint shape = cm_shape_of(where);
  uint cell_class = cm_shape_class(shape);
  uint child = 0u;
  if (cell_class != 1u || cm_shape_exponent(shape) != 0u) {  // no sixth of a voxel
    vec3 middle = cm_v0_of(where) + cm_from_frame(cm_frame_midpoint(cell_class) * cm_shape_unit(shape), shape);
    if (cm_priorities[cm_slot_of(ivec3(middle))] >= cm_state.cut)
      child = cm_next + 2u * atomicAdd(cm_state.placed[cm_level], 1u);
  }
  cm_cells[i].child = child;
}

#elif CM_STAGE == 1

layout(std430, binding = CM_STORAGE_GRID_LINKS) buffer CmLinks { uvec4 cm_links[]; };

uvec4 cm_with_link(uvec4 links, uint face, uint other) {
  return uvec4(face == 0u ? other : links.x, face == 1u ? other : links.y, face == 2u ? other : links.z,
               face == 3u ? other : links.w);
}

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  CmTreeCell cell = cm_cells[i];
  if (cell.child == 0u) return;
  uvec4 links = cm_links[i];
  uint shape = cm_shape_of(cell.where);
  uint cell_class = cm_shape_class(shape);
  vec3 v0 = cm_v0_of(cell.where);
  for (uint side = 0u; side < 2u; ++side) {
    vec3 child_v0 = side == 0u ? v0 : cm_cell_vertex(v0, shape, 1u);
    uvec4 own = uvec4(CM_NONE, CM_NONE, CM_NONE, cell.child + 1u - side);
    for (uint k = 0u; k < 2u; ++k) {
      uvec2 faces = cm_half_face(cell_class, side, k);
      uint other = cm_link(links, faces.y);
      if (other == CM_NONE) continue;
      // The neighbour is of the same diamond and splits too: its child at the same end of the edge.
      bool same = cm_v0_of(cm_cells[other].where) == child_v0;
      own = cm_with_link(own, faces.x, cm_cells[other].child + (same ? 0u : 1u));
    }
    uvec2 faces = cm_whole_face(cell_class, side);
    uint whole = cm_link(links, faces.y);
    if (whole != CM_NONE) {
      // If it splits in this round too, elsewhere: its cap (face 3) goes to child 1, its other whole face to child 0.
      uint below = cm_cells[whole].child;
      if (below != 0u) whole = below + (cm_links[whole].w == i ? 1u : 0u);
    }
    cm_links[cell.child + side] = cm_with_link(own, faces.x, whole);
    CmTreeCell child;
    child.child = 0u;
    child.leaves = 1u;
    child.where = cm_where(child_v0, cm_child_shape(shape, side));
    cm_cells[cell.child + side] = child;
  }
}

#elif CM_STAGE == 2

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  uint child = cm_cells[i].child;
  cm_cells[i].leaves = child == 0u ? 1u : cm_cells[child].leaves + cm_cells[child + 1u].leaves;
}

#elif CM_STAGE == 3 || CM_STAGE == 4

layout(std430, binding = CM_STORAGE_GRID_ORDER) buffer CmOrder { uvec2 cm_order[]; };  // leaves and inner cells before
// 24 pairs, as cm_order, an end mark, and room; then of each inner cell how many its child 0 has.
layout(std430, binding = CM_STORAGE_GRID_TREE) writeonly buffer CmTree { uint cm_tree[]; };
const uint cm_roots_words = 52u;

void main() {
#if CM_STAGE == 3
  if (gl_LocalInvocationID.x != 0u) return;
  uint leaves = 0u;
  for (uint root = 0u; root < 24u; ++root) {
    cm_order[root] = uvec2(leaves, leaves - root);
    cm_tree[2u * root] = leaves;
    cm_tree[2u * root + 1u] = leaves - root;
    leaves += cm_cells[root].leaves;
  }
  cm_tree[48] = leaves;
  cm_tree[49] = leaves - 24u;
  cm_tree[50] = 0u;
  cm_tree[51] = 0u;
#else
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  uint child = cm_cells[i].child;
  if (child == 0u) return;
  uvec2 order = cm_order[i];
  uint leaves = cm_cells[child].leaves;
  cm_tree[cm_roots_words + order.y] = leaves - 1u;
  cm_order[child] = order + uvec2(0u, 1u);
  cm_order[child + 1u] = order + uvec2(leaves);
#endif
}

#else

layout(std430, binding = CM_STORAGE_GRID_LINKS) readonly buffer CmLinks { uvec4 cm_links[]; };
layout(std430, binding = CM_STORAGE_GRID_ORDER) readonly buffer CmOrder { uvec2 cm_order[]; };
layout(std430, binding = CM_STORAGE_GRID_RECORDS) writeonly buffer CmRecords { uvec4 cm_records[]; };
layout(std430, binding = CM_STORAGE_GRID_BRICKS) readonly buffer CmBricks { uint cm_bricks[]; };  // 512 values each
layout(std430, binding = CM_STORAGE_GRID_COARSE) readonly buffer CmCoarse { uint cm_coarse[]; };
layout(std140, binding = CM_UNIFORM_CELL_PARTS) uniform CmParts { uvec4 cm_parts[CM_CELL_PARTS]; };  // grid::CellPart
const uint cm_first_part[11] = uint[11](CM_PARTS_OF_LEVELS);
layout(location = 3) uniform float cm_to_relative;  // from the grid's values
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
  bool dense;          // has any density
};

uvec2 cm_pack(float mean, vec3 gradient) {
  return uvec2(cm_half(mean * cm_to_relative) | (cm_half(gradient.x * cm_to_relative) << 16),
               cm_half(gradient.y * cm_to_relative) | (cm_half(gradient.z * cm_to_relative) << 16));
}

// Within a brick: the sum over its voxels.
CmLeaf cm_fine_leaf(vec3 v0, uint shape, uint level, ivec3 voxel) {
  uint first_value = CM_BLOCK_POINTS * cm_brick_at(voxel);
  int begin = cm_voxel_at_v0(v0, shape);
  ivec3 steps = cm_voxel_steps(shape);
  uint part = cm_first_part[level];
  uint end = cm_first_part[level + 1u];
  float low = 0.0;
  float high = 0.0;
  float reference = 0.0;
  float sum = 0.0;
  vec3 moment = vec3(0.0);
  for (uint i = part; i < end; ++i) {
    uvec4 words = cm_parts[i];
    float value = cm_value(first_value + uint(begin + cm_voxel_of_part(words.w, steps)));
    if (i == part) low = high = reference = value;
    low = min(low, value);
    high = max(high, value);
    float weighted = float(words.w >> 12) * (value - reference);
    sum += weighted;
    moment += weighted * uintBitsToFloat(words.xyz);
  }
  float inverse_count = 1.0 / float(CM_BLOCK_POINTS >> level);
  float mean = clamp(reference + sum * inverse_count, low, high);
  vec3 gradient = vec3(0.0);
  if (cm_linear && low < high) gradient = cm_fit_linear(cm_shape_class(shape), moment * inverse_count, mean).gradient;
  return CmLeaf(cm_pack(mean, gradient), high > 0.0);
}

// Above bricks.
CmLeaf cm_coarse_leaf(vec3 v0, uint shape, ivec3 voxel) {
  uint size = cm_shape_cube_size(shape);
  ivec3 corner = (voxel >> ivec3(int(size))) << ivec3(int(size));
  uint coarse = CM_COARSE_WORDS * cm_coarse_at(corner, size);
  if (coarse == 0u) {
    float value = cm_value(CM_BLOCK_POINTS * cm_brick_at(voxel));
    return CmLeaf(cm_pack(value, vec3(0.0)), value > 0.0);
  }
  uint cell = cm_coarse_cell(v0, shape, vec3(corner));
  uint bits = cm_coarse[coarse + 2u * CM_COARSE_CELLS + cell / 32u];
  return CmLeaf(uvec2(cm_coarse[coarse + 2u * cell], cm_coarse[coarse + 2u * cell + 1u]),
                ((bits >> (cell % 32u)) & 1u) != 0u);
}

// A link may point to a cell that has split since: down to the child that has the face. No edge that is bisected lies in
// the face (the grid conforms), so the face has exactly one end of it.
uint cm_resolve(uint other, vec3 v0, uint shape, uint face) {
  if (other == CM_NONE) return CM_NONE;
  uint away = cm_opposite(cm_shape_class(shape), face);
  uint child = cm_cells[other].child;
  while (child != 0u) {
    vec3 end = cm_v0_of(cm_cells[other].where);
    bool has_end = false;
    for (uint i = 0u; i < 4u; ++i) has_end = has_end || (i != away && cm_cell_vertex(v0, shape, i) == end);
    other = child + (has_end ? 0u : 1u);
    child = cm_cells[other].child;
  }
  return cm_order[other].x;
}

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  CmTreeCell cell = cm_cells[i];
  if (cell.child != 0u) return;
  vec3 v0 = cm_v0_of(cell.where);
  uint shape = cm_shape_of(cell.where);
  ivec3 voxel = cm_leaf_voxel(v0, shape);
  CmLeaf leaf;
  if (cm_is_fine(shape)) {
    leaf = cm_fine_leaf(v0, shape, cm_fine_level(shape), voxel);
  } else {
    leaf = cm_coarse_leaf(v0, shape, voxel);
  }
  if (leaf.dense) cm_put_in_box(v0, shape);
  uvec4 links = cm_links[i];
  uint rank = cm_order[i].x;
  cm_records[2u * rank] = uvec4(cm_resolve(links.x, v0, shape, 0u), cm_resolve(links.y, v0, shape, 1u),
                                cm_resolve(links.z, v0, shape, 2u), cm_resolve(links.w, v0, shape, 3u));
  // Without the first two it is empty.
  cm_records[2u * rank + 1u] =
      uvec4(cell.where, leaf.coefficients.x, leaf.coefficients.x == 0u ? 0u : leaf.coefficients.y);
}

#endif
