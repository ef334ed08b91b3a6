// How the cells of a tree point to each other while it is built: to what was behind each face when they were made.
#ifndef CM_GRID_LINKS_GLSL
#define CM_GRID_LINKS_GLSL

layout(std430, binding = CM_STORAGE_GRID_LINKS) buffer CmLinks { uvec4 cm_links[]; };

// What has the face that i and the other have whole. If this splits elsewhere its cap (face 3) goes to child 1, its other
// whole face to child 0.
uint cm_behind_whole(uint other, uint i) {
  uint child = cm_cells[other].child;
  return child == 0u ? other : child + (cm_links[other].w == i ? 1u : 0u);
}

#endif
