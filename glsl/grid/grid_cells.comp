#version 450
// Builds the cells of a grid from the lattice of its splits, level by level, like src/grid/tet_grid.cpp. The order of
// cells in the buffers differs between runs until they are sorted; the records do not. CM_STAGE 0: which cells of a
// level split and which are leaves. 1: children and their neighbors. 2: number of leaves below each cell. 3: order of
// the roots, one work group. 4: order of the other cells, and the point-location tree.
// variants: CM_STAGE=0,1,2,3,4
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/cell_split.glsl"
#include "grid/lattice.glsl"
#include "grid/grid_state.glsl"
#include "grid/lattice_lookup.glsl"
#include "grid/grid_leaves.glsl"

// First child of the cell at this index in the list of splitting cells.
uint cm_children(uint slot) { return CM_ROOTS + 2u * slot; }

#if CM_STAGE == 0

layout(std430, binding = CM_STORAGE_GRID_PRIORITIES) readonly buffer CmPriorities { uint cm_priorities[]; };
layout(std430, binding = CM_STORAGE_GRID_BELOW) writeonly buffer CmBelow { uvec2 cm_below[]; };
layout(location = 3) uniform uint cm_first_leaf;  // index in the list

bool cm_splits(uint i) {
  uvec2 where = cm_cells[i].where;
  uint shape = cm_shape_of(where);
  uint cell_class = cm_shape_class(shape);
  if (cell_class == 1u && cm_shape_exponent(shape) == 0u) return false;  // of a sixth of a voxel
  vec3 middle = cm_v0_of(where) + cm_from_frame(cm_frame_midpoint(cell_class) * cm_shape_unit(shape), shape);
  return cm_priorities[cm_slot_of(ivec3(middle))] >= cm_state.cut;
}

// Per work group: numbers of splitting cells and of leaves, and their first indices in the list.
shared uint cm_counts[2];
shared uint cm_begins[2];

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  bool inside = i < cm_end;
  bool splits = inside && cm_splits(i);
  uint lane = gl_LocalInvocationID.x;
  if (lane < 2u) cm_counts[lane] = 0u;
  barrier();
  uint slot = inside ? atomicAdd(cm_counts[splits ? 0u : 1u], 1u) : 0u;
  barrier();
  if (lane == 0u) {
    cm_begins[0] = atomicAdd(cm_state.split, cm_counts[0]);
    cm_begins[1] = cm_first_leaf + atomicAdd(cm_state.leaves, cm_counts[1]);
  }
  barrier();
  if (!inside) return;
  slot += cm_begins[splits ? 0u : 1u];
  cm_list[slot] = i;
  cm_cells[i].child = splits ? cm_children(slot) : 0u;
  if (!splits) cm_below[i].x = 1u;
}

#elif CM_STAGE == 1

#include "grid/grid_links.glsl"

uvec4 cm_with_link(uvec4 links, uint face, uint other) {
  return uvec4(face == 0u ? other : links.x, face == 1u ? other : links.y, face == 2u ? other : links.z,
               face == 3u ? other : links.w);
}

// Children of the neighbor behind a face that the split halves: at this cell's v0, and at its v1. The neighbor belongs
// to the same diamond, so it splits too.
uvec2 cm_behind_halves(uint other, vec3 v0) {
  if (other == CM_NONE) return uvec2(CM_NONE);
  uint child = cm_cells[other].child;
  return cm_v0_of(cm_cells[other].where) == v0 ? uvec2(child, child + 1u) : uvec2(child + 1u, child);
}

void main() {
  uint slot = cm_first + gl_GlobalInvocationID.x;
  if (slot >= cm_end) return;
  uint i = cm_list[slot];
  uint children = cm_children(slot);
  uvec2 where = cm_cells[i].where;
  uvec4 links = cm_links[i];
  uint shape = cm_shape_of(where);
  uint cell_class = cm_shape_class(shape);
  vec3 v0 = cm_v0_of(where);
  uint cut = cm_half_face(cell_class, 0u, 0u).y;
  uvec2 behind_cut = cm_behind_halves(cm_link(links, cut), v0);
  uvec2 behind_next = cm_behind_halves(cm_link(links, cm_half_face(cell_class, 0u, 1u).y), v0);
  for (uint side = 0u; side < 2u; ++side) {
    uvec4 own = uvec4(CM_NONE, CM_NONE, CM_NONE, children + 1u - side);
    for (uint k = 0u; k < 2u; ++k) {
      uvec2 faces = cm_half_face(cell_class, side, k);
      own = cm_with_link(own, faces.x, (faces.y == cut ? behind_cut : behind_next)[side]);
    }
    uvec2 faces = cm_whole_face(cell_class, side);
    uint whole = cm_link(links, faces.y);
    if (whole != CM_NONE) whole = cm_behind_whole(whole, i);
    cm_links[children + side] = cm_with_link(own, faces.x, whole);
    vec3 child_v0 = side == 0u ? v0 : cm_cell_vertex(v0, shape, 1u);
    cm_cells[children + side].where = cm_pack_v0_shape(child_v0, cm_child_shape(shape, side), cm_cube_is_wide());
  }
}

#else

// Per cell: number of leaves below it (1 for a leaf), and number of inner cells before it.
layout(std430, binding = CM_STORAGE_GRID_BELOW) buffer CmBelow { uvec2 cm_below[]; };

#if CM_STAGE == 2

void main() {
  uint slot = cm_first + gl_GlobalInvocationID.x;
  if (slot >= cm_end) return;
  uint children = cm_children(slot);
  cm_below[cm_list[slot]].x = cm_below[children].x + cm_below[children + 1u].x;
}

#else

// 24 pairs (leaves, inner cells before a root), an end mark and an unused pair; then per inner cell the number of inner
// cells below child 0.
layout(std430, binding = CM_STORAGE_GRID_TREE) writeonly buffer CmTree { uint cm_tree[]; };
const uint cm_roots_words = 2u * CM_ROOTS + 4u;

void main() {
#if CM_STAGE == 3
  if (gl_LocalInvocationID.x != 0u) return;
  uint leaves = 0u;
  for (uint root = 0u; root < CM_ROOTS; ++root) {
    cm_cells[root].rank = leaves;
    cm_below[root].y = leaves - root;
    cm_tree[2u * root] = leaves;
    cm_tree[2u * root + 1u] = leaves - root;
    leaves += cm_below[root].x;
  }
  cm_tree[2u * CM_ROOTS] = leaves;
  cm_tree[2u * CM_ROOTS + 1u] = leaves - CM_ROOTS;
  cm_tree[2u * CM_ROOTS + 2u] = 0u;
  cm_tree[2u * CM_ROOTS + 3u] = 0u;
#else
  uint slot = cm_first + gl_GlobalInvocationID.x;
  if (slot >= cm_end) return;
  uint i = cm_list[slot];
  uint children = cm_children(slot);
  uint rank = cm_cells[i].rank;
  uint inner = cm_below[i].y;
  uint leaves = cm_below[children].x;
  cm_tree[cm_roots_words + inner] = leaves - 1u;
  cm_cells[children].rank = rank;
  cm_cells[children + 1u].rank = rank + leaves;
  cm_below[children].y = inner + 1u;
  cm_below[children + 1u].y = inner + leaves;
#endif
}

#endif
#endif
