// Storage of paths between dispatches: structure of arrays, one plane of lanes per four words of a path. A lane keeps
// its pixel of the tile until that is finished and then takes another (glsl/path/pixel_slots.glsl). The includer has
// glsl/path/path_state.glsl before this.
#ifndef CM_PATH_STORE_GLSL
#define CM_PATH_STORE_GLSL

layout(std430, binding = CM_STORAGE_PATHS) buffer CmPaths { uvec4 cm_paths[]; };
#include "path/path_blocks.glsl"

layout(std430, binding = CM_STORAGE_BLOCKS) buffer CmBlocks {
  uvec4 cm_total;  // x: full rounds of traversal, or visits of trace_travel.comp; y, z: bits of the tile's changed
                   // bands of rows; w: number of samples whose radiance was not finite
  uvec4 cm_running;  // work groups of trace.comp: x: that run now; y: the most at once; z: all
  uvec4 cm_blocks[CM_MAX_BLOCKS];   // x: numbers of the dispatch's blocks, with CM_BEGINS. Per block: y: lanes that
                                    // have a pixel; z: lanes whose pixel has no sample; w: samples finished in this
                                    // dispatch
  uint cm_next_slot;               // first unused pixel slot
  uint cm_squares[CM_MAX_SQUARES];  // list of the sampled 8x8 blocks of pixels: CM_SQUARE_ROWS
  uint cm_active_counts[CM_LISTS * CM_MAX_BLOCKS];  // per list and block: number of lanes with a path
  uint cm_slot_words[];  // per pixel slot: entry cell of its last camera ray, plus one; 0: unknown. Then per list: lanes
                         // of all blocks; in each block the active lanes come first
};

#define CM_ZERO_VEC3(name) p.name = vec3(0.0);
#define CM_ZERO_VEC2(name) p.name = vec2(0.0);
#define CM_ZERO_UVEC2(name) p.name = uvec2(0u);
#define CM_ZERO_FLOAT(name) p.name = 0.0;
#define CM_ZERO_UINT(name) p.name = 0u;
#define CM_ZERO_BITS(name, bits) p.name = 0u;

// Marks the band of rows of a changed film pixel. Most bits are set already, and a read is cheaper than an atomic.
void cm_mark_row(uint y) {
  uint band = (y - cm.dispatch.tile_corner.y) / CM_BAND_ROWS;
  uint bit = 1u << (band & 31u);
  if (band < 32u) {
    if ((cm_total.y & bit) == 0u) atomicOr(cm_total.y, bit);
  } else if ((cm_total.z & bit) == 0u) {
    atomicOr(cm_total.z, bit);
  }
}

uint cm_lanes() { return cm.dispatch.lanes; }

// Words of a part, in the order of the list. All indices are compile-time constants.
#define CM_UNPACK_UINT(name) p.name = words[word++];
#define CM_UNPACK_FLOAT(name) p.name = uintBitsToFloat(words[word++]);
#define CM_UNPACK_UVEC2(name) CM_UNPACK_UINT(name.x) CM_UNPACK_UINT(name.y)
#define CM_UNPACK_VEC2(name) CM_UNPACK_FLOAT(name.x) CM_UNPACK_FLOAT(name.y)
#define CM_UNPACK_VEC3(name) CM_UNPACK_VEC2(name) CM_UNPACK_FLOAT(name.z)
#define CM_UNPACK_BITS(name, bits) p.name = bitfieldExtract(words[word], at_bit, bits); at_bit += bits;

#define CM_PACK_UINT(name) words[word++] = p.name;
#define CM_PACK_FLOAT(name) words[word++] = floatBitsToUint(p.name);
#define CM_PACK_UVEC2(name) CM_PACK_UINT(name.x) CM_PACK_UINT(name.y)
#define CM_PACK_VEC2(name) CM_PACK_FLOAT(name.x) CM_PACK_FLOAT(name.y)
#define CM_PACK_VEC3(name) CM_PACK_VEC2(name) CM_PACK_FLOAT(name.z)
#define CM_PACK_BITS(name, bits) words[word] |= p.name << at_bit; at_bit += bits;

// Loads and stores a part. first: index of its first quad in a path.
#define CM_LOAD(PART, quads, first)                                                                               \
  uint words[4 * quads];                                                                                          \
  for (int i = 0; i < quads; ++i) {                                                                               \
    uvec4 quad = cm_paths[lane + uint(first + i) * cm_lanes()];                                                   \
    words[4 * i] = quad.x;                                                                                        \
    words[4 * i + 1] = quad.y;                                                                                    \
    words[4 * i + 2] = quad.z;                                                                                    \
    words[4 * i + 3] = quad.w;                                                                                    \
  }                                                                                                               \
  int word = 0;                                                                                                   \
  int at_bit = 0;                                                                                                 \
  PART(CM_UNPACK_VEC3, CM_UNPACK_VEC2, CM_UNPACK_UVEC2, CM_UNPACK_FLOAT, CM_UNPACK_UINT, CM_UNPACK_BITS)
#define CM_STORE(PART, quads, first)                                                                              \
  uint words[4 * quads];                                                                                          \
  for (int i = 0; i < 4 * quads; ++i) words[i] = 0u;                                                              \
  int word = 0;                                                                                                   \
  int at_bit = 0;                                                                                                 \
  PART(CM_PACK_VEC3, CM_PACK_VEC2, CM_PACK_UVEC2, CM_PACK_FLOAT, CM_PACK_UINT, CM_PACK_BITS)                      \
  for (int i = 0; i < quads; ++i) {                                                                               \
    cm_paths[lane + uint(first + i) * cm_lanes()] =                                                               \
        uvec4(words[4 * i], words[4 * i + 1], words[4 * i + 2], words[4 * i + 3]);                                \
  }

void cm_load_ray(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_RAY, CM_RAY_QUADS, 0) }
void cm_store_ray(CmPath p, uint lane) { CM_STORE(CM_PATH_RAY, CM_RAY_QUADS, 0) }
#define CM_FIRST_SUM CM_RAY_QUADS
void cm_load_sum(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_SUM, CM_SUM_QUADS, CM_FIRST_SUM) }
void cm_store_sum(CmPath p, uint lane) { CM_STORE(CM_PATH_SUM, CM_SUM_QUADS, CM_FIRST_SUM) }
#define CM_FIRST_SCATTERED (CM_RAY_QUADS + CM_SUM_QUADS)
void cm_load_scattered(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_SCATTERED, CM_SCATTERED_QUADS, CM_FIRST_SCATTERED) }
void cm_store_scattered(CmPath p, uint lane) { CM_STORE(CM_PATH_SCATTERED, CM_SCATTERED_QUADS, CM_FIRST_SCATTERED) }
#define CM_FIRST_ENDS (CM_PATH_QUADS - CM_ENDS_QUADS)
void cm_load_ends(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_ENDS, CM_ENDS_QUADS, CM_FIRST_ENDS) }
void cm_store_ends(CmPath p, uint lane) { CM_STORE(CM_PATH_ENDS, CM_ENDS_QUADS, CM_FIRST_ENDS) }

#if CM_INSTANCES
void cm_load_visit(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_VISIT, CM_VISIT_QUADS, CM_PATH_QUADS) }
void cm_store_visit(CmPath p, uint lane) { CM_STORE(CM_PATH_VISIT, CM_VISIT_QUADS, CM_PATH_QUADS) }
#else
void cm_load_visit(inout CmPath p, uint lane) {}
void cm_store_visit(CmPath p, uint lane) {}
#endif

// The CM_PATH_WITHIN part lies behind the space of the CM_PATH_VISIT part. A new path is in no volume.
#define CM_FIRST_WITHIN (CM_PATH_QUADS + CM_VISIT_QUADS)
#if CM_EXTENDED_BSDF
void cm_load_within(inout CmPath p, uint lane) { CM_LOAD(CM_PATH_WITHIN, CM_WITHIN_QUADS, CM_FIRST_WITHIN) }
void cm_store_within(CmPath p, uint lane) { CM_STORE(CM_PATH_WITHIN, CM_WITHIN_QUADS, CM_FIRST_WITHIN) }
#else
void cm_load_within(inout CmPath p, uint lane) {}
void cm_store_within(CmPath p, uint lane) {}
#endif
// Radiance by light group, one quad each, behind both parts.
#define CM_FIRST_GROUPS (CM_FIRST_WITHIN + CM_WITHIN_QUADS)

void cm_begin_within(uint lane) {
  if (cm.surfaces.extended_bsdf == 0u) return;
  for (int i = 0; i < CM_WITHIN_QUADS; ++i) cm_paths[lane + uint(CM_FIRST_WITHIN + i) * cm_lanes()] = uvec4(0u);
}

CmPath cm_begin_path() {
  CmPath p;
  CM_PATH_RAY(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
  CM_PATH_SUM(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
  CM_PATH_SCATTERED(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
  CM_PATH_ENDS(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
#if CM_INSTANCES
  CM_PATH_VISIT(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
#endif
#if CM_EXTENDED_BSDF
  CM_PATH_WITHIN(CM_ZERO_VEC3, CM_ZERO_VEC2, CM_ZERO_UVEC2, CM_ZERO_FLOAT, CM_ZERO_UINT, CM_ZERO_BITS)
#endif
  p.stage = CM_STAGE_CAMERA;
  return p;
}

CmPath cm_load_path(uint lane) {
  CmPath p = cm_begin_path();
  cm_load_ray(p, lane);
  cm_load_sum(p, lane);
  cm_load_scattered(p, lane);
  cm_load_ends(p, lane);
#if CM_MOTION
  cm_now = cm_moment(p.number, p.stream);
#endif
  return p;
}

void cm_store_path(CmPath p, uint lane) {
  cm_store_ray(p, lane);
  cm_store_sum(p, lane);
  cm_store_scattered(p, lane);
  cm_store_ends(p, lane);
}

// For kernels with a row of work groups per block of the dispatch: number of the block, and of the invocation in it.
// cm_block_lane may be beyond cm_lanes(). cm_block_begins: a tile begins, so that no lane has a path.
uint cm_block() { return bitfieldExtract(cm_blocks[gl_WorkGroupID.y].x, 0, CM_LIST_BIT); }
uint cm_index_in_block() { return gl_WorkGroupID.x * 64u + gl_LocalInvocationIndex; }
uint cm_block_lane() { return cm_block() * CM_BLOCK_LANES + cm_index_in_block(); }
bool cm_block_begins() { return (cm_blocks[gl_WorkGroupID.y].x & CM_BEGINS) != 0u; }
uint cm_block_of(uint lane) { return lane / CM_BLOCK_LANES; }

// Stream compaction: packs the active lanes of a block, so that SIMD groups stay full when many lanes are done. There
// are three lists in rotation. Each dispatch reads the list that the block's last dispatch wrote, writes the next one
// and clears the third.
uint cm_list(uint ahead) { return (bitfieldExtract(cm_blocks[gl_WorkGroupID.y].x, CM_LIST_BIT, 2) + ahead) % CM_LISTS; }
// Index of the block's first word in a list.
uint cm_list_at(uint list) { return cm.dispatch.slots + list * cm_lanes() + cm_block() * CM_BLOCK_LANES; }
uint cm_ranked_lane() {
  if (cm_index_in_block() == 0u) cm_active_counts[cm_list(2u) * CM_MAX_BLOCKS + cm_block()] = 0u;
  if (cm_block_begins()) return cm_block_lane();
  if (cm_index_in_block() >= cm_active_counts[cm_list(0u) * CM_MAX_BLOCKS + cm_block()]) return cm_lanes();
  return cm_slot_words[cm_list_at(cm_list(0u)) + cm_index_in_block()];
}
// Adds the lane to the list of the next dispatch.
void cm_join_ranks(uint lane) {
  uint rank = atomicAdd(cm_active_counts[cm_list(1u) * CM_MAX_BLOCKS + cm_block()], 1u);
  cm_slot_words[cm_list_at(cm_list(1u)) + rank] = lane;
}

#endif
