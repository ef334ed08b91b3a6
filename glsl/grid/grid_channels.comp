#version 450
// Computes the channels of a grid's cells beside density, one channel per variant, once the records exist; like
// src/grid/tet_grid.cpp. Emission also sets CM_RECORD_EMITS in the cells' records.
// variants: CM_CHANNEL=0,1,2,3 or CM_CHANNEL=0,1,2,3 CM_LINEAR=1
layout(local_size_x = 64) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "grid/cell.glsl"
#include "grid/cell_fit.glsl"
#include "grid/channels.glsl"
#include "grid/lattice.glsl"
#include "grid/grid_state.glsl"
#include "grid/lattice_lookup.glsl"
#include "grid/grid_leaves.glsl"
#include "grid/grid_parts.glsl"

#if CM_CHANNEL == CM_CHANNEL_EMISSION
#define CM_RECORD_WORDS 4u
#elif CM_CHANNEL == CM_CHANNEL_VELOCITY
#define CM_RECORD_WORDS 2u
#else
#define CM_RECORD_WORDS 1u
#endif

layout(std430, binding = CM_STORAGE_GRID_BRICKS) readonly buffer CmBricks { float cm_numbers[]; };  // grid::ChannelNumbers
layout(std430, binding = CM_STORAGE_GRID_COARSE) readonly buffer CmCoarse { uint cm_coarse[]; };
layout(std430, binding = CM_STORAGE_GRID_CHANNEL) buffer CmChannel { uint cm_channel[]; };  // CM_RECORD_WORDS each

// First word of the records of a cube's cells above bricks; 0: the cube has a single value.
uint cm_coarse_records(vec3 v0, uint shape, ivec3 voxel, out ivec3 corner) {
  uint size = cm_shape_cube_size(shape);
  corner = (voxel >> ivec3(int(size))) << ivec3(int(size));
  return cm_coarse_channel_words(CM_RECORD_WORDS) * cm_coarse_at(corner, size);
}

#if CM_CHANNEL == CM_CHANNEL_EMISSION

layout(std430, binding = CM_STORAGE_GRID_RECORDS) buffer CmRecords { uvec4 cm_records[]; };
layout(location = 3) uniform bool cm_linear;

vec3 cm_voxel(uint i) { return vec3(cm_numbers[3u * i], cm_numbers[3u * i + 1u], cm_numbers[3u * i + 2u]); }

uint cm_pack_slope(float slope, uint axis) {
  float part = 511.0 * clamp(slope / CM_EMISSION_STEEPEST, -1.0, 1.0);
  return (uint(int(part < 0.0 ? part - 0.5 : part + 0.5)) & 0x3ffu) << (10u * axis);
}

struct CmLight {
  uvec4 record;  // grid::EmissionRecord
  bool any;
};

CmLight cm_fine_light(vec3 v0, uint shape, ivec3 voxel) {
  uint first_value = CM_BRICK_VALUES * cm_brick_at(voxel);
  int begin = cm_value_at_v0(v0, shape, voxel);
  ivec3 steps = cm_value_steps(shape);
  uint level = cm_fine_level(shape);
  vec3 low = vec3(3e38);
  vec3 high = vec3(0.0);
  vec3 sum = vec3(0.0);
  mat3 moment = mat3(0.0);
  // No value is negative, so the sums have no cancellation.
  for (uint i = cm_first_part[level]; i < cm_first_part[level + 1u]; ++i) {
    uvec4 words = cm_parts[i];
    vec3 value = cm_voxel(first_value + uint(begin + cm_value_of_part(words.w, steps)));
    low = min(low, value);
    high = max(high, value);
    vec3 weighted = float(words.w >> 12) * value;
    sum += weighted;
    moment += outerProduct(uintBitsToFloat(words.xyz), weighted);
  }
  float inverse_count = 1.0 / float(cm_weights_of_level(level));
  vec3 mean = clamp(sum * inverse_count, low, high);
  vec3 slope = vec3(0.0);
  uint cell_class = cm_shape_class(shape);
  if (cm_linear) {
    if (low.x < high.x) slope += cm_fit_linear(cell_class, moment[0] * inverse_count, mean.x).gradient;
    if (low.y < high.y) slope += cm_fit_linear(cell_class, moment[1] * inverse_count, mean.y).gradient;
    if (low.z < high.z) slope += cm_fit_linear(cell_class, moment[2] * inverse_count, mean.z).gradient;
  }
  float all = mean.x + mean.y + mean.z;
  uint gradient = 0u;
  if (all > 0.0) {
    slope /= all;
    gradient = cm_pack_slope(slope.x, 0u) | cm_pack_slope(slope.y, 1u) | cm_pack_slope(slope.z, 2u);
  }
  return CmLight(uvec4(floatBitsToUint(mean), gradient), max(high.x, max(high.y, high.z)) > 0.0);
}

CmLight cm_light(vec3 v0, uint shape) {
  ivec3 voxel = cm_leaf_voxel(v0, shape);
  if (cm_is_fine(shape)) return cm_fine_light(v0, shape, voxel);
  ivec3 corner;
  uint coarse = cm_coarse_records(v0, shape, voxel, corner);
  if (coarse == 0u) {
    vec3 value = cm_voxel(CM_BRICK_VALUES * cm_brick_at(voxel));
    return CmLight(uvec4(floatBitsToUint(value), 0u), max(value.x, max(value.y, value.z)) > 0.0);
  }
  uint cell = cm_coarse_cell(v0, shape, vec3(corner));
  uint at = coarse + CM_RECORD_WORDS * cell;
  uint bits = cm_coarse[coarse + CM_RECORD_WORDS * CM_COARSE_CELLS + cell / 32u];
  return CmLight(uvec4(cm_coarse[at], cm_coarse[at + 1u], cm_coarse[at + 2u], cm_coarse[at + 3u]),
                 ((bits >> (cell % 32u)) & 1u) != 0u);
}

void cm_put(vec3 v0, uint shape, uint rank) {
  CmLight light = cm_light(v0, shape);
  for (uint i = 0u; i < 4u; ++i) cm_channel[4u * rank + i] = light.record[i];
  if (!light.any) return;
  cm_records[2u * rank + 1u].y |= CM_RECORD_EMITS;
  cm_put_in_box(v0, shape);
}

#else

layout(location = 3) uniform float cm_fastest;  // largest speed, voxels per second

// Value that a record averages, times its weight; w: the weight.
vec4 cm_voxel(uint i) {
#if CM_CHANNEL == CM_CHANNEL_ANISOTROPY
  return vec4(cm_numbers[2u * i], 0.0, 0.0, cm_numbers[2u * i + 1u]);
#else
  return vec4(cm_numbers[4u * i], cm_numbers[4u * i + 1u], cm_numbers[4u * i + 2u], cm_numbers[4u * i + 3u]);
#endif
}

vec4 cm_fine_sum(vec3 v0, uint shape, ivec3 voxel) {
  uint first_value = CM_BRICK_VALUES * cm_brick_at(voxel);
  int begin = cm_value_at_v0(v0, shape, voxel);
  ivec3 steps = cm_value_steps(shape);
  uint level = cm_fine_level(shape);
  vec4 sum = vec4(0.0);
  for (uint i = cm_first_part[level]; i < cm_first_part[level + 1u]; ++i) {
    uint word = cm_parts[i].w;
    sum += float(word >> 12) * cm_voxel(first_value + uint(begin + cm_value_of_part(word, steps)));
  }
  return sum;
}

uvec2 cm_pack_sum(vec4 sum) {
  if (!(sum.w > 0.0)) return uvec2(0u);
  vec3 mean = sum.xyz / sum.w;
#if CM_CHANNEL == CM_CHANNEL_COLOR
  uvec3 parts = uvec3(clamp(mean, 0.0, 1.0) * vec3(2047.0, 2047.0, 1023.0) + 0.5);
  return uvec2(parts.x | (parts.y << 11) | (parts.z << 22), 0u);
#elif CM_CHANNEL == CM_CHANNEL_ANISOTROPY
  float whole = 32767.0 * clamp(mean.x, -0.999, 0.999);
  return uvec2(uint(int(whole < 0.0 ? whole - 0.5 : whole + 0.5)) & 0xffffu, 0u);
#else
  mean = cm_fastest * clamp(mean, -1.0, 1.0);
  return uvec2(cm_half(mean.x) | (cm_half(mean.y) << 16), cm_half(mean.z));
#endif
}

// A leaf's record, of one or two words.
uvec2 cm_leaf_record(vec3 v0, uint shape) {
  ivec3 voxel = cm_leaf_voxel(v0, shape);
  if (cm_is_fine(shape)) return cm_pack_sum(cm_fine_sum(v0, shape, voxel));
  ivec3 corner;
  uint coarse = cm_coarse_records(v0, shape, voxel, corner);
  if (coarse == 0u) return cm_pack_sum(cm_voxel(CM_BRICK_VALUES * cm_brick_at(voxel)));
  uint at = coarse + CM_RECORD_WORDS * cm_coarse_cell(v0, shape, vec3(corner));
  return uvec2(cm_coarse[at], cm_coarse[at + CM_RECORD_WORDS - 1u]);
}

void cm_put(vec3 v0, uint shape, uint rank) {
  uvec2 record = cm_leaf_record(v0, shape);
#if CM_CHANNEL == CM_CHANNEL_COLOR
  cm_channel[rank] = record.x;
#elif CM_CHANNEL == CM_CHANNEL_ANISOTROPY
  atomicOr(cm_channel[rank / 2u], record.x << (16u * (rank & 1u)));  // the word belongs to two cells and starts at 0
#else
  cm_channel[2u * rank] = record.x;
  cm_channel[2u * rank + 1u] = record.y;
#endif
}

#endif

void main() {
  uint at = cm_first + gl_GlobalInvocationID.x;
  if (at >= cm_end) return;
  uint i = cm_list[at];
  uvec2 where = cm_cells[i].where;
  cm_put(cm_v0_of(where), cm_shape_of(where), cm_cells[i].rank);
}
