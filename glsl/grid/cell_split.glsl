// How a split distributes a cell's faces to its children; include after cell.glsl. Shared by GLSL and C++.
#ifndef CM_CELL_SPLIT_GLSL
#define CM_CELL_SPLIT_GLSL

// Returns the one face of a child (0 or 1) that is a whole face of its parent, and the parent's face. Face 3 of both
// children lies between them.
CM_FN uvec2 cm_whole_face(uint parent_class, uint child) {
  uint face = parent_class == 0u ? 1u : (parent_class == 1u ? 0u : 2u);
  return uvec2(face, child == 0u ? face : 3u);
}

// Returns one of the two (k: 0 or 1) faces of a child that are halves of the parent's faces at the refinement edge, and
// the parent's face.
CM_FN uvec2 cm_half_face(uint parent_class, uint child, uint k) {
  uint face = k == 0u ? (parent_class == 1u ? 1u : 0u) : (parent_class == 2u ? 1u : 2u);
  return uvec2(face, parent_class == 1u && child == 1u ? 3u - face : face);
}

#endif
