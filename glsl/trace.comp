#version 450
// One lane a pixel of some rows of the tile: loads its path, runs it for a bounded number of steps, stores it.
// variant: CM_MARCH=0 CM_LINEAR=0 CM_PAGES=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=8
// variant: CM_MARCH=1 CM_LINEAR=0 CM_PAGES=1
// variant: CM_MARCH=2 CM_LINEAR=0 CM_PAGES=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=1 CM_SURFACES=1
// variant: CM_MARCH=2 CM_LINEAR=0 CM_PAGES=1 CM_SURFACES=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=8 CM_SURFACES=1 CM_AOVS=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=8 CM_LAYERS=1
// variant: CM_MARCH=1 CM_LINEAR=0 CM_PAGES=1 CM_LAYERS=1 CM_AOVS=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=1 CM_SURFACES=2
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
layout(std430, binding = 1) buffer CmCounter {
  uint cm_unfinished;  // pixels without their target samples
  uint cm_empty;       // of these, pixels without any
  uint cm_finished;    // samples finished in this dispatch
};
layout(rgba32f, binding = 0) uniform image2D cm_sum;
layout(rgba32ui, binding = 1) uniform uimage2D cm_counts;  // samples, steps, sum of squared luminance (a float)
#if CM_AOVS
layout(rgba32f, binding = 2) uniform image2D cm_volume_sum;  // of the samples that met the volume first
#endif

uvec4 cm_pack(vec3 v, uint w) { return uvec4(floatBitsToUint(v), w); }

void main() {
  // Rows are dealt out far apart: a driver that gives each core a run of work groups then gives each its share of the
  // costly ones.
  uint row = gl_WorkGroupID.y * cm.order.x % gl_NumWorkGroups.y;
  uvec2 local = uvec2(gl_GlobalInvocationID.x, cm.order.z + row * gl_WorkGroupSize.y + gl_LocalInvocationID.y);
  if (local.x >= cm.tile.z || local.y >= cm.order.w) return;
  uint lanes = cm.tile.z * cm.tile.w;
  uint lane = local.y * cm.tile.z + local.x;
  uvec2 pixel = cm.tile.xy + local;
  ivec2 texel = ivec2(pixel);

  CmPath p;
  uvec4 counts = imageLoad(cm_counts, texel);
  p.square = uintBitsToFloat(counts.z);
#if CM_AOVS
  p.volume = imageLoad(cm_volume_sum, texel);
  p.in_volume = 0u;
#endif
  if (cm.march.w != 0u) {
    // A pass begins: every pixel goes on from the samples it has.
    p.samples = counts.x;
    p.steps = counts.y;
    p.mode = p.samples >= cm.image.w ? CM_MODE_DONE : CM_MODE_START;
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
    p.reach = 0.0;
#endif
  } else {
    uvec4 a3 = cm_paths[3u * lanes + lane];
    p.mode = a3.w & 0xffu;
#if CM_AOVS
    p.in_volume = a3.w >> 8;
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
    p.reach = uintBitsToFloat(a8.w);
#endif
  }

  uint samples = p.samples;
  vec4 sum = imageLoad(cm_sum, texel);
  cm_run(p, pixel, cm.march.x, sum);
  imageStore(cm_sum, texel, sum);
#if CM_AOVS
  imageStore(cm_volume_sum, texel, p.volume);
  uint mode = p.mode | (p.in_volume << 8);
#else
  uint mode = p.mode;
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
  if (p.mode != CM_MODE_DONE) atomicAdd(cm_unfinished, 1u);
  if (p.samples == 0u) atomicAdd(cm_empty, 1u);
  if (p.samples != samples) atomicAdd(cm_finished, p.samples - samples);
}
