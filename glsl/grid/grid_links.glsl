// Links between the cells of a tree while it is built: each refers to the neighbor that existed when the cell was made.
#ifndef CM_GRID_LINKS_GLSL
#define CM_GRID_LINKS_GLSL

layout(std430, binding = CM_STORAGE_GRID_LINKS) buffer CmLinks { uvec4 cm_links[]; };

// Returns the neighbor behind a face that is a whole face of both `i` and `other`. If `other` has split, this is the
// child that inherited the face: its cap (face 3) goes to child 1, its other whole face to child 0.
uint cm_behind_whole(uint other, uint i) {
  uint child = cm_cells[other].child;
  return child == 0u ? other : child + (cm_links[other].w == i ? 1u : 0u);
}

#endif
