#version 450
// Packs the nonempty bricks of a host's voxels one after another: one work group per brick, one invocation per eight
// voxels along z. Values keep their bits.
// variants: CM_BUFFER=0,1
// variants: CM_CHOSEN=0,1
layout(local_size_x = 64) in;
#include "common/bindings.glsl"

const int CM_FLOATS = 0;  // values of render::VoxelFormat
const int CM_HALVES = 1;
const int CM_SHORTS = 2;
const int CM_BYTES = 3;

layout(std430, binding = CM_STORAGE_PACKED_BRICKS) buffer CmPackedBricks {
  uint cm_filled;
  uint cm_emptied;
  uint cm_packed_bricks[];  // filled bricks from the beginning, empty ones from the end
};
layout(std430, binding = CM_STORAGE_PACKED_VALUES) writeonly buffer CmValues { uint cm_values[]; };
#if CM_CHOSEN
layout(std430, binding = CM_STORAGE_PACKED_CHOICE) readonly buffer CmChoice { uint cm_choice[]; };
#endif
layout(location = 0) uniform ivec3 cm_size;    // in voxels
layout(location = 1) uniform uvec2 cm_bricks;  // first brick, number of bricks
layout(location = 2) uniform int cm_format;
#if CM_BUFFER
layout(std430, binding = CM_STORAGE_HOST_VOXELS) readonly buffer CmHostVoxels { uint cm_words[]; };
layout(location = 3) uniform uvec4 cm_strides;  // of x, y and z, and the index of the first voxel, in values
#else
layout(binding = CM_UNIT_HOST_VOXELS) uniform sampler3D cm_voxels;
layout(location = 3) uniform int cm_component;
#endif

shared uint cm_any;
shared uint cm_slot;

// Bits of a voxel's value.
uint cm_voxel(ivec3 p) {
  if (any(greaterThanEqual(p, cm_size))) return 0u;
#if CM_BUFFER
  uint n = cm_strides.w + cm_strides.x * uint(p.x) + cm_strides.y * uint(p.y) + cm_strides.z * uint(p.z);
  if (cm_format == CM_FLOATS) return cm_words[n];
  if (cm_format == CM_BYTES) return bitfieldExtract(cm_words[n >> 2u], int(n & 3u) * 8, 8);
  return bitfieldExtract(cm_words[n >> 1u], int(n & 1u) * 16, 16);
#else
  float v = texelFetch(cm_voxels, p, 0)[cm_component];
  if (cm_format == CM_FLOATS) return floatBitsToUint(v);
  if (cm_format == CM_HALVES) return packHalf2x16(vec2(v, 0.0)) & 0xffffu;
  return uint(v * (cm_format == CM_SHORTS ? 65535.0 : 255.0) + 0.5);
#endif
}

void main() {
  uint work = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  bool inside = work < cm_bricks.y;
  uint brick = cm_bricks.x + work;
#if CM_CHOSEN
  if (inside) brick = cm_choice[brick];
#endif
  uvec3 count = uvec3(cm_size + 7) / 8u;
  uint t = gl_LocalInvocationIndex;
  ivec3 low = 8 * ivec3(brick % count.x, brick / count.x % count.y, brick / (count.x * count.y));
  low.xy += ivec2(t >> 3u, t & 7u);

  uint bits = cm_format == CM_FLOATS ? 32u : cm_format == CM_BYTES ? 8u : 16u;
  uint magnitude = cm_format == CM_FLOATS ? 0x7fffffffu : cm_format == CM_HALVES ? 0x7fffu : 0xffffu;
  uint words[8] = uint[8](0u, 0u, 0u, 0u, 0u, 0u, 0u, 0u);
  uint seen = 0u;
  if (inside) {
    for (uint z = 0u; z < 8u; ++z) {
      uint voxel = cm_voxel(low + ivec3(0, 0, int(z)));
      seen |= voxel & magnitude;
      uint at = z * bits;
      words[at >> 5u] |= voxel << (at & 31u);
    }
  }
  if (t == 0u) cm_any = 0u;
  barrier();
  if (seen != 0u) atomicOr(cm_any, 1u);
  barrier();
  bool filled = cm_any != 0u;
  if (t == 0u && inside) {
    if (filled) {
      cm_slot = atomicAdd(cm_filled, 1u);
      cm_packed_bricks[cm_slot] = brick;
    }
#if CM_CHOSEN
    else cm_packed_bricks[cm_bricks.y - 1u - atomicAdd(cm_emptied, 1u)] = brick;
#endif
  }
  barrier();
  if (!inside || !filled) return;
  uint each = bits >> 2u;
  uint first = (cm_slot * 64u + t) * each;
  for (uint w = 0u; w < each; ++w) cm_values[first + w] = words[w];
}
