// Sums over the cells in a brick, like grid::BrickSums, for kernels with one work group of 64 per brick. The includer
// has cell.glsl before this, and
//   void cm_visit(uint level, uint heap, uint frame, CmSums sums)   called for each cell of a tetrahedron, with heap
//                                                                   index 1 to 511; on levels 6 to 8 by all invocations
#ifndef CM_BRICK_SUMS_GLSL
#define CM_BRICK_SUMS_GLSL

// Cells of a Kuhn tetrahedron in heap order, like grid::BrickTree, for the frame whose axes are the cube's. Bits 0 to
// 17: four times the centroid, 6 bits per axis. For cells that split, bits 18 to 26: frame, 27 and 28: class, 29 and
// 30: exponent.
layout(std140, binding = CM_UNIFORM_BRICK_TREE) uniform CmBrickTree {
  uvec4 cm_brick_tree[256];
  vec4 cm_edges_squared[14];  // CM_LEVEL_EDGES per level
};

struct CmSums {
  float mass;    // sum of the value minus the reference
  float square;  // sum of its square
  vec3 first;    // sum of it times the centroid, relative to the brick's low corner
  float low;
  float high;
  float lit;  // maximum transmittance
};

shared float cm_values[512];  // voxels of the brick
shared float cm_lit[64];      // transmittance of its 2^3 blocks
shared float cm_reference;
shared CmSums cm_halves[128];  // in heap order

uint cm_tree_word(uint heap) { return cm_brick_tree[heap >> 2u][heap & 3u]; }

// Centroid in cube space, relative to the brick's low corner.
vec3 cm_tree_centroid(uint word, uint frame) {
  vec3 own = 0.25 * vec3(float(word & 63u), float((word >> 6) & 63u), float((word >> 12) & 63u));
  vec3 low = cm_from_frame(vec3(1.0), frame);
  return cm_from_frame(own, frame) + 8.0 * vec3(low.x < 0.0 ? 1.0 : 0.0, low.y < 0.0 ? 1.0 : 0.0, low.z < 0.0 ? 1.0 : 0.0);
}
// Shape relative to the frame of the tetrahedron.
uint cm_tree_shape(uint word) {
  return ((word >> 18) & 0x1ffu) | (((word >> 27) & 3u) << 9) | (((word >> 29) & 3u) << 11);
}
float cm_edge_squared(uint level, vec3 edge) {
  uint i = CM_LEVEL_EDGES * level + cm_edge_of(edge);
  return cm_edges_squared[i >> 2u][i & 3u];
}

// The same function as grid::kuhn_frame. odd: parity of the brick's position along each axis.
uint cm_kuhn_frame(uvec3 odd, uint permutation) {
  uint x = permutation / 2u;
  uint low = x == 0u ? 1u : 0u;
  uint high = x == 2u ? 1u : 2u;
  uint y = (permutation & 1u) == 0u ? low : high;
  uint z = (permutation & 1u) == 0u ? high : low;
  uint signs = odd.x | (odd.y << 1) | (odd.z << 2);
  return ((signs >> x) & 1u) | (((signs >> y) & 1u) << 1) | (((signs >> z) & 1u) << 2) | (x << 3) | (y << 5) | (z << 7);
}

CmSums cm_leaf_sums(uint heap, uint frame) {
  vec3 middle = cm_tree_centroid(cm_tree_word(heap), frame);
  uvec3 voxel = uvec3(middle);
  float value = cm_values[voxel.x * 64u + voxel.y * 8u + voxel.z];
  precise float mass = value - cm_reference;
  precise float square = mass * mass;
  precise vec3 first = mass * middle;
  return CmSums(mass, square, first, value, value, cm_lit[(voxel.x / 2u) * 16u + (voxel.y / 2u) * 4u + voxel.z / 2u]);
}
CmSums cm_add(CmSums a, CmSums b) {
  precise float mass = a.mass + b.mass;
  precise float square = a.square + b.square;
  precise vec3 first = a.first + b.first;
  return CmSums(mass, square, first, min(a.low, b.low), max(a.high, b.high), max(a.lit, b.lit));
}

struct CmCell {
  float mean;
  float variance;
  vec3 covariance;  // like grid::frame_covariance
  uint cell_class;
  vec3 edge;      // in cube space
  vec3 midpoint;  // its midpoint, relative to the brick's low corner
};
CmCell cm_cell_of(uint level, uint heap, uint frame, CmSums sums) {
  uint word = cm_tree_word(heap);
  uint shape = cm_tree_shape(word);
  float inverse_count = 1.0 / float(512u >> level);
  precise float mean = sums.mass * inverse_count;
  precise float variance = max(0.0, sums.square * inverse_count - mean * mean);
  vec3 middle = cm_tree_centroid(word, frame);
  precise vec3 covariance = sums.first * inverse_count - middle * mean;
  covariance = cm_to_frame(cm_to_frame(covariance, frame), shape) * cm_shape_inverse_unit(shape);
  uint cell_class = cm_shape_class(shape);
  float unit = cm_shape_unit(shape);
  vec3 edge = cm_from_frame(cm_from_frame(cm_frame_vertex(cell_class, 1u) * unit, shape), frame);
  vec3 to_middle = (cm_frame_midpoint(cell_class) - cm_frame_centroid(cell_class)) * unit;
  precise float whole = cm_reference + mean;
  return CmCell(whole, variance, covariance, cell_class, edge,
                middle + cm_from_frame(cm_from_frame(to_middle, shape), frame));
}

void cm_visit(uint level, uint heap, uint frame, CmSums sums);

// Sums one tetrahedron; called by the whole work group. The total is in cm_halves[1], for all invocations after a
// barrier.
void cm_sum_tree(uint frame) {
  uint t = gl_LocalInvocationIndex;
  CmSums pair[2];
  for (uint half_of = 0u; half_of < 2u; ++half_of) {
    CmSums four[2];
    for (uint i = 0u; i < 2u; ++i) {
      uint heap = 256u + 4u * t + 2u * half_of + i;
      four[i] = cm_add(cm_leaf_sums(2u * heap, frame), cm_leaf_sums(2u * heap + 1u, frame));
      cm_visit(8u, heap, frame, four[i]);
    }
    pair[half_of] = cm_add(four[0], four[1]);
    cm_visit(7u, 128u + 2u * t + half_of, frame, pair[half_of]);
  }
  CmSums sums = cm_add(pair[0], pair[1]);
  cm_visit(6u, 64u + t, frame, sums);
  barrier();  // all invocations have finished the previous tetrahedron
  cm_halves[64u + t] = sums;
  barrier();
  for (uint level = 6u; level-- > 0u;) {
    uint cells = 1u << level;
    if (t < cells) {
      uint heap = cells + t;
      sums = cm_add(cm_halves[2u * heap], cm_halves[2u * heap + 1u]);
      cm_visit(level, heap, frame, sums);
      cm_halves[heap] = sums;
    }
    barrier();
  }
}

// Computes the mean of the brick as the reference. All invocations call it once cm_values is complete.
void cm_find_reference() {
  uint t = gl_LocalInvocationIndex;
  precise float row = 0.0;
  for (uint z = 0u; z < 8u; ++z) row += cm_values[8u * t + z];
  cm_halves[64u + t].mass = row;
  barrier();
  for (uint level = 32u; level >= 1u; level /= 2u) {
    if (t < level) {
      precise float both = cm_halves[2u * (level + t)].mass + cm_halves[2u * (level + t) + 1u].mass;
      cm_halves[level + t].mass = both;
    }
    barrier();
  }
  if (t == 0u) cm_reference = cm_halves[1].mass / 512.0;
  barrier();
}

#endif
