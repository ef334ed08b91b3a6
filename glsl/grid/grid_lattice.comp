#version 450
// Decides which cells of a grid split for one view, from stored priorities, like src/grid/refine.cpp. All operations
// are integer maxima and sums, so the result does not depend on their order. CM_STAGE 0: cells raise the priorities of
// the vertices at which they split, one work group per octree cube. 1: vertices raise their parents; one dispatch per
// octave and number of odd coordinates. 2: number of cells that each priority adds. 3: priority at which the budget
// cuts, one work group. 4: number of cells that each level adds.
// variants: CM_STAGE=0,1,2,3,4
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/lattice.glsl"
#include "grid/grid_state.glsl"
#include "grid/lattice_lookup.glsl"

layout(std430, binding = CM_STORAGE_GRID_STATE) buffer CmState { CmGridState cm_state; };
layout(std430, binding = CM_STORAGE_GRID_PRIORITIES) buffer CmPriorities { uint cm_priorities[]; };
layout(std430, binding = CM_STORAGE_GRID_BLOCKS) readonly buffer CmBlocks { uvec2 cm_blocks[]; };
layout(location = 0) uniform uint cm_first;
layout(location = 1) uniform uint cm_end;

#if CM_STAGE == 0

layout(std430, binding = CM_STORAGE_GRID_NODES) readonly buffer CmNodes { uint cm_nodes[]; };    // three words per node
layout(std430, binding = CM_STORAGE_GRID_LEVELS) readonly buffer CmLevels { uint cm_levels[]; };  // one byte per node
layout(std430, binding = CM_STORAGE_GRID_OWN) readonly buffer CmOwn { uint cm_own[]; };           // two per word
layout(std140, binding = CM_UNIFORM_BRICK_POINTS) uniform CmPoints { uvec4 cm_points[(CM_BRICK_POINTS + 3u) / 4u]; };  // four per uvec4
const uint cm_points_of_levels[10] = uint[10](CM_POINTS_OF_LEVELS);

void main() {
  uint index = cm_first + gl_WorkGroupID.x;
  uvec3 node = uvec3(cm_nodes[3u * index], cm_nodes[3u * index + 1u], cm_nodes[3u * index + 2u]);
  uint count = cm_points_of_levels[(cm_levels[index / 4u] >> (8u * (index % 4u))) & 255u];
  ivec3 corner = cm_node_corner(node);
  int finer = int(cm_node_size(node)) - 3;
  for (uint i = gl_LocalInvocationID.x; i < count; i += gl_WorkGroupSize.x) {
    uint at = node.z + i;
    uint priority = (cm_own[at / 2u] >> (16u * (at & 1u))) & 0xffffu;
    if (priority == 0u) continue;
    uint word = cm_points[i / 4u][i & 3u];
    ivec3 point = ivec3(int(word & 15u), int((word >> 4) & 15u), int(word >> 8));
    atomicMax(cm_priorities[cm_slot_of(corner + (point << ivec3(finer)))], priority);
  }
}

#elif CM_STAGE == 1

layout(location = 3) uniform uint cm_octave_of;
layout(location = 4) uniform uint cm_odd;
layout(location = 5) uniform uint cm_first_block;  // of the octave's scale

void cm_raise(ivec3 vertex, uint priority) {
  uint slot = cm_slot_of(vertex);
  if (cm_priorities[slot] < priority) atomicMax(cm_priorities[slot], priority);
}

void main() {
  uint i = cm_first + gl_GlobalInvocationID.x;
  if (i >= cm_end) return;
  // Each block of 2^3 lattice steps has one vertex with three odd coordinates. It has three vertices with one or two
  // odd coordinates, which differ in the axis.
  uint step_shift = cm_octave_of % 3u;
  uint side_shift = 2u - step_shift;
  uint cubes = 1u << (3u * side_shift);
  uint each = cm_odd == 3u ? cubes : 3u * cubes;
  uint block = cm_first_block + i / each;
  uint r = i % each;
  uint axis = r / cubes;  // axis with the other parity than the other two
  ivec3 cube = ivec3(int((r >> (2u * side_shift)) & ((1u << side_shift) - 1u)),
                     int((r >> side_shift) & ((1u << side_shift) - 1u)), int(r & ((1u << side_shift) - 1u)));
  ivec3 single = ivec3(axis == 0u ? 1 : 0, axis == 1u ? 1 : 0, axis == 2u ? 1 : 0);
  ivec3 odd = cm_odd == 3u ? ivec3(1) : (cm_odd == 2u ? ivec3(1) - single : single);
  ivec3 local = ((cube << ivec3(1)) + odd) << ivec3(int(step_shift));
  uint priority = cm_priorities[block * CM_BLOCK_POINTS + cm_in_block(local)];
  if (priority == 0u) return;
  uvec2 words = cm_blocks[block];
  ivec3 v = (cm_block_corner(words) * 8 + local) << ivec3(int(3u * cm_block_scale(words)));
  int h = 1 << int(cm_octave_of);
  if (cm_odd == 3u) {
    // Center of a cube. Of its corners, low is the one with multiples of 4 h, and high is opposite to it.
    ivec3 to_low = ivec3(((v.x - h) & (4 * h - 1)) == 0 ? -h : h, ((v.y - h) & (4 * h - 1)) == 0 ? -h : h,
                         ((v.z - h) & (4 * h - 1)) == 0 ? -h : h);
    ivec3 low = v + to_low;
    ivec3 high = v - to_low;
    cm_raise(ivec3(high.x, low.y, low.z), priority);
    cm_raise(ivec3(low.x, high.y, low.z), priority);
    cm_raise(ivec3(low.x, low.y, high.z), priority);
    return;
  }
  int size = 1 << int(cm_log2_size);
  for (int k = 0; k < 3; ++k) {
    ivec3 along = ivec3(k == 0 ? h : 0, k == 1 ? h : 0, k == 2 ? h : 0);
    if ((k == 0 ? odd.x : (k == 1 ? odd.y : odd.z)) != 0) continue;
    int here = k == 0 ? v.x : (k == 1 ? v.y : v.z);
    if (here < size) cm_raise(v + along, priority);
    if (here > 0) cm_raise(v - along, priority);
  }
}

#elif CM_STAGE == 2 || CM_STAGE == 4

#if CM_STAGE == 2
layout(std430, binding = CM_STORAGE_GRID_BINS) buffer CmBins { uint cm_bins[]; };
#else
shared uint cm_added[CM_SPLIT_LEVELS];
#endif

// One work group per block of points.
void main() {
#if CM_STAGE == 4
  if (gl_LocalInvocationID.x < CM_SPLIT_LEVELS) cm_added[gl_LocalInvocationID.x] = 0u;
  barrier();
#endif
  uint block = cm_first + gl_WorkGroupID.x;
  uvec2 words = cm_blocks[block];
  for (uint i = gl_LocalInvocationID.x; i < CM_BLOCK_POINTS; i += gl_WorkGroupSize.x) {
    uint priority = cm_priorities[block * CM_BLOCK_POINTS + i];
#if CM_STAGE == 2
    if (priority == 0u) continue;
#else
    if (priority < cm_state.cut || priority == 0u) continue;
#endif
    ivec3 local = ivec3(int(i >> 6), int((i >> 3) & 7u), int(i & 7u));
    ivec3 vertex = (cm_block_corner(words) * 8 + local) << ivec3(int(3u * cm_block_scale(words)));
    uint octave = cm_octave(vertex);
    uint around = cm_cells_around(vertex, octave, cm_log2_size);
#if CM_STAGE == 2
    atomicAdd(cm_bins[priority], around);
#else
    atomicAdd(cm_added[cm_split_level(vertex, octave, cm_log2_size)], around);
#endif
  }
#if CM_STAGE == 4
  barrier();
  if (gl_LocalInvocationID.x < CM_SPLIT_LEVELS && cm_added[gl_LocalInvocationID.x] != 0u)
    atomicAdd(cm_state.added[gl_LocalInvocationID.x], cm_added[gl_LocalInvocationID.x]);
#endif
}

#else

layout(std430, binding = CM_STORAGE_GRID_BINS) readonly buffer CmBins { uint cm_bins[]; };
layout(location = 3) uniform uint cm_max_cells;
const uint cm_run = CM_PRIORITIES / 64u;
shared uint cm_sums[64];

void main() {
  // Runs of priorities, the largest first.
  uint lane = gl_LocalInvocationID.x;
  uint top = CM_PRIORITIES - lane * cm_run;
  uint sum = 0u;
  for (uint i = 0u; i < cm_run; ++i) sum += cm_bins[top - 1u - i];
  cm_sums[lane] = sum;
  barrier();
  if (lane != 0u) return;
  uint cells = CM_ROOTS;
  uint run = 0u;
  while (run < 64u && cm_sums[run] <= cm_max_cells - cells) cells += cm_sums[run++];
  uint cut = CM_PRIORITIES - run * cm_run;
  bool limited = false;
  // Finds the cut within the run that exceeds the budget.
  for (uint i = 0u; run < 64u && i < cm_run && !limited; ++i) {
    uint next = cm_bins[cut - 1u];
    limited = next > cm_max_cells - cells;
    if (!limited) {
      cells += next;
      --cut;
    }
  }
  cm_state.cut = max(cut, 1u);  // priority 0 never splits
  cm_state.cells = cells;
  cm_state.limited = limited ? 1u : 0u;
}

#endif
