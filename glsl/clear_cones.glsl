// Where a ray meets nothing any more: an empty cell's clear cones. Directions are in 24 cones, by their longest axis and
// the signs of all three; a bit of each tells that no ray from the cell comes to a cell that has anything, whichever way
// it goes in that cone. So rays end where they get out of a cloud, not where they get out of the box.
//
// They are found on a map of cubes, CM_CLEAR_SIDE along an axis at most, over the box of what there is: full cubes are
// those that cells with anything touch. From a cube rays of a cone get into the same layer's next cubes of the two
// shorter axes and, of the next layer, into those four; so layer by layer, from where rays leave, a cube is clear if
// those of its own layer are not full and those of the next are clear. Rows of cubes are words of a bit each. Floats here
// are whole numbers and halves of them, below 2^21, so that the CPU and GL find the same of the same records. Shared by
// GLSL and C++.
#ifndef CM_CLEAR_CONES_GLSL
#define CM_CLEAR_CONES_GLSL

#define CM_CLEAR_CONES 24u
#define CM_CLEAR_SIDE 64u
// Rows along x stand by z and y, those along z, for cones along x, by x and y.
#define CM_CLEAR_ROWS (CM_CLEAR_SIDE * CM_CLEAR_SIDE)
#define CM_CLEAR_CUBES (CM_CLEAR_ROWS * CM_CLEAR_SIDE)
#define CM_CLEAR_ALONG_X 0u
#define CM_CLEAR_ALONG_Z 1u

// A direction's, as a bit. Where lengths are equal or 0 it is in several, and in the one that this gives.
CM_FN uint cm_clear_cone(vec3 d) {
  vec3 a = abs(d);
  uint axis = a.x >= a.y && a.x >= a.z ? 0u : (a.y >= a.z ? 1u : 2u);
  return 1u << (8u * axis + (d.x > 0.0f ? 1u : 0u) + (d.y > 0.0f ? 2u : 0u) + (d.z > 0.0f ? 4u : 0u));
}

struct CmClearMap {
  ivec3 low;   // its first cube, counted in cubes
  uint shift;  // cubes are of 2^shift voxels
};

// Over the voxels from low to high, of as small cubes as do. As many of them as a side's length has may be one too few.
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

// Of a cell: the cubes that it may touch, from first to last, and by how many along an axis they are looked at together.
struct CmClearRange {
  ivec3 first;
  ivec3 last;
  int step;
};

// A cell stands in one of the octree's cubes, of which a quarter along an axis is looked at.
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

// Whether the map has all of them. Cells that it has not are beside the box, where rays do not come but for what they are
// rounded by, or stand across its end, which they soon get to.
CM_FN bool cm_clear_has(CmClearRange range) {
  ivec3 low = range.first;
  ivec3 high = range.last;
  int side = int(CM_CLEAR_SIDE);
  return min(low.x, min(low.y, low.z)) >= 0 && max(high.x, max(high.y, high.z)) < side;
}

// Whether it touches so many cubes along each axis from there on.
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

// A row's bits from `first` on, so many.
CM_FN uint cm_clear_below(int bit) { return bit <= 0 ? 0u : (bit >= 32 ? 0xffffffffu : (1u << uint(bit)) - 1u); }
CM_FN uvec2 cm_clear_bits(int first, int count) {
  return uvec2(cm_clear_below(first + count) & ~cm_clear_below(first),
               cm_clear_below(first + count - 32) & ~cm_clear_below(first - 32));
}

// A row's bits, each where the one before it is, or the one behind; outside: what comes in.
CM_FN uvec2 cm_clear_shifted(uvec2 row, bool up, uint outside) {
  return up ? uvec2((row.x >> 1) | (row.y << 31), (row.y >> 1) | (outside << 31))
            : uvec2((row.x << 1) | outside, (row.y << 1) | (row.x >> 31));
}

// Of a cube's row and the next one of its layer, which are full, and of the layer behind, which are clear; up: rays go
// towards higher bits.
CM_FN uvec2 cm_clear_row(uvec2 full, uvec2 full_beside, uvec2 clear, uvec2 clear_beside, bool up) {
  uvec2 any = full | full_beside;
  uvec2 both = clear & clear_beside;
  return ~(any | cm_clear_shifted(any, up, 0u)) & both & cm_clear_shifted(both, up, 1u);
}

// Cubes by number.
CM_FN uint cm_clear_number(ivec3 cube) {
  return (uint(cube.z) * CM_CLEAR_SIDE + uint(cube.y)) * CM_CLEAR_SIDE + uint(cube.x);
}
CM_FN uvec3 cm_clear_cube(uint number) {
  return uvec3(number % CM_CLEAR_SIDE, number / CM_CLEAR_SIDE % CM_CLEAR_SIDE, number / CM_CLEAR_ROWS);
}

// Whether a cone's rays go towards higher cubes along an axis.
CM_FN bool cm_clear_up(uint cone, uint axis) { return ((cone >> axis) & 1u) != 0u; }

// Whose rows a cone's are numbered as.
CM_FN uint cm_clear_rows(uint cone) { return cone < 8u ? CM_CLEAR_ALONG_Z : CM_CLEAR_ALONG_X; }
// The row of a cone's that has a cube, and the cube's bit there.
CM_FN uint cm_clear_row_of_cube(uint cone, ivec3 cube) {
  return uint(cone < 8u ? cube.x : cube.z) * CM_CLEAR_SIDE + uint(cube.y);
}
CM_FN uint cm_clear_bit_of_cube(uint cone, ivec3 cube) { return uint(cone < 8u ? cube.z : cube.x); }
// A cone's row, by the layer that its rays go through, and which of that layer's it is.
CM_FN uint cm_clear_row_of_layer(uint cone, uint layer, uint row) {
  return (cone >> 3) == 1u ? row * CM_CLEAR_SIDE + layer : layer * CM_CLEAR_SIDE + row;
}
// Which axis a layer's rows are counted along, and which their bits.
CM_FN uint cm_clear_axis_of_rows(uint cone) { return (cone >> 3) == 1u ? 2u : 1u; }
CM_FN uint cm_clear_axis_of_bits(uint cone) { return cone < 8u ? 2u : 0u; }

#endif
