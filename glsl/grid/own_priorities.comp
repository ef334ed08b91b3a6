#version 450
// Computes the priorities that a brick's own cells give to the vertices at which they split, like grid::OwnPriorities,
// for bricks without voxels in main memory: one work group per brick. The maximum with the priorities of other fields
// is kept. CM_CRITERION: values of grid::Criterion. It is a variant, because zink of Mesa 22.3 keeps the first outcome
// of branches that depend only on uniforms.
// variants: CM_HALVES=0,1 CM_CRITERION=0,1,2
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/cell_fit.glsl"
#include "grid/brick_summary.glsl"
#include "grid/lattice.glsl"

layout(std430, binding = CM_STORAGE_GRID_NODES) readonly buffer CmNodes { uint cm_nodes[]; };  // three words per node
layout(std430, binding = CM_STORAGE_GRID_OWN) buffer CmOwn { uint cm_own[]; };                 // two values per word
layout(std430, binding = CM_STORAGE_GRID_BRICKS) readonly buffer CmBricks { uint cm_bricks[]; };
layout(std430, binding = CM_STORAGE_BRICKS_TO_RATE) readonly buffer CmToRate { uvec2 cm_to_rate[]; };  // node, brick
layout(std430, binding = CM_STORAGE_BRICKS_LIT) readonly buffer CmBricksLit { float cm_bricks_lit[]; };
layout(location = 0) uniform uvec2 cm_range;       // entries of cm_to_rate: first, and one past the last
layout(location = 1) uniform uint cm_first_node;   // node of the first entry
layout(location = 2) uniform vec3 cm_measure;      // like grid::Measure: scale, own reduced extinction, floor
layout(location = 3) uniform bool cm_linear;       // cells have linear density
layout(location = 4) uniform float cm_back;        // 1: two-way transmittance, 0: one-way

#include "grid/brick_sums.glsl"

shared uint cm_found[CM_BRICK_POINTS];
shared uint cm_points;  // number of points that may split

const uint cm_points_of_levels[10] = uint[10](CM_POINTS_OF_LEVELS);

layout(std140, binding = CM_UNIFORM_POINT_INDICES) uniform CmPointIndices {
  uvec4 cm_point_indices[183];  // 9^3 points, four per uvec4: their index in brick_points()
};

float cm_squared(CmCell cell, CmSums sums, float edge_squared) {
#if CM_CRITERION == 1
  precise float ratio = (sums.high - sums.low) / cell.mean;
  return ratio * ratio;
#else
  precise float own = 1.0 + cm_measure.y * cell.mean * sqrt(edge_squared);
  precise float once = sums.lit * sums.lit;
  precise float twice = once * sums.lit * sums.lit;
  precise float seen = once * (1.0 - cm_back) + twice * cm_back;
  precise float weight = edge_squared * cm_measure.x * seen / (own * own);
  precise float value = cell.variance * weight;
  if (value <= cm_measure.z || !cm_linear) return value;
  float explained = cm_fit_linear(cell.cell_class, cell.covariance, cell.mean).explained;
  precise float left = max(0.0, cell.variance - explained) * weight;
  return left;
#endif
}

void cm_visit(uint level, uint heap, uint frame, CmSums sums) {
  if (sums.low >= sums.high) return;
  CmCell cell = cm_cell_of(level, heap, frame, sums);
  float squared = cm_squared(cell, sums, cm_edge_squared(level, cell.edge));
  if (!(squared > cm_measure.z)) return;
  uvec3 p = uvec3(cell.midpoint + 0.5);
  uint at = (p.x * 9u + p.y) * 9u + p.z;
  uint index = cm_point_indices[at >> 2u][at & 3u];
  if (index < cm_points) atomicMax(cm_found[index], max(floatBitsToUint(squared) >> 16, 1u));
}

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint i = min(cm_range.x + work, cm_range.y - 1u);
  uint t = gl_LocalInvocationIndex;
  uvec2 rate = cm_to_rate[i];
  uint n = 3u * (cm_first_node + rate.x);
  uvec3 node = uvec3(cm_nodes[n], cm_nodes[n + 1u], cm_nodes[n + 2u]);
  for (uint k = t; k < CM_BRICK_POINTS; k += 64u) cm_found[k] = 0u;
  if (t == 0u) cm_points = cm_points_of_levels[cm_node_levels(node)];
  for (uint z = 0u; z < 8u; ++z) {
    uint v = 512u * rate.y + 8u * t + z;
#if CM_HALVES
    cm_values[8u * t + z] = unpackHalf2x16(cm_bricks[v / 2u] >> (16u * (v & 1u))).x;
#else
    cm_values[8u * t + z] = uintBitsToFloat(cm_bricks[v]);
#endif
  }
#if CM_CRITERION == 2
  cm_lit[t] = cm_bricks_lit[64u * rate.x + t];
#else
  cm_lit[t] = 1.0;
#endif
  barrier();
  cm_find_reference();
  uvec3 odd = uvec3(cm_node_corner(node) >> 3) & 1u;
  for (uint permutation = 0u; permutation < 6u; ++permutation) cm_sum_tree(cm_kuhn_frame(odd, permutation));
  barrier();
  // The first value of a node has an even index.
  for (uint k = t; k < (cm_points + 1u) / 2u; k += 64u) {
    uint high = 2u * k + 1u < cm_points ? cm_found[2u * k + 1u] : 0u;
    uint there = cm_own[node.z / 2u + k];
    cm_own[node.z / 2u + k] = max(cm_found[2u * k], there & 0xffffu) | (max(high, there >> 16) << 16);
  }
}
