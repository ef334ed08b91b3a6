#version 450
// One lane a pixel of some blocks of the tile, 128 by 8 pixels each: loads its path, runs it for a bounded number of
// rounds, stores it.
// variants: CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=1..8 or CM_MARCH=1,2 CM_LINEAR=0 CM_PAGES=1
// variants: - or CM_LAYERS=1 or CM_SURFACES=1,2
// variants: - or CM_AOVS=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared.glsl"
#include "parameters.glsl"
#include "cell.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "buffers.glsl"
#if CM_MARCH == 0
#include "march_tet.glsl"
#else
#include "march_voxel.glsl"
#endif
#if CM_SURFACES
#include "bsdf.glsl"
#include "surface.glsl"
#endif
#include "path.glsl"

layout(std430, binding = 0) buffer CmPaths { uvec4 cm_paths[]; };  // 8 planes of one word-quad a lane; 9 with surfaces
layout(std430, binding = 1) buffer CmBlocks {
  uvec4 cm_total;     // x: full rounds that lanes marched
  uvec4 cm_blocks[];  // x: which block, and CM_BEGINS; then its pixels without their target samples, those without any
                      // and its samples finished in this dispatch
};
layout(rgba32f, binding = 0) uniform image2D cm_sum;
layout(rgba32ui, binding = 1) uniform uimage2D cm_counts;  // samples, steps, sum of squared luminance (a float)
#if CM_AOVS
layout(rgba32f, binding = 2) uniform image2D cm_volume_sum;  // of the samples that met the volume first
#endif

#define CM_BLOCK_WIDTH 128u
#define CM_BEGINS 0x80000000u  // a pass

uvec4 cm_pack(vec3 v, uint w) { return uvec4(floatBitsToUint(v), w); }

void main() {
  uint block = cm_blocks[gl_WorkGroupID.y].x & ~CM_BEGINS;
  uint across = (cm.dispatch.tile_size.x + CM_BLOCK_WIDTH - 1u) / CM_BLOCK_WIDTH;
  uvec2 corner = uvec2(block % across * CM_BLOCK_WIDTH, block / across * gl_WorkGroupSize.y);
  uvec2 local = corner + uvec2(gl_GlobalInvocationID.x, gl_LocalInvocationID.y);
  if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.tile_size.y) return;
  uint lanes = cm.dispatch.tile_size.x * cm.dispatch.tile_size.y;
  uint lane = local.y * cm.dispatch.tile_size.x + local.x;
  uvec2 pixel = cm.dispatch.tile_corner + local;
  ivec2 texel = ivec2(pixel);

  CmPath p;
  uvec4 counts = imageLoad(cm_counts, texel);
  p.square = uintBitsToFloat(counts.z);
#if CM_AOVS
  p.volume = imageLoad(cm_volume_sum, texel);
  p.in_volume = 0u;
#endif
  if ((cm_blocks[gl_WorkGroupID.y].x & CM_BEGINS) != 0u) {
    // Every pixel goes on from the samples it has.
    p.samples = counts.x;
    p.steps = counts.y;
    p.mode = p.samples >= cm.dispatch.samples ? CM_MODE_DONE : CM_MODE_START;
    p.o = vec3(0.0);
    p.t = 0.0;
    p.d = vec3(0.0);
    p.depth = 0.0;
    p.w = vec3(0.0);
    p.depth_0 = 0.0;
    p.throughput = vec3(0.0);
    p.radiance = vec3(0.0);
    p.bounce = 0u;
    p.light = vec3(0.0);
    p.random = 0u;
    p.cell = uvec3(0u);
    p.t_end = 0.0;
    p.stream = 0u;
    p.home = uvec2(0u);
#if CM_SURFACES
    p.triangle = 0u;
    p.weights = vec2(0.0);
    p.behind = 0u;
    p.reach = 0.0;
#endif
  } else {
    uvec4 a3 = cm_paths[3u * lanes + lane];
    p.mode = a3.w & 0xffu;
#if CM_AOVS
    p.in_volume = a3.w >> 8 & 1u;
#endif
    if (p.mode == CM_MODE_DONE) return;
    uvec4 a0 = cm_paths[lane];
    uvec4 a1 = cm_paths[lanes + lane];
    uvec4 a2 = cm_paths[2u * lanes + lane];
    uvec4 a4 = cm_paths[4u * lanes + lane];
    uvec4 a5 = cm_paths[5u * lanes + lane];
    uvec4 a6 = cm_paths[6u * lanes + lane];
    uvec4 a7 = cm_paths[7u * lanes + lane];
    p.o = uintBitsToFloat(a0.xyz);
    p.t = uintBitsToFloat(a0.w);
    p.d = uintBitsToFloat(a1.xyz);
    p.depth = uintBitsToFloat(a1.w);
    p.w = uintBitsToFloat(a2.xyz);
    p.depth_0 = uintBitsToFloat(a2.w);
    p.throughput = uintBitsToFloat(a3.xyz);
    p.radiance = uintBitsToFloat(a4.xyz);
    p.bounce = a4.w;
    p.light = uintBitsToFloat(a5.xyz);
    p.random = a5.w;
    p.cell = uvec3(a6.xy, CM_NONE);
    p.t_end = uintBitsToFloat(a6.z);
    p.stream = a6.w;
    p.home = a7.xy;
    p.samples = a7.z;
    p.steps = a7.w;
#if CM_SURFACES
    uvec4 a8 = cm_paths[8u * lanes + lane];
    p.triangle = a8.x;
    p.weights = uintBitsToFloat(a8.yz);
    p.behind = a3.w >> 9;
    p.reach = uintBitsToFloat(a8.w);
#endif
  }

  uint samples = p.samples;
  p.marches = 0u;
  vec4 sum = imageLoad(cm_sum, texel);
  cm_run(p, pixel, cm.dispatch.rounds, sum);
  imageStore(cm_sum, texel, sum);
  uint mode = p.mode;
#if CM_AOVS
  imageStore(cm_volume_sum, texel, p.volume);
  mode |= p.in_volume << 8;
#endif
#if CM_SURFACES
  mode |= p.behind << 9;
#endif
  imageStore(cm_counts, texel, uvec4(p.samples, p.steps, floatBitsToUint(p.square), 0u));

  cm_paths[lane] = cm_pack(p.o, floatBitsToUint(p.t));
  cm_paths[lanes + lane] = cm_pack(p.d, floatBitsToUint(p.depth));
  cm_paths[2u * lanes + lane] = cm_pack(p.w, floatBitsToUint(p.depth_0));
  cm_paths[3u * lanes + lane] = cm_pack(p.throughput, mode);
  cm_paths[4u * lanes + lane] = cm_pack(p.radiance, p.bounce);
  cm_paths[5u * lanes + lane] = cm_pack(p.light, p.random);
  cm_paths[6u * lanes + lane] = uvec4(p.cell.xy, floatBitsToUint(p.t_end), p.stream);
  cm_paths[7u * lanes + lane] = uvec4(p.home, p.samples, p.steps);
#if CM_SURFACES
  cm_paths[8u * lanes + lane] = uvec4(p.triangle, floatBitsToUint(p.weights), floatBitsToUint(p.reach));
#endif
  if (p.mode != CM_MODE_DONE) atomicAdd(cm_blocks[gl_WorkGroupID.y].y, 1u);
  if (p.samples == 0u) atomicAdd(cm_blocks[gl_WorkGroupID.y].z, 1u);
  if (p.samples != samples) atomicAdd(cm_blocks[gl_WorkGroupID.y].w, p.samples - samples);
  if (p.marches != 0u) atomicAdd(cm_total.x, (p.marches + CM_EVENTS - 1u) / CM_EVENTS);
}
