#version 450
// Cryptomatte (Friedman and Jones, "Fully automatic ID mattes with support for motion blur and transparency", SIGGRAPH
// 2015 posters; specification 1.2): the IDs visible in each pixel with their coverage. Coverage is the fraction of
// camera rays that end at the object: by their first scattering or absorption in a volume, or at a surface or the
// ground. It uses a fixed set of feature rays. cm.dispatch.samples is their number per pixel; earlier dispatches traced
// rays_before of them. Coverage along each ray is exact, for as many overlapping volumes as walk.glsl supports. A slice
// has two pairs of an ID, as a float's bits, and its coverage, in descending order of coverage. Nothing is written
// after a coverage of 0. Texels are relative to the tile. Objects without an ID (holdouts) occlude and write no
// coverage.
// variants: VOLUME or VOLUMES or VOLUMES CM_MOTION=1 or VOLUMES CM_CLIP=1 or VOLUMES CM_CLIP=1 CM_MOTION=1
// variants: - or CM_SURFACES=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "traversal/march.glsl"
#if CM_SURFACES
#define CM_BVH_SHARED_STACK 64u
#include "surface/surface.glsl"
#endif
#include "traversal/ray.glsl"
#include "traversal/walk.glsl"
#include "surface/ground.glsl"
#include "features/feature_ray.glsl"

layout(rgba32f, binding = CM_IMAGE_MATTES) uniform image2DArray cm_mattes;

// IDs, 0 for none: of the ground, of each volume, and of each record of models.
layout(std430, binding = CM_STORAGE_MATTES) readonly buffer CmMatteIds { uint cm_matte_ids[]; };
const uint CM_MATTE_OF_VOLUMES = 1u;

// Maximum number of IDs per pixel.
const uint CM_MAX_MATTES = 32u;
// The image itself holds a pixel's IDs, as float bits, and the sums of their coverage. Compilers for AMD turn an index
// into a private array into branches, which were most of this kernel.
ivec2 cm_matte_texel;
uint cm_matte_count = 0u;
// The ID added to last is in registers, because the next contribution is mostly to the same one. 0: none.
uint cm_matte_slot = 0u;
uint cm_matte_id = 0u;
float cm_matte_share = 0.0;

vec2 cm_load_matte(uint slot) {
  vec4 pairs = imageLoad(cm_mattes, ivec3(cm_matte_texel, int(slot / 2u)));
  return (slot & 1u) == 0u ? pairs.xy : pairs.zw;
}

void cm_store_matte(uint slot, vec2 matte) {
  ivec3 at = ivec3(cm_matte_texel, int(slot / 2u));
  vec4 pairs = imageLoad(cm_mattes, at);
  imageStore(cm_mattes, at, (slot & 1u) == 0u ? vec4(matte, pairs.zw) : vec4(pairs.xy, matte));
}

void cm_store_last_matte() {
  if (cm_matte_id != 0u) cm_store_matte(cm_matte_slot, vec2(uintBitsToFloat(cm_matte_id), cm_matte_share));
}

// Loads an ID and its sum into the registers. If all slots are in use, the one with the smallest coverage is replaced.
void cm_select_matte(uint id) {
  cm_store_last_matte();
  uint slot = 0u;
  while (slot < cm_matte_count && floatBitsToUint(cm_load_matte(slot).x) != id) slot += 1u;
  float share = 0.0;
  if (slot < cm_matte_count) {
    share = cm_load_matte(slot).y;
  } else if (slot < CM_MAX_MATTES) {
    cm_matte_count += 1u;
  } else {
    slot = 0u;
    for (uint i = 1u; i < CM_MAX_MATTES; ++i) {
      if (cm_load_matte(i).y < cm_load_matte(slot).y) slot = i;
    }
  }
  cm_matte_slot = slot;
  cm_matte_id = id;
  cm_matte_share = share;
}

void cm_add_to_matte(uint id, float share) {
  if (id == 0u || !(share > 0.0)) return;
  if (id != cm_matte_id) cm_select_matte(id);
  cm_matte_share += share;
}

// Loads the sums of earlier dispatches: coverage times their number of rays.
void cm_load_mattes(float rays) {
  const int slices = int(CM_MAX_MATTES / 2u);
  bool more = rays > 0.0;
  for (int slice = 0; slice < slices && more; ++slice) {
    vec4 pairs = imageLoad(cm_mattes, ivec3(cm_matte_texel, slice));
    imageStore(cm_mattes, ivec3(cm_matte_texel, slice), vec4(pairs.x, rays * pairs.y, pairs.z, rays * pairs.w));
    more = pairs.w > 0.0;
    cm_matte_count += more ? 2u : pairs.y > 0.0 ? 1u : 0u;
  }
}

// Sorts the IDs by coverage, the largest first, and keeps the order of equal ones.
void cm_sort_mattes() {
  for (uint i = 1u; i < cm_matte_count; ++i) {
    vec2 matte = cm_load_matte(i);
    uint slot = i;
    while (slot > 0u && cm_load_matte(slot - 1u).y < matte.y) {
      cm_store_matte(slot, cm_load_matte(slot - 1u));
      slot -= 1u;
    }
    if (slot < i) cm_store_matte(slot, matte);
  }
}

// Divides the sums by the number of rays, and ends the list with a coverage of 0.
void cm_finish_mattes(float rays) {
  float share = 1.0 / rays;
  bool more = true;
  for (uint slot = 0u; slot < CM_MAX_MATTES && more; slot += 2u) {
    ivec3 at = ivec3(cm_matte_texel, int(slot / 2u));
    vec4 pairs = imageLoad(cm_mattes, at);
    if (slot >= cm_matte_count) pairs.xy = vec2(0.0);
    if (slot + 1u >= cm_matte_count) pairs.zw = vec2(0.0);
    imageStore(cm_mattes, at, vec4(pairs.x, share * pairs.y, pairs.z, share * pairs.w));
    more = pairs.w > 0.0;
  }
}

void main() {
  uvec2 local = gl_GlobalInvocationID.xy + uvec2(0u, cm.dispatch.rows.x);
  if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.rows.y) return;
  uvec2 pixel = cm.dispatch.tile_corner + local;
  uint first_model = CM_MATTE_OF_VOLUMES + max(cm.space.volumes, 1u);
  cm_matte_texel = ivec2(local);
  cm_load_mattes(float(cm.dispatch.rays_before));
  for (int i = int(cm.dispatch.rays_before); i < int(cm.dispatch.samples); ++i) {
    CmFeatureRay ray = cm_feature_ray(pixel, i);
    float solid_t = ray.end;
    uint solid = 0u;  // the host's surfaces have no ID
#if CM_SURFACES
    CmHit hit;
    if (cm_trace_models(cm_from_cube_point(ray.o), ray.w, 0.0, solid_t, false, hit)) {
      solid_t = hit.t;
      solid = cm_matte_ids[first_model + cm_model_of(hit.triangle)];
    }
#endif
    float ground_t = cm_solid_ground_distance(ray.o, ray.d);
    if (ground_t < min(solid_t, CM_NO_GROUND)) {
      solid_t = ground_t;
      solid = cm_matte_ids[0];
    }
    float used = 0.0;
    float clear = 1.0;
    CmWalk walk = cm_walk(ray.o, ray.d, solid_t, true);
    // Beyond e^-40 nothing remains visible.
    for (int j = 0; j < 100000 && used < 40.0; ++j) {
      float t_1;
      CmBernstein e;
      if (!cm_walk_part(walk, t_1, e)) break;
      float way = walk.t_end - walk.t;
      float span = t_1 - walk.t;
      float depth = cm_depth_of(e, span, way);
      used += depth;
      float probability = 1.0 - exp(-depth);
      // Splits the probability by the volumes' extinctions at the mean position of scattering.
      float middle = walk.t + cm_middle_of_part(depth, probability) * min(span, way);
      float extinction = 0.0;
      for (int k = 0; CM_IS_FRONT(k, walk); ++k) extinction += cm_front_extinction(walk.front[k], middle);
      float rare = extinction > 0.0 ? clear * probability / extinction : 0.0;
      for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
        cm_add_to_matte(cm_matte_ids[CM_MATTE_OF_VOLUMES + walk.front[k].volume],
                        rare * cm_front_extinction(walk.front[k], middle));
      }
      clear -= clear * probability;
      cm_walk_on(walk, t_1);
    }
    cm_add_to_matte(solid, exp(-used));
  }
  cm_store_last_matte();
  cm_sort_mattes();
  cm_finish_mattes(float(cm.dispatch.samples));
}
