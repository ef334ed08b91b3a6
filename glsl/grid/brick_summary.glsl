// Data in main memory about a brick whose voxels stay on the GPU. Shared by GLSL and C++.
#ifndef CM_BRICK_SUMMARY_GLSL
#define CM_BRICK_SUMMARY_GLSL

#define CM_BRICK_LEVELS 9u  // levels of cells in a brick that may split
// Maximum number of edge directions per level (cm_edge_of).
#define CM_LEVEL_EDGES 6u
#define CM_BRICK_EDGES 54u

#define CM_BRICK_VOXELS 0xffffu
#define CM_BRICK_HUGE_SHIFT 16u
#define CM_BRICK_HUGE 0xfffu
#define CM_BRICK_NOT_FINITE 0x80000000u

struct CmBrickSummary {
  float reference;      // sums of cells are relative to this value
  float cells[42];      // per Kuhn tetrahedron (six), like grid::BrickSums: mass, square, x, y, z, min, max
  float blocks[64];     // sums of 2^3 voxels each, z fastest
  uint shadows[6];      // one bit per column of voxels that contains any density, 64 bits per axis x, y, z. Column
                        // along axis a through voxel (i, j) of axes (a + 1) % 3 and (a + 2) % 3: bit 8 i + j
  uint steepest[9];     // per level, the maximum over its cells, as upper halves of floats, rounded up. Low half: the
                        // variance left by a linear fit; high half: the variance; both times the squared edge length
  uint box;             // bounds of the nonzero voxels, low and high corner: 3 bits per coordinate, x first
  uint voxels;          // number of nonzero voxels; number of huge ones, shifted; and CM_BRICK_NOT_FINITE
};
#define CM_BRICK_SUMMARY_WORDS 124u

// Returns which of a level's edge directions this vector has (cube space).
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
