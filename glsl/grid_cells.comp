#version 450
// The cells of a grid, from the lattice of its splits: what src/grid/tet_grid.cpp computes, level by level. Where cells
// stand until they are in order is another in each run; the records are not.
// CM_STAGE 0: which cells of a level split and which are leaves. 1: children and their neighbours. 2: how many leaves are
// below. 3: the order of the roots, one work group. 4: of the others, and the tree of point location.
// variants: CM_STAGE=0,1,2,3,4
layout(local_size_x = 64) in;

#include "bindings.glsl"
#include "shared.glsl"
#include "cell.glsl"
#include "cell_split.glsl"
#include "lattice.glsl"
#include "grid_state.glsl"
#include "grid_places.glsl"
#include "grid_leaves.glsl"

// The children of the cell that stands there among those that split.
uint cm_children(uint place) { return CM_ROOTS + 2u * place; }

#if CM_STAGE == 0

layout(std430, binding = CM_STORAGE_GRID_PRIORITIES) readonly buffer CmPriorities { uint cm_priorities[]; };
layout(std430, binding = CM_STORAGE_GRID_BELOW) writeonly buffer CmBelow { uvec2 cm_below[]; };
layout(location = 3) uniform uint cm_first_leaf;  // in the list

bool cm_splits(uint i) {
  uvec2 where = cm_cells[i].where;
  uint shape = cm_shape_of(where);
  uint cell_class = cm_shape_class(shape);
  if (cell_class == 1u && cm_shape_exponent(shape) == 0u) return false;  // a sixth of a voxel
  vec3 middle = cm_v0_of(where) + cm_from_frame(cm_frame_midpoint(cell_class) * cm_shape_unit(shape), shape);
  return cm_priorities[cm_slot_of(ivec3(middle))] >= cm_state.cut;
}

// Of a work group: cells that split, and leaves; and where they begin in the list.
shared uint cm_counts[2];
shared uint cm_begins[2];

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  bool inside = i < cm_end;
  bool splits = inside && cm_splits(i);
  uint lane = gl_LocalInvocationID.x;
  if (lane < 2u) cm_counts[lane] = 0u;
  barrier();
  uint place = inside ? atomicAdd(cm_counts[splits ? 0u : 1u], 1u) : 0u;
  barrier();
  if (lane == 0u) {
    cm_begins[0] = atomicAdd(cm_state.split, cm_counts[0]);
    cm_begins[1] = cm_first_leaf + atomicAdd(cm_state.leaves, cm_counts[1]);
  }
  barrier();
  if (!inside) return;
  place += cm_begins[splits ? 0u : 1u];
  cm_list[place] = i;
  cm_cells[i].child = splits ? cm_children(place) : 0u;
  if (!splits) cm_below[i].x = 1u;
}

#elif CM_STAGE == 1

#include "grid_links.glsl"

uvec4 cm_with_link(uvec4 links, uint face, uint other) {
  return uvec4(face == 0u ? other : links.x, face == 1u ? other : links.y, face == 2u ? other : links.z,
               face == 3u ? other : links.w);
}

// Children behind half of a face that the split cuts, at this cell's v0 and at its v1: of the same diamond, it splits too.
uvec2 cm_behind_halves(uint other, vec3 v0) {
  if (other == CM_NONE) return uvec2(CM_NONE);
  uint child = cm_cells[other].child;
  return cm_v0_of(cm_cells[other].where) == v0 ? uvec2(child, child + 1u) : uvec2(child + 1u, child);
}

void main() {
  uint place = cm_first + gl_GlobalInvocationID.x;
  if (place >= cm_end) return;
  uint i = cm_list[place];
  uint children = cm_children(place);
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
    cm_cells[children + side].where = cm_record_place(child_v0, cm_child_shape(shape, side), cm_cube_is_wide());
  }
}

#else

// Of each cell how many leaves are below it, itself if it is one, and how many inner cells before it.
layout(std430, binding = CM_STORAGE_GRID_BELOW) buffer CmBelow { uvec2 cm_below[]; };

#if CM_STAGE == 2

void main() {
  uint place = cm_first + gl_GlobalInvocationID.x;
  if (place >= cm_end) return;
  uint children = cm_children(place);
  cm_below[cm_list[place]].x = cm_below[children].x + cm_below[children + 1u].x;
}

#else

// 24 pairs, as many leaves and inner cells are before a root, an end mark, and room; then of each inner cell how many its
// child 0 has.
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
  uint place = cm_first + gl_GlobalInvocationID.x;
  if (place >= cm_end) return;
  uint i = cm_list[place];
  uint children = cm_children(place);
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
