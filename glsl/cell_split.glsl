// How a split hands a cell's faces down to its children, after cell.glsl. Shared by GLSL and C++.
#ifndef CM_CELL_SPLIT_GLSL
#define CM_CELL_SPLIT_GLSL

// The one face of a child (0 or 1) that is a whole face of its parent, and which. Face 3 of both is between them.
CM_FN uvec2 cm_whole_face(uint parent_class, uint child) {
  uint face = parent_class == 0u ? 1u : (parent_class == 1u ? 0u : 2u);
  return uvec2(face, child == 0u ? face : 3u);
}

// The two faces of a child (k: 0 or 1) that are halves of the parent's at the refinement edge, and of which.
CM_FN uvec2 cm_half_face(uint parent_class, uint child, uint k) {
  uint face = k == 0u ? (parent_class == 1u ? 1u : 0u) : (parent_class == 2u ? 1u : 2u);
  return uvec2(face, parent_class == 1u && child == 1u ? 3u - face : face);
}

#endif
