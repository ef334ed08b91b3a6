// What main memory knows of a brick whose voxels stay in GL. Shared by GLSL and C++.
#ifndef CM_BRICK_SUMMARY_GLSL
#define CM_BRICK_SUMMARY_GLSL

#define CM_BRICK_LEVELS 9u  // of cells in it that may split
// Of a level so many edges are not parallel, at most (cm_edge_of).
#define CM_LEVEL_EDGES 6u
#define CM_BRICK_EDGES 54u

#define CM_BRICK_VOXELS 0xffffu
#define CM_BRICK_HUGE_SHIFT 16u
#define CM_BRICK_HUGE 0xfffu
#define CM_BRICK_NOT_FINITE 0x80000000u

struct CmBrickSummary {
  float reference;      // what sums of cells are relative to
  float cells[42];      // of its six Kuhn tetrahedra, as grid::BrickSums: mass, square, x, y, z, min, max
  float blocks[64];     // sums of 2^3 voxels, z fastest
  uint shadows[6];      // of columns along x, y and z that meet any density 64 bits each: along axis a, of voxels at
                        // (a + 1) % 3 and (a + 2) % 3, bit 8 times the former plus the latter
  uint steepest[9];     // of cells of a level the most, upper halves of floats that are no less: low, of the variance
                        // that a linear fit leaves, high, of the variance; times the square of the edge's length
  uint box;             // of voxels that are not 0, low and high: 3 bits each, x first
  uint voxels;          // how many are not 0; how many were huge, shifted; and CM_BRICK_NOT_FINITE
};
#define CM_BRICK_SUMMARY_WORDS 124u

// Which of a level's edges is along this vector (in cube space).
CM_FN uint cm_edge_of(vec3 edge) {
  uint zeros = (edge.x == 0.0f ? 1u : 0u) + (edge.y == 0.0f ? 1u : 0u) + (edge.z == 0.0f ? 1u : 0u);
  if (zeros == 2u) return edge.x != 0.0f ? 0u : (edge.y != 0.0f ? 1u : 2u);
  bool turns_y = edge.x * edge.y < 0.0f;
  bool turns_z = edge.x * edge.z < 0.0f;
  if (zeros == 0u) return (turns_y ? 1u : 0u) + (turns_z ? 2u : 0u);
  if (edge.x == 0.0f) return edge.y * edge.z < 0.0f ? 1u : 0u;
  return edge.y == 0.0f ? (turns_z ? 3u : 2u) : (turns_y ? 5u : 4u);
}

#endif
