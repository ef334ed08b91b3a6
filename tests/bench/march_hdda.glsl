// The strongest competitor, which a user would choose instead: a NanoVDB grid, read by PNanoVDB.h, with null collisions
// with the majorants of its nodes (flight_hdda.glsl), by a hierarchical DDA (Museth, "NanoVDB: A GPU-Friendly and
// Portable VDB Data Structure", SIGGRAPH Talks 2021). The benchmark substitutes it for march_voxel.glsl
// (peer_shaders.cpp). The grid's index space is cube space, and its values are relative to the volume's maximum. With
// CM_LINEAR, a collision reads the eight voxels around it, and the maxima of nodes are those of the field between voxels
// (make_nano_grid).
//
// A cell is a region with one majorant: the address of its node or tile, its corner in bricks with its kind, and the
// lower node that contains it, CM_NONE if unknown.
#ifndef CM_MARCH_HDDA_GLSL
#define CM_MARCH_HDDA_GLSL

#define PNANOVDB_GLSL
layout(std430, binding = CM_STORAGE_MODEL_NODES) readonly buffer CmNanoGrid { uint pnanovdb_buf_data[]; };
#include "PNanoVDB.h"

// CM_NANO_TYPE is PNANOVDB_GRID_TYPE_FLOAT or PNANOVDB_GRID_TYPE_FP16.

#define CM_LEAF 0u        // 8 voxels wide, as is
#define CM_LEAF_TILE 1u   // a tile of a lower node in place of a leaf
#define CM_LOWER_TILE 2u  // 128
#define CM_UPPER_TILE 3u  // 4096
#define CM_LOWER 4u       // a whole lower node: 128

// A lower node is one region if a ray through it has at most this number of expected collisions with its maximum, as
// optical depth. With more, stepping from leaf to leaf is cheaper.
#define CM_FEW_COLLISIONS 4.0

const pnanovdb_buf_t cm_nano = pnanovdb_buf_t(0u);
const uint cm_nano_root = PNANOVDB_GRID_SIZE + PNANOVDB_TREE_SIZE;

pnanovdb_address_t cm_nano_at(uint address) {
  pnanovdb_address_t at;
  at.byte_offset = address;
  return at;
}

uvec3 cm_nano_cell(uint kind, uint address, ivec3 voxel, uint lower) {
  uvec3 brick = uvec3(voxel) >> 3;
  if (kind == CM_LOWER || kind == CM_LOWER_TILE) brick &= ~15u;
  if (kind == CM_UPPER_TILE) brick = uvec3(0u);
  return uvec3(address, brick.x | brick.y << 9 | brick.z << 18 | kind << 27, lower);
}
uint cm_nano_kind(uvec3 cell) { return cell.y >> 27; }
ivec3 cm_nano_corner(uvec3 cell) {
  return 8 * ivec3(cell.y & 511u, cell.y >> 9 & 511u, cell.y >> 18 & 511u);
}
int cm_nano_size(uvec3 cell) {
  uint kind = cm_nano_kind(cell);
  return kind <= CM_LEAF_TILE ? 8 : (kind == CM_UPPER_TILE ? 4096 : 128);
}

float cm_nano_lower_max(uint lower) {
  pnanovdb_lower_handle_t node;
  node.address = cm_nano_at(lower);
  return pnanovdb_read_float(cm_nano, pnanovdb_lower_get_max_address(CM_NANO_TYPE, cm_nano, node));
}

float cm_nano_leaf_max(uint leaf) {
  pnanovdb_leaf_handle_t node;
  node.address = cm_nano_at(leaf);
  pnanovdb_address_t at = pnanovdb_leaf_get_max_address(CM_NANO_TYPE, cm_nano, node);
#if CM_NANO_TYPE == PNANOVDB_GRID_TYPE_FLOAT
  return pnanovdb_read_float(cm_nano, at);
#else
  // The high half of a word, in units of the leaf.
  uint most = pnanovdb_read_uint32(cm_nano, pnanovdb_address_mask_inv(at, 3u)) >> 16;
  pnanovdb_address_t table = pnanovdb_leaf_get_table_address(CM_NANO_TYPE, cm_nano, node, 0u);
  float least = pnanovdb_read_float(cm_nano, pnanovdb_address_offset_neg(table, PNANOVDB_LEAF_TABLE_NEG_OFF_MINIMUM));
  float unit = pnanovdb_read_float(cm_nano, pnanovdb_address_offset_neg(table, PNANOVDB_LEAF_TABLE_NEG_OFF_QUANTUM));
  return float(most) * unit + least;
#endif
}

float cm_nano_leaf_value(uint leaf, ivec3 voxel) {
  pnanovdb_leaf_handle_t node;
  node.address = cm_nano_at(leaf);
#if CM_NANO_TYPE == PNANOVDB_GRID_TYPE_FLOAT
  return pnanovdb_read_float(cm_nano, pnanovdb_leaf_get_value_address(CM_NANO_TYPE, cm_nano, node, voxel));
#else
  return pnanovdb_leaf_fp16_read_float(
      cm_nano, pnanovdb_leaf_get_table_address(CM_NANO_TYPE, cm_nano, node, 0u), voxel);
#endif
}

// The child or tile of a lower node that contains a voxel.
uvec3 cm_nano_in_lower(uint lower, ivec3 voxel) {
  pnanovdb_lower_handle_t node;
  node.address = cm_nano_at(lower);
  uint n = pnanovdb_lower_coord_to_offset(voxel);
  bool leaf = pnanovdb_lower_get_child_mask(cm_nano, node, n);
  uint address = pnanovdb_lower_get_table_address(CM_NANO_TYPE, cm_nano, node, n).byte_offset;
  if (leaf) address = pnanovdb_lower_get_child(CM_NANO_TYPE, cm_nano, node, n).address.byte_offset;
  return cm_nano_cell(leaf ? CM_LEAF : CM_LEAF_TILE, address, voxel, lower);
}

// The region that contains a voxel. lower: the lower node that contains it, if that is known not to be a region itself.
uvec3 cm_nano_find(ivec3 voxel, uint lower) {
  if (lower != CM_NONE) return cm_nano_in_lower(lower, voxel);
  pnanovdb_root_handle_t root;
  root.address = cm_nano_at(cm_nano_root);
  pnanovdb_root_tile_handle_t tile = pnanovdb_root_find_tile(CM_NANO_TYPE, cm_nano, root, voxel);
  if (pnanovdb_address_is_null(tile.address)) {
    uint background = cm_nano_root + PNANOVDB_GRID_TYPE_GET(CM_NANO_TYPE, root_off_background);
    return cm_nano_cell(CM_UPPER_TILE, background, voxel, CM_NONE);
  }
  pnanovdb_upper_handle_t upper = pnanovdb_root_get_child(CM_NANO_TYPE, cm_nano, root, tile);
  uint n = pnanovdb_upper_coord_to_offset(voxel);
  if (!pnanovdb_upper_get_child_mask(cm_nano, upper, n)) {
    uint address = pnanovdb_upper_get_table_address(CM_NANO_TYPE, cm_nano, upper, n).byte_offset;
    return cm_nano_cell(CM_LOWER_TILE, address, voxel, CM_NONE);
  }
  lower = pnanovdb_upper_get_child(CM_NANO_TYPE, cm_nano, upper, n).address.byte_offset;
  if (128.0 * cm.medium.extinction * cm_nano_lower_max(lower) < CM_FEW_COLLISIONS)
    return cm_nano_cell(CM_LOWER, lower, voxel, CM_NONE);
  return cm_nano_in_lower(lower, voxel);
}

float cm_nano_majorant(uvec3 cell) {
  uint kind = cm_nano_kind(cell);
  if (kind == CM_LEAF) return cm_nano_leaf_max(cell.x);
  if (kind == CM_LOWER) return cm_nano_lower_max(cell.x);
  return pnanovdb_read_float(cm_nano, cm_nano_at(cell.x));
}

#if CM_LINEAR
// The value of a voxel, which may be in another region.
float cm_nano_voxel(uvec3 cell, ivec3 voxel) {
  ivec3 corner = cm_nano_corner(cell);
  if (any(notEqual(voxel >> 3, corner >> 3))) {
    bool same = cell.z != CM_NONE && all(equal(voxel >> 7, corner >> 7));
    cell = cm_nano_find(voxel, same ? cell.z : CM_NONE);
    if (cm_nano_kind(cell) == CM_LOWER) cell = cm_nano_in_lower(cell.x, voxel);
  }
  if (cm_nano_kind(cell) == CM_LEAF) return cm_nano_leaf_value(cell.x, voxel);
  return pnanovdb_read_float(cm_nano, cm_nano_at(cell.x));
}

// The density at point p of the region's cell whose lowest corner is this voxel.
float cm_nano_density(uvec3 cell, ivec3 voxel, vec3 p, float majorant) {
  if (cm_nano_kind(cell) == CM_LOWER) cell = cm_nano_in_lower(cell.x, voxel);
  if (cm_nano_kind(cell) != CM_LEAF) return 0.0;  // regions without voxels are empty cells
  CmCellCorners corners = cm_no_corners();
  if (all(lessThan(voxel & 7, ivec3(7)))) {
    pnanovdb_leaf_handle_t leaf;
    leaf.address = cm_nano_at(cell.x);
    uint first = pnanovdb_leaf_get_value_address(CM_NANO_TYPE, cm_nano, leaf, voxel).byte_offset;
    for (int i = 0; i < 8; ++i) {
      ivec3 offset = cm_corner_offset(i);
      uint address = first + 4u * uint((offset.x * 8 + offset.y) * 8 + offset.z);
      cm_set_corner(corners, i, pnanovdb_read_float(cm_nano, cm_nano_at(address)));
    }
  } else {
    for (int i = 0; i < 8; ++i) cm_set_corner(corners, i, cm_nano_voxel(cell, voxel + cm_corner_offset(i)));
  }
  return min(majorant, cm_trilinear(corners, clamp(p - vec3(voxel), 0.0, 1.0)));
}
#else
// The density of a voxel of the region, given the region's majorant. p: unused.
float cm_nano_density(uvec3 cell, ivec3 voxel, vec3 p, float majorant) {
  if (cm_nano_kind(cell) == CM_LOWER) cell = cm_nano_in_lower(cell.x, voxel);
  uint kind = cm_nano_kind(cell);
  if (kind == CM_LEAF) return cm_nano_leaf_value(cell.x, voxel);
  return kind == CM_LEAF_TILE ? pnanovdb_read_float(cm_nano, cm_nano_at(cell.x)) : majorant;
}
#endif

uvec3 cm_march_enter(vec3 p) {
  ivec3 low = ivec3(CM_GRID.box_min);
  ivec3 high = ivec3(CM_GRID.box_max) - 1;
  return cm_nano_find(clamp(ivec3(floor(p)), low, high), CM_NONE);
}

// Where a ray leaves the region after t, and the region that it enters.
void cm_nano_exit(uvec3 cell, vec3 o, vec3 d, vec3 inv_d, float t, out float t_1, out ivec3 axis) {
  ivec3 low = cm_nano_corner(cell);
  // The plane that the ray hits on each axis, computed from integers so that both sides agree.
  vec3 plane = vec3(low) + float(cm_nano_size(cell)) * vec3(greaterThan(d, vec3(0.0)));
  vec3 at = mix((plane - o) * inv_d, vec3(3.0e38), equal(d, vec3(0.0)));
  float t_exit = min(at.x, min(at.y, at.z));
  axis = t_exit == at.x ? ivec3(1, 0, 0) : (t_exit == at.y ? ivec3(0, 1, 0) : ivec3(0, 0, 1));
  t_1 = max(t, t_exit);
}

uvec3 cm_nano_next(uvec3 cell, vec3 o, vec3 d, float t_1, ivec3 axis) {
  ivec3 low = cm_nano_corner(cell);
  int size = cm_nano_size(cell);
  ivec3 voxel = clamp(ivec3(floor(o + t_1 * d)), low, low + size - 1);
  ivec3 beyond = mix(low - 1, low + size, greaterThan(d, vec3(0.0)));
  voxel = mix(voxel, beyond, equal(axis, ivec3(1)));
  if (any(lessThan(voxel, ivec3(CM_GRID.box_min))) || any(greaterThanEqual(voxel, ivec3(CM_GRID.box_max))))
    return uvec3(CM_NONE, 0u, CM_NONE);
  bool same = cell.z != CM_NONE && all(equal(voxel >> 7, low >> 7));
  return cm_nano_find(voxel, same ? cell.z : CM_NONE);
}

#endif
