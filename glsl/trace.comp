#version 450
// One lane a pixel of some blocks of the tile, 128 by 8 pixels each: loads its path, runs it for a bounded number of
// rounds, stores it.
// variants: CM_MARCH=0 CM_LINEAR=0,1 CM_PAGES=1..8 or CM_MARCH=1,2 CM_LINEAR=0 CM_PAGES=1
// variants: - or CM_LAYERS=1 or CM_SURFACES=1,2
// variants: - or CM_AOVS=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "bindings.glsl"
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
#define CM_BVH_SHARED_STACK 64u
#include "bsdf.glsl"
#include "surface.glsl"
#endif
#include "path.glsl"

layout(std430, binding = CM_STORAGE_PATHS) buffer CmPaths { uint cm_paths[]; };  // a plane of lanes for each word of a path
layout(std430, binding = CM_STORAGE_BLOCKS) buffer CmBlocks {
  uvec4 cm_total;     // x: full rounds that lanes marched
  uvec4 cm_blocks[];  // x: which block, and CM_BEGINS; then its pixels without their target samples, those without any
                      // and its samples finished in this dispatch
};
layout(rgba32f, binding = CM_IMAGE_SUM) uniform image2D cm_sum;
layout(rg32ui, binding = CM_IMAGE_COUNTS) uniform uimage2D cm_counts;          // samples, steps
layout(rgba32f, binding = CM_IMAGE_BACKGROUND) uniform image2D cm_background;  // and the mean of squared luminance
#if CM_AOVS
layout(rgba32f, binding = CM_IMAGE_VOLUME_SUM) uniform image2D cm_volume_sum;  // of the samples that met the volume first
#endif

#define CM_BLOCK_WIDTH 128u
#define CM_BEGINS 0x80000000u  // a pass

#define CM_ZERO_VEC3(name) p.name = vec3(0.0);
#define CM_ZERO_VEC2(name) p.name = vec2(0.0);
#define CM_ZERO_UVEC2(name) p.name = uvec2(0u);
#define CM_ZERO_FLOAT(name) p.name = 0.0;
#define CM_ZERO_UINT(name) p.name = 0u;

#define CM_WORD(i) cm_paths[at + i * lanes]
#define CM_LOAD_VEC3(name) p.name = uintBitsToFloat(uvec3(CM_WORD(0u), CM_WORD(1u), CM_WORD(2u))); at += 3u * lanes;
#define CM_LOAD_VEC2(name) p.name = uintBitsToFloat(uvec2(CM_WORD(0u), CM_WORD(1u))); at += 2u * lanes;
#define CM_LOAD_UVEC2(name) p.name = uvec2(CM_WORD(0u), CM_WORD(1u)); at += 2u * lanes;
#define CM_LOAD_FLOAT(name) p.name = uintBitsToFloat(CM_WORD(0u)); at += lanes;
#define CM_LOAD_UINT(name) p.name = CM_WORD(0u); at += lanes;

#define CM_STORE_UINT(name) CM_WORD(0u) = p.name; at += lanes;
#define CM_STORE_FLOAT(name) CM_WORD(0u) = floatBitsToUint(p.name); at += lanes;
#define CM_STORE_UVEC2(name) CM_STORE_UINT(name.x) CM_STORE_UINT(name.y)
#define CM_STORE_VEC2(name) CM_STORE_FLOAT(name.x) CM_STORE_FLOAT(name.y)
#define CM_STORE_VEC3(name) CM_STORE_VEC2(name) CM_STORE_FLOAT(name.z)

CmPath cm_begin_path() {
  CmPath p;
  CM_PATH_FIELDS(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT)
  CM_PATH_TRIANGLE_FIELDS(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT)
  p.stage = CM_STAGE_CAMERA;
  return p;
}

CmPath cm_load_path(uint at, uint lanes) {
  CmPath p = cm_begin_path();
  CM_PATH_FIELDS(CM_LOAD_VEC3, CM_LOAD_VEC2, CM_LOAD_UVEC2, CM_LOAD_FLOAT, CM_LOAD_UINT)
#if CM_SURFACES
  CM_PATH_TRIANGLE_FIELDS(CM_LOAD_VEC3, CM_LOAD_VEC2, CM_LOAD_UVEC2, CM_LOAD_FLOAT, CM_LOAD_UINT)
#endif
  return p;
}

void cm_store_path(CmPath p, uint at, uint lanes) {
  CM_PATH_FIELDS(CM_STORE_VEC3, CM_STORE_VEC2, CM_STORE_UVEC2, CM_STORE_FLOAT, CM_STORE_UINT)
#if CM_SURFACES
  CM_PATH_TRIANGLE_FIELDS(CM_STORE_VEC3, CM_STORE_VEC2, CM_STORE_UVEC2, CM_STORE_FLOAT, CM_STORE_UINT)
#endif
}

CmPixel cm_load_pixel(ivec2 texel) {
  uvec4 counts = imageLoad(cm_counts, texel);
  vec4 means = imageLoad(cm_background, texel);
  CmPixel pixel;
  pixel.sum = imageLoad(cm_sum, texel);
  pixel.volume = vec4(0.0);
#if CM_AOVS
  pixel.volume = imageLoad(cm_volume_sum, texel);
#endif
  pixel.background = means.rgb;
  pixel.square = means.w;
  pixel.samples = counts.x;
  pixel.steps = counts.y;
  pixel.marches = 0u;
  return pixel;
}

void cm_store_pixel(CmPixel pixel, ivec2 texel) {
  imageStore(cm_sum, texel, pixel.sum);
#if CM_AOVS
  imageStore(cm_volume_sum, texel, pixel.volume);
#endif
  imageStore(cm_background, texel, vec4(pixel.background, pixel.square));
  imageStore(cm_counts, texel, uvec4(pixel.samples, pixel.steps, 0u, 0u));
}

void main() {
  uint block = cm_blocks[gl_WorkGroupID.y].x & ~CM_BEGINS;
  uint across = (cm.dispatch.tile_size.x + CM_BLOCK_WIDTH - 1u) / CM_BLOCK_WIDTH;
  uvec2 corner = uvec2(block % across * CM_BLOCK_WIDTH, block / across * gl_WorkGroupSize.y);
  uvec2 local = corner + uvec2(gl_GlobalInvocationID.x, gl_LocalInvocationID.y);
  if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.tile_size.y) return;
  uint lanes = cm.dispatch.tile_size.x * cm.dispatch.tile_size.y;
  uint lane = local.y * cm.dispatch.tile_size.x + local.x;
  uvec2 at = cm.dispatch.tile_corner + local;

  CmPixel pixel = cm_load_pixel(ivec2(at));
  if (pixel.samples >= cm.dispatch.samples) return;
  // When a pass begins, every pixel goes on from the samples it has.
  bool begins = (cm_blocks[gl_WorkGroupID.y].x & CM_BEGINS) != 0u;
  CmPath p = cm_begin_path();
  if (!begins) p = cm_load_path(lane, lanes);
  uint samples = pixel.samples;
  cm_run(p, pixel, at, cm.dispatch.rounds);
  cm_store_pixel(pixel, ivec2(at));
  cm_store_path(p, lane, lanes);
  if (p.stage != CM_STAGE_DONE) atomicAdd(cm_blocks[gl_WorkGroupID.y].y, 1u);
  if (pixel.samples == 0u) atomicAdd(cm_blocks[gl_WorkGroupID.y].z, 1u);
  if (pixel.samples != samples) atomicAdd(cm_blocks[gl_WorkGroupID.y].w, pixel.samples - samples);
  if (pixel.marches != 0u) atomicAdd(cm_total.x, (pixel.marches + CM_EVENTS - 1u) / CM_EVENTS);
}
