// The lattice of a grid's splits (src/grid/lattice.hpp): indexing. Shared by GLSL and C++.
//
// A vertex has octave o if 2^o is the largest power of two that divides its coordinates. Octaves 3 m to 3 m + 2 form
// scale m, whose lattice has spacing 8^m. Blocks contain 8^3 points of it. A block at corner c, counted in blocks,
// belongs to the point c of the next scale. So blocks form a tree, in which each block of scale 1 and up has up to 512
// children.
#ifndef CM_LATTICE_GLSL
#define CM_LATTICE_GLSL

#define CM_BLOCK_POINTS 512u
#define CM_TOP_BLOCK 1u  // block 0 stands for missing blocks
// Number of points of a brick's 9^3 at which the cells of its first 0 to 9 levels split.
#define CM_POINTS_OF_LEVELS 0u, 1u, 7u, 19u, 27u, 63u, 117u, 181u, 421u, 721u
#define CM_BRICK_POINTS 721u
// Parts of cells in bricks, voxel by voxel: of the ten shapes from a brick's Kuhn tetrahedron to a voxel's.
#define CM_PARTS_OF_LEVELS 0u, 120u, 190u, 230u, 250u, 263u, 271u, 275u, 278u, 280u, 281u
#define CM_CELL_PARTS 281u
// With linear interpolation, lattice point by lattice point. Weights are multiples of 1 / CM_SIXTH_BETWEEN of a sixth.
#define CM_PARTS_OF_LEVELS_BETWEEN 0u, 253u, 420u, 527u, 590u, 636u, 668u, 688u, 704u, 716u, 724u
#define CM_CELL_PARTS_BETWEEN 724u
#define CM_SIXTH_BETWEEN 40u
#define CM_COARSE_CELLS 42u
#define CM_COARSE_WORDS 86u  // two words per cell, and two words of bits

// Words of a channel for a cube's cells above bricks: `record` words per cell, and two words of bits.
CM_FN uint cm_coarse_channel_words(uint record) { return CM_COARSE_CELLS * record + 2u; }

CM_FN uint cm_octave(ivec3 vertex) { return uint(findLSB(vertex.x | vertex.y | vertex.z)); }
CM_FN uint cm_in_block(ivec3 point) {
  ivec3 p = point & ivec3(7);
  return uint(p.x * 64 + p.y * 8 + p.z);
}

// Fields of a block, two words: its corner and its scale.
CM_FN ivec3 cm_block_corner(uvec2 block) {
  return ivec3(int(block.x & 0xffffu), int(block.x >> 16), int(block.y & 0xffffu));
}
CM_FN uint cm_block_scale(uvec2 block) { return block.y >> 16; }

// Fields of an octree cube whose cells split, three words: its corner, in bricks; its log2 size; the number of levels
// of its own cells with priorities; and the index of the first priority.
CM_FN ivec3 cm_node_corner(uvec3 node) {
  return ivec3(int(node.x & 0xffffu), int(node.x >> 16), int(node.y & 0xffffu)) * 8;
}
CM_FN uint cm_node_size(uvec3 node) { return (node.y >> 16) & 31u; }
CM_FN uint cm_node_levels(uvec3 node) { return node.y >> 21; }
CM_FN uvec2 cm_node_words(ivec3 corner, uint log2_size, uint levels) {
  uvec3 brick = uvec3(corner >> ivec3(3));
  return uvec2(brick.x | (brick.y << 16), brick.z | (log2_size << 16) | (levels << 21));
}

// Number of cells that split at a vertex of this octave, in a cube of 2^log2_size voxels. It depends on how many
// coordinates are odd multiples of 2^octave.
CM_FN uint cm_cells_around(ivec3 vertex, uint octave, uint log2_size) {
  ivec3 odd = (vertex >> ivec3(int(octave))) & ivec3(1);
  ivec3 size = ivec3(1 << int(log2_size));
  uint outside = 0u;
  if (vertex.x == 0 || vertex.x == size.x) ++outside;
  if (vertex.y == 0 || vertex.y == size.y) ++outside;
  if (vertex.z == 0 || vertex.z == size.z) ++outside;
  int count = odd.x + odd.y + odd.z;
  uint inside = count == 1 ? 8u : (count == 2 ? 4u : 6u);
  return inside >> outside;
}

// Level of the cells that split there; that of the roots is 0.
CM_FN uint cm_split_level(ivec3 vertex, uint octave, uint log2_size) {
  ivec3 odd = (vertex >> ivec3(int(octave))) & ivec3(1);
  return 3u * (log2_size - 1u - octave) + uint(1 - (odd.x + odd.y + odd.z));
}

// Returns true if a cell is in a brick; its level there.
CM_FN bool cm_is_fine(uint shape) { return cm_shape_cube_size(shape) <= 3u; }
CM_FN uint cm_fine_level(uint shape) {
  uint cell_class = cm_shape_class(shape);
  return 3u * (3u - cm_shape_exponent(shape)) - (cell_class == 1u ? 0u : (cell_class == 2u ? 2u : 1u));
}

// Number of a cell among a cube's cells, above bricks. An octree cube at this corner has six Kuhn tetrahedra (B), their
// 12 halves (C), each on a face, and 24 quarters (A), each on an edge and a face. The root cube has only the roots.
CM_FN uint cm_coarse_cell(vec3 v0, uint shape, vec3 corner) {
  uint px = (shape >> 3) & 3u;
  uint py = (shape >> 5) & 3u;
  uint pz = (shape >> 7) & 3u;
  uint second = py < pz ? 0u : 1u;
  uint cell_class = cm_shape_class(shape);
  if (cell_class == 1u) return 2u * px + second;
  if (cell_class == 2u) {
    uint side = cm_pick(v0, pz) > cm_pick(corner, pz) ? 1u : 0u;
    return 6u + 4u * pz + 2u * side + (px < py ? 0u : 1u);
  }
  uint low = min(py, pz);
  uint high = max(py, pz);
  uint edge = (cm_pick(v0, low) > cm_pick(corner, low) ? 1u : 0u) + (cm_pick(v0, high) > cm_pick(corner, high) ? 2u : 0u);
  return 18u + 8u * px + 2u * edge + second;
}

#endif
