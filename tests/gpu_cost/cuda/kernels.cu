// Kernels over the shaders' shared files, for the costs on NVIDIA's GPUs (tests/gpu_cost/README.md). They are only
// compiled. Each is as the stage of trace.comp for one volume of cells without channels or shadow catcher, but paths and
// pixels are structs in global memory.
#include "glsl.cuh"

namespace cumulet::core {

#define CM_MARCH 0
#define CM_PAGES 1
#define CM_KEEPS_ENTRY 1
#define CM_SHADOW_CATCHER 0
#include "common/bindings.glsl"
#include "common/parameters.glsl"
__constant__ CmParameters cm;
#include "traversal/current_volume.glsl"

#include "grid/cell.glsl"
#include "path/phase.glsl"
#include "common/random.glsl"

__constant__ cudaTextureObject_t cm_cells;
__constant__ cudaTextureObject_t cm_tree_words;
__constant__ cudaTextureObject_t cm_surface;

CM_FN uvec4 cm_fetch(cudaTextureObject_t words, int texel) {
  const uint4 quad = tex1Dfetch<uint4>(words, texel);
  return uvec4(quad.x, quad.y, quad.z, quad.w);
}
CM_FN uvec4 cm_record(uint cell, uint part) { return cm_fetch(cm_cells, int((CM_GRID.first_cell + cell) * 2u + part)); }
CM_FN uint cm_tree_word(uint word) { return cm_link(cm_fetch(cm_tree_words, int(word >> 2)), word & 3u); }
CM_FN uint cm_tree(uint node) { return cm_tree_word(CM_GRID.tree + node); }
CM_FN uint cm_root_leaf(uint root) { return cm_tree_word(CM_GRID.tree - 52u + 2u * root); }
CM_FN uint cm_root_node(uint root) { return cm_tree_word(CM_GRID.tree - 51u + 2u * root); }
CM_FN float cm_surface_z(uvec2 pixel, vec2 within, uint layer) {
  if (cm.host_depth.layers == 0u) return 3.0e38f;
  const vec2 at = (vec2(pixel) + within) * vec2(cm.host_depth.size) / vec2(cm.view.size);
  return tex2DLayered<float>(cm_surface, at.x, at.y, int(layer % cm.host_depth.layers));
}

#include "traversal/march.glsl"
#include "path/path_state.glsl"

__device__ CmPath* cm_lane_paths;
__device__ CmPixel* cm_pixels;
__device__ uint cm_next_slot;

__device__ uint* cm_words;

CM_FN uint cm_kept_cell(uint slot) { return cm_words[slot] - 1u; }
CM_FN void cm_keep_cell(uint slot, uint cell) { cm_words[slot] = cell + 1u; }
CM_FN uvec2 cm_pixel_of(uint slot) { return uvec2(slot % cm.view.size.x, slot / cm.view.size.x); }
CM_FN CmPixel cm_load_pixel(uvec2 at) { return cm_pixels[at.y * cm.view.size.x + at.x]; }
CM_FN void cm_store_pixel(CmPixel pixel, uvec2 at) { cm_pixels[at.y * cm.view.size.x + at.x] = pixel; }
CM_FN void cm_take_next_slot(CmPath& p, uint& samples) {
  p.slot = atomicAdd(&cm_next_slot, 1u);
  p.stage = p.slot < cm.dispatch.slots ? CM_STAGE_CAMERA : CM_STAGE_DONE;
  samples = 0u;
}
#include "path/run.glsl"

// As in trace.comp: constants for the fields that only triangles use.
CM_FN void cm_forget_triangles(CmPath& p) {
  p.reach = 0.0f;
  p.triangle = 0u;
  p.weights = vec2(0.0f);
  p.behind = 0u;
  p.back = 0u;
  p.lifted = 0u;
  p.found = CM_FOUND_NOT_ASKED;
}
CM_FN CmPath cm_load_path() {
  CmPath p = cm_lane_paths[blockIdx.x * 64u + threadIdx.x];
  cm_forget_triangles(p);
  return p;
}
CM_FN void cm_store_path(CmPath& p) {
  cm_forget_triangles(p);
  cm_lane_paths[blockIdx.x * 64u + threadIdx.x] = p;
}

// Everything.
extern "C" __global__ void __launch_bounds__(64) cm_cost_trace() {
  CmPath p = cm_load_path();
  uint samples = cm_load_pixel(cm_pixel_of(p.slot)).samples;
  cm_run(p, samples, cm.dispatch.rounds);
  cm_store_path(p);
}

// Only the traversal: its loop is the step.
extern "C" __global__ void __launch_bounds__(64) cm_cost_step(float4* rays, uint count) {
  const uint lane = blockIdx.x * 64u + threadIdx.x;
  const float4 a = rays[2u * lane];
  const float4 b = rays[2u * lane + 1u];
  const float extinction = CM_MEDIUM.extinction;
  float t = a.w;
  float depth = b.w;
  float used = 0.0f;
  uvec3 cell(__float_as_uint(b.x), 0u, CM_NONE);
  const CmMarchRay ray = cm_march_ray(vec3(a.x, a.y, a.z), vec3(b.x, b.y, b.z));
#pragma unroll 1
  for (uint i = 0u; i < count && used <= depth && cell.x != CM_NONE; ++i) {
    float t_1;
    CmBernstein r;
    uvec3 next;
    cm_march_step(cell, ray, t, t_1, r, next);
    used = extinction * (cm_segment_mean(r) * (t_1 - t));
    if (used <= depth) {
      depth -= used;
      t = t_1;
      cell = next;
    }
  }
  rays[2u * lane] = make_float4(t, depth, used, __uint_as_float(cell.x));
}

// An event, a camera ray with its entry cell, and only loading and storing a path.
extern "C" __global__ void __launch_bounds__(64) cm_cost_event() {
  CmPath p = cm_load_path();
  cm_handle(p, cm_in_medium());
  cm_store_path(p);
}
extern "C" __global__ void __launch_bounds__(64) cm_cost_camera() {
  CmPath p = cm_load_path();
  cm_camera(p, p.number, cm_pixel_of(p.slot));
  cm_aim(p);
  cm_store_path(p);
}
extern "C" __global__ void __launch_bounds__(64) cm_cost_store() {
  CmPath p = cm_load_path();
  p.bounces += 1u;
  cm_store_path(p);
}

// Two paths a lane, with the lists and counters of path_store.glsl.
#include "path/path_blocks.glsl"
#define shared __shared__
#define barrier __syncthreads
#define memoryBarrierBuffer __threadfence_block
#define gl_LocalInvocationIndex threadIdx.x
#define gl_WorkGroupID blockIdx
__device__ uint4 cm_total;
__device__ uint4 cm_running;
__device__ uint4 cm_blocks[CM_MAX_BLOCKS];
__device__ uint cm_active_counts[CM_LISTS * CM_MAX_BLOCKS];
__device__ uint* cm_slot_words;
__device__ uvec4* cm_paths;
CM_FN uint cm_atomic_add(uint& sum, uint value) { return ::atomicAdd(&sum, value); }
#define atomicAdd cm_atomic_add
CM_FN uint cm_lanes() { return cm.dispatch.lanes; }
CM_FN uint cm_block() { return bitfieldExtract(cm_blocks[blockIdx.y].x, 0, CM_LIST_BIT); }
CM_FN bool cm_block_begins() { return (cm_blocks[blockIdx.y].x & CM_BEGINS) != 0u; }
CM_FN uint cm_block_of(uint lane) { return lane / CM_BLOCK_LANES; }
CM_FN uint cm_list(uint ahead) {
  return (bitfieldExtract(cm_blocks[blockIdx.y].x, CM_LIST_BIT, 2) + ahead) % CM_LISTS;
}
CM_FN uint cm_list_at(uint list) { return cm.dispatch.slots + list * cm_lanes() + cm_block() * CM_BLOCK_LANES; }
CM_FN void cm_join_ranks(uint lane) {
  const uint rank = atomicAdd(cm_active_counts[cm_list(1u) * CM_MAX_BLOCKS + cm_block()], 1u);
  cm_slot_words[cm_list_at(cm_list(1u)) + rank] = lane;
}
CM_FN void cm_count_group() {
  if (threadIdx.x == 0u) atomicAdd(cm_running.z, 1u);
}
CM_FN CmPath cm_begin_path() {
  CmPath p = {};
  return p;
}
CM_FN CmPath cm_load_path(uint lane) { return cm_lane_paths[lane]; }
CM_FN void cm_store_path(const CmPath& p, uint lane) { cm_lane_paths[lane] = p; }
CM_FN uint cm_pixel_samples(uvec2 at) { return cm_load_pixel(at).samples; }
CM_FN void cm_take_slot(CmPath& p, uint slot, uint& samples) {
  p.slot = slot;
  p.stage = slot < cm.dispatch.slots ? CM_STAGE_CAMERA : CM_STAGE_DONE;
  samples = 0u;
}
#include "../../bench/two_paths/path/two_paths.glsl"
extern "C" __global__ void __launch_bounds__(32) cm_cost_two_paths() { cm_two_paths(); }

}  // namespace cumulet::core
