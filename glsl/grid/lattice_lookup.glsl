// Looks up blocks, bricks and cubes in a lattice, from its top (src/grid/lattice.hpp), for the kernels that build a
// grid.
#ifndef CM_LATTICE_LOOKUP_GLSL
#define CM_LATTICE_LOOKUP_GLSL

struct CmLatticeEntry {
  uint block;
  uint brick;
  uint coarse;
};
layout(std430, binding = CM_STORAGE_LATTICE_ENTRIES) readonly buffer CmLatticeEntries {
  CmLatticeEntry cm_lattice_entries[];
};
layout(location = 2) uniform uint cm_log2_size;  // of the root cube

// Returns the block of that scale at a corner; 0: none.
uint cm_block_at(ivec3 corner, uint scale) {
  uint block = CM_TOP_BLOCK;
  for (uint s = cm_log2_size / 3u; s > scale; --s) {
    ivec3 point = corner >> ivec3(int(3u * (s - 1u - scale)));
    block = cm_lattice_entries[block * CM_BLOCK_POINTS + cm_in_block(point)].block;
  }
  return block;
}

// Returns the index of a vertex in the lattice; it is in block 0 if the lattice lacks it.
uint cm_slot_of(ivec3 vertex) {
  uint scale = cm_octave(vertex) / 3u;
  ivec3 point = vertex >> ivec3(int(3u * scale));
  return cm_block_at(point >> ivec3(3), scale) * CM_BLOCK_POINTS + cm_in_block(point);
}

// Returns the brick that contains a voxel's value.
uint cm_brick_at(ivec3 voxel) {
  uint block = CM_TOP_BLOCK;
  uint at = 0u;
  for (uint scale = cm_log2_size / 3u; scale > 0u && block != 0u; --scale) {
    at = block * CM_BLOCK_POINTS + cm_in_block(voxel >> ivec3(int(3u * scale)));
    block = cm_lattice_entries[at].block;
  }
  return cm_lattice_entries[at].brick;
}

// Returns the cells of the octree cube of 2^size voxels at this corner; 0: the cube has a single value.
uint cm_coarse_at(ivec3 corner, uint size) {
  ivec3 point = (corner + ivec3(1 << int(size - 1u))) >> ivec3(int(3u * ((size - 1u) / 3u)));
  return cm_lattice_entries[cm_block_at(point >> ivec3(3), (size - 1u) / 3u) * CM_BLOCK_POINTS + cm_in_block(point)]
      .coarse;
}

#endif
