// Empty-space termination of rays. Each empty cell has 24 bits, its clear cones, one per cone of directions: longest
// axis and signs of all three. A set bit means that no ray from the cell with a direction in that cone reaches a cell
// with density or emission. So rays end where they leave a cloud, not where they leave the bounds.
//
// The bits are found on a map of cubes over the bounds of all non-empty cells, with at most CM_CLEAR_SIDE cubes per
// axis. Cubes touched by a non-empty cell are full. From a cube, rays of a cone reach the neighbors of its layer along
// the two shorter axes, and the same four cubes of the next layer. So layer by layer, from where rays leave the map, a
// cube is clear if those of its own layer are not full and those of the next layer are clear. Rows of cubes are words
// with one bit per cube. Floats here are multiples of 1/2 below 2^21, so that CPU and GL find the same bits for the
// same records. Shared by GLSL and C++.
#ifndef CM_CLEAR_CONES_GLSL
#define CM_CLEAR_CONES_GLSL

#define CM_CLEAR_CONES 24u
#define CM_CLEAR_SIDE 64u
// Rows along x are indexed by z and y. Rows along z, for cones along x, are indexed by x and y.
#define CM_CLEAR_ROWS (CM_CLEAR_SIDE * CM_CLEAR_SIDE)
#define CM_CLEAR_CUBES (CM_CLEAR_ROWS * CM_CLEAR_SIDE)
#define CM_CLEAR_ALONG_X 0u
#define CM_CLEAR_ALONG_Z 1u

// Bit of the cone of a direction. Where lengths are equal or 0, a direction lies in several cones; this returns one of
// them.
CM_FN uint cm_clear_cone(vec3 d) {
  vec3 a = abs(d);
  uint axis = a.x >= a.y && a.x >= a.z ? 0u : (a.y >= a.z ? 1u : 2u);
  return 1u << (8u * axis + (d.x > 0.0f ? 1u : 0u) + (d.y > 0.0f ? 2u : 0u) + (d.z > 0.0f ? 4u : 0u));
}

struct CmClearMap {
  ivec3 low;   // its first cube, in cubes
  uint shift;  // cubes have 2^shift voxels per side
};

// Map over the voxels from low to high, with the smallest possible cubes. The shift derived from the longest side may
// be one too small.
CM_FN CmClearMap cm_clear_map(uvec3 low, uvec3 high) {
  uvec3 last = high - uvec3(1u, 1u, 1u);
  ivec3 lengths = ivec3(last - low);
  CmClearMap map;
  map.shift = uint(max(findMSB(max(max(lengths.x, max(lengths.y, lengths.z)), 0)) - 5, 0));
  ivec3 cubes = ivec3(last >> uvec3(map.shift)) - ivec3(low >> uvec3(map.shift));
  if (max(cubes.x, max(cubes.y, cubes.z)) >= int(CM_CLEAR_SIDE)) map.shift += 1u;
  map.low = ivec3(low >> uvec3(map.shift));
  return map;
}

// The cubes that a cell may touch, from first to last, and the number of cubes per axis that are tested together.
struct CmClearRange {
  ivec3 first;
  ivec3 last;
  int step;
};

// A cell lies in an octree cube. The step is a quarter of that cube's side.
CM_FN CmClearRange cm_clear_range(vec3 v0, uint shape, CmClearMap map) {
  CmClearRange range;
  vec3 v1 = cm_cell_vertex(v0, shape, 1u);
  vec3 v2 = cm_cell_vertex(v0, shape, 2u);
  vec3 v3 = cm_cell_vertex(v0, shape, 3u);
  uint step = max(cm_shape_cube_size(shape), map.shift + 2u) - map.shift - 2u;
  ivec3 at = ivec3(int(map.shift + step));
  range.step = 1 << int(step);
  range.first = ((ivec3(min(min(v0, v1), min(v2, v3))) >> at) << ivec3(int(step))) - map.low;
  range.last = (((ivec3(max(max(v0, v1), max(v2, v3))) - ivec3(1, 1, 1)) >> at) << ivec3(int(step))) - map.low;
  return range;
}

// Returns true if the map contains the whole range. Other cells are outside the bounds, where rays come only by
// rounding, or lie across the bounds' end, which rays soon reach.
CM_FN bool cm_clear_has(CmClearRange range) {
  ivec3 low = range.first;
  ivec3 high = range.last;
  int side = int(CM_CLEAR_SIDE);
  return min(low.x, min(low.y, low.z)) >= 0 && max(high.x, max(high.y, high.z)) < side;
}

// Returns true if the cell touches the block of `cubes` cubes per axis that begins at `cube`.
CM_FN bool cm_clear_touches(vec3 v0, uint shape, CmClearMap map, ivec3 cube, int cubes) {
  float voxels = float(1 << int(map.shift));
  float half_size = 0.5f * voxels * float(cubes);
  vec3 middle = voxels * vec3(cube + map.low) + vec3(half_size, half_size, half_size);
  vec3 p = cm_to_frame(middle - v0, shape);
  float unit = cm_shape_unit(shape);
  uint cell_class = cm_shape_class(shape);
  bool cap = cell_class == 0u ? p.x + p.y - 2.0f * half_size < 2.0f * unit
                              : (cell_class == 1u ? p.x - half_size < unit : p.x + p.z - 2.0f * half_size < 2.0f * unit);
  return p.z + half_size > 0.0f && p.x - p.y + 2.0f * half_size > 0.0f && p.y - p.z + 2.0f * half_size > 0.0f && cap;
}

// Mask of `count` bits of a row, from bit `first` on.
CM_FN uint cm_clear_below(int bit) { return bit <= 0 ? 0u : (bit >= 32 ? 0xffffffffu : (1u << uint(bit)) - 1u); }
CM_FN uvec2 cm_clear_bits(int first, int count) {
  return uvec2(cm_clear_below(first + count) & ~cm_clear_below(first),
               cm_clear_below(first + count - 32) & ~cm_clear_below(first - 32));
}

// Shifts a row by one bit. up: each bit moves to the one before it, else to the one after it. outside: the bit shifted
// in.
CM_FN uvec2 cm_clear_shifted(uvec2 row, bool up, uint outside) {
  return up ? uvec2((row.x >> 1) | (row.y << 31), (row.y >> 1) | (outside << 31))
            : uvec2((row.x << 1) | outside, (row.y << 1) | (row.x >> 31));
}

// Clear bits of a row. full, full_beside: full bits of this row and of the next row of the layer; clear, clear_beside:
// clear bits of the same rows in the layer behind. up: rays go towards higher bits.
CM_FN uvec2 cm_clear_row(uvec2 full, uvec2 full_beside, uvec2 clear, uvec2 clear_beside, bool up) {
  uvec2 any = full | full_beside;
  uvec2 both = clear & clear_beside;
  return ~(any | cm_clear_shifted(any, up, 0u)) & both & cm_clear_shifted(both, up, 1u);
}

// Conversion between cubes and their numbers.
CM_FN uint cm_clear_number(ivec3 cube) {
  return (uint(cube.z) * CM_CLEAR_SIDE + uint(cube.y)) * CM_CLEAR_SIDE + uint(cube.x);
}
CM_FN uvec3 cm_clear_cube(uint number) {
  return uvec3(number % CM_CLEAR_SIDE, number / CM_CLEAR_SIDE % CM_CLEAR_SIDE, number / CM_CLEAR_ROWS);
}

// Returns true if the cone's rays go towards higher cubes along the axis.
CM_FN bool cm_clear_up(uint cone, uint axis) { return ((cone >> axis) & 1u) != 0u; }

// Selects the set of rows that a cone uses.
CM_FN uint cm_clear_rows(uint cone) { return cone < 8u ? CM_CLEAR_ALONG_Z : CM_CLEAR_ALONG_X; }
// Row that contains a cube in the cone's set, and the bit of the cube in it.
CM_FN uint cm_clear_row_of_cube(uint cone, ivec3 cube) {
  return uint(cone < 8u ? cube.x : cube.z) * CM_CLEAR_SIDE + uint(cube.y);
}
CM_FN uint cm_clear_bit_of_cube(uint cone, ivec3 cube) { return uint(cone < 8u ? cube.z : cube.x); }
// Index of a row, by the layer along the cone's axis and the row in that layer.
CM_FN uint cm_clear_row_of_layer(uint cone, uint layer, uint row) {
  return (cone >> 3) == 1u ? row * CM_CLEAR_SIDE + layer : layer * CM_CLEAR_SIDE + row;
}
// Axis along which a layer's rows are counted, and axis of their bits.
CM_FN uint cm_clear_axis_of_rows(uint cone) { return (cone >> 3) == 1u ? 2u : 1u; }
CM_FN uint cm_clear_axis_of_bits(uint cone) { return cone < 8u ? 2u : 0u; }

#endif
