#version 450
// Converts a host's packed bricks (pack_bricks.comp) to the values that volumes store, and summarizes them for main
// memory (brick_summary.glsl): one work group per brick. NaN, infinite and huge values become 0 and are reported;
// negative values become 0. CM_FIELD 2: the field of the cells. 0, 1: other fields, which need only maximum magnitude,
// box and voxel counts; with 0 negative values are kept.
// variants: CM_FORMAT=0,1,2,3 CM_FIELD=0,1,2
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/cell_fit.glsl"
#include "grid/brick_summary.glsl"

// CM_FORMAT: values of render::VoxelFormat.
#define CM_HALVES (CM_FORMAT == 1)
#define CM_CELLS (CM_FIELD == 2)

layout(std430, binding = CM_STORAGE_PACKED_BRICKS) readonly buffer CmPackedBricks {
  uint cm_filled;
  uint cm_emptied;
  uint cm_packed_bricks[];
};
layout(std430, binding = CM_STORAGE_PACKED_VALUES) readonly buffer CmPacked { uint cm_packed[]; };
layout(std430, binding = CM_STORAGE_BRICKS_KEPT) writeonly buffer CmKept { uint cm_kept[]; };
layout(std430, binding = CM_STORAGE_BRICK_SUMMARIES) writeonly buffer CmSummaries { CmBrickSummary cm_summaries[]; };
layout(location = 0) uniform uvec2 cm_range;   // bricks: first, and one past the last
layout(location = 1) uniform uvec3 cm_bricks;  // bricks of the field along each axis

shared uint cm_box[6];  // low corner, then 7 - high corner
shared uint cm_count;
shared uint cm_bad;
shared uint cm_huge;

#if CM_CELLS
#include "grid/brick_sums.glsl"

shared uint cm_steepest[2 * CM_BRICK_LEVELS];
shared uint cm_shadows[6];

vec2 cm_steepest_own[3] = vec2[3](vec2(0.0), vec2(0.0), vec2(0.0));  // of levels 6, 7 and 8, of this invocation

void cm_put_steepest(uint level, vec2 steepest) {
  atomicMax(cm_steepest[level], floatBitsToUint(steepest.x));
  atomicMax(cm_steepest[CM_BRICK_LEVELS + level], floatBitsToUint(steepest.y));
}

void cm_visit(uint level, uint heap, uint frame, CmSums sums) {
  if (sums.low >= sums.high) return;
  CmCell cell = cm_cell_of(level, heap, frame, sums);
  float left = max(0.0, cell.variance - cm_fit_linear(cell.cell_class, cell.covariance, cell.mean).explained);
  vec2 steepest = vec2(cell.variance, left) * cm_edge_squared(level, cell.edge);
  // Collected per invocation first: atomics of all invocations on one address would be serialized.
  if (level == 8u) {
    cm_steepest_own[2] = max(cm_steepest_own[2], steepest);
  } else if (level == 7u) {
    cm_steepest_own[1] = max(cm_steepest_own[1], steepest);
  } else if (level == 6u) {
    cm_steepest_own[0] = max(cm_steepest_own[0], steepest);
  } else {
    cm_put_steepest(level, steepest);
  }
}
#else
shared float cm_values[512];  // of the brick
shared uint cm_most;          // maximum magnitude of the values, as bits
#endif

float cm_number(uint i) {
#if CM_FORMAT == 0
  return uintBitsToFloat(cm_packed[i]);
#elif CM_FORMAT == 1
  return unpackHalf2x16(cm_packed[i >> 1u] >> (16u * (i & 1u))).x;
#elif CM_FORMAT == 2
  return float(bitfieldExtract(cm_packed[i >> 1u], int(i & 1u) * 16, 16)) / 65535.0;
#else
  return float(bitfieldExtract(cm_packed[i >> 2u], int(i & 3u) * 8, 8)) / 255.0;
#endif
}

void cm_visit_cell(uint t, uint slot) {
  uint not_zero = 0u;
  for (uint z = 0u; z < 8u; ++z) {
    float value = cm_number(512u * slot + 8u * t + z);
    if ((floatBitsToUint(value) & 0x7f800000u) == 0x7f800000u) {
      cm_bad = CM_BRICK_NOT_FINITE;
      value = 0.0;
    } else if (abs(value) > 1e30) {  // volume::largest_value
      atomicAdd(cm_huge, 1u);
      value = 0.0;
    }
#if CM_FIELD > 0
    value = value > 0.0 ? value : 0.0;
#endif
    cm_values[8u * t + z] = value;
    if (value != 0.0) not_zero |= 1u << z;
  }
#if CM_HALVES
  for (uint w = 0u; w < 4u; ++w)
    cm_kept[256u * slot + 4u * t + w] = packHalf2x16(vec2(cm_values[8u * t + 2u * w], cm_values[8u * t + 2u * w + 1u]));
#else
  for (uint z = 0u; z < 8u; ++z) cm_kept[512u * slot + 8u * t + z] = floatBitsToUint(cm_values[8u * t + z]);
#endif
  if (not_zero == 0u) return;
  uint x = t >> 3u;
  uint y = t & 7u;
  atomicAdd(cm_count, uint(bitCount(not_zero)));
#if CM_CELLS
  atomicOr(cm_shadows[y >> 2u], not_zero << (8u * (y & 3u)));  // along x, bit 8 y + z
  for (uint z = 0u; z < 8u; ++z) {                             // along y, bit 8 z + x
    if (((not_zero >> z) & 1u) != 0u) atomicOr(cm_shadows[2u + (z >> 2u)], 1u << (8u * (z & 3u) + x));
  }
  atomicOr(cm_shadows[4u + (t >> 5u)], 1u << (t & 31u));  // along z, bit 8 x + y
#else
  for (uint z = 0u; z < 8u; ++z) atomicMax(cm_most, floatBitsToUint(abs(cm_values[8u * t + z])));
#endif
  atomicMin(cm_box[0], x);
  atomicMin(cm_box[1], y);
  atomicMin(cm_box[2], uint(findLSB(not_zero)));
  atomicMin(cm_box[3], 7u - x);
  atomicMin(cm_box[4], 7u - y);
  atomicMin(cm_box[5], 7u - uint(findMSB(not_zero)));
}

#if CM_CELLS
// Upper half of a float's bits, rounded up.
uint cm_upper_half(uint bits) { return min((bits >> 16) + ((bits & 0xffffu) != 0u ? 1u : 0u), 0x7f80u); }

void cm_put_cells(uint t, uint slot) {
  cm_find_reference();
  precise float block = 0.0;
  uvec3 low = 2u * uvec3(t / 16u, t / 4u % 4u, t % 4u);
  for (uint i = 0u; i < 8u; ++i)
    block += cm_values[(low.x + (i >> 2u)) * 64u + (low.y + ((i >> 1u) & 1u)) * 8u + low.z + (i & 1u)];
  cm_summaries[slot].blocks[t] = block;
  uint brick = cm_packed_bricks[slot];
  uvec3 odd = uvec3(brick % cm_bricks.x, brick / cm_bricks.x % cm_bricks.y, brick / (cm_bricks.x * cm_bricks.y)) & 1u;
  for (uint permutation = 0u; permutation < 6u; ++permutation) {
    // Cubes of such bricks begin at an even brick (grid::fit_cube).
    cm_sum_tree(cm_kuhn_frame(odd, permutation));
    if (t == 0u) {
      CmSums whole = cm_halves[1];
      cm_summaries[slot].cells[7u * permutation] = whole.mass;
      cm_summaries[slot].cells[7u * permutation + 1u] = whole.square;
      cm_summaries[slot].cells[7u * permutation + 2u] = whole.first.x;
      cm_summaries[slot].cells[7u * permutation + 3u] = whole.first.y;
      cm_summaries[slot].cells[7u * permutation + 4u] = whole.first.z;
      cm_summaries[slot].cells[7u * permutation + 5u] = whole.low;
      cm_summaries[slot].cells[7u * permutation + 6u] = whole.high;
    }
  }
  for (uint i = 0u; i < 3u; ++i) cm_put_steepest(6u + i, cm_steepest_own[i]);
  barrier();
  if (t < CM_BRICK_LEVELS) {
    cm_summaries[slot].steepest[t] =
        cm_upper_half(cm_steepest[CM_BRICK_LEVELS + t]) | (cm_upper_half(cm_steepest[t]) << 16);
  }
  if (t < 6u) cm_summaries[slot].shadows[t] = cm_shadows[t];
  if (t == 0u) cm_summaries[slot].reference = cm_reference;
}
#endif

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint slot = min(cm_range.x + work, cm_range.y - 1u);  // surplus groups repeat the last brick
  uint t = gl_LocalInvocationIndex;
  if (t < 6u) cm_box[t] = 7u;
  if (t == 0u) {
    cm_count = 0u;
    cm_bad = 0u;
    cm_huge = 0u;
  }
#if CM_CELLS
  if (t < 2u * CM_BRICK_LEVELS) cm_steepest[t] = 0u;
  if (t < 6u) cm_shadows[t] = 0u;
  cm_lit[t] = 1.0;
#else
  if (t == 0u) cm_most = 0u;
#endif
  barrier();
  cm_visit_cell(t, slot);
  barrier();
#if CM_CELLS
  cm_put_cells(t, slot);
#else
  if (t < 6u) cm_summaries[slot].cells[7u * t + 6u] = uintBitsToFloat(cm_most);
#endif
  if (t == 0u) {
    cm_summaries[slot].box = cm_box[0] | (cm_box[1] << 3) | (cm_box[2] << 6) | ((7u - cm_box[3]) << 9) |
                             ((7u - cm_box[4]) << 12) | ((7u - cm_box[5]) << 15);
    cm_summaries[slot].voxels = cm_count | (cm_huge << CM_BRICK_HUGE_SHIFT) | cm_bad;
  }
}
