// The values of bricks, and their weights in the cells of bricks: for the kernels that make records. A brick has the
// values of its 8^3 voxels. With CM_LINEAR it has those of the 9^3 voxels at its lattice points, and fields are
// interpolated between them (docs/architecture/interpolation.md).
#ifndef CM_GRID_PARTS_GLSL
#define CM_GRID_PARTS_GLSL

#if CM_LINEAR
#define CM_BRICK_VALUES 729u
#define CM_SIXTH CM_SIXTH_BETWEEN
#define CM_PARTS CM_CELL_PARTS_BETWEEN
const uint cm_first_part[11] = uint[11](CM_PARTS_OF_LEVELS_BETWEEN);
#else
#define CM_BRICK_VALUES CM_BLOCK_POINTS
#define CM_SIXTH 1u
#define CM_PARTS CM_CELL_PARTS
const uint cm_first_part[11] = uint[11](CM_PARTS_OF_LEVELS);
#endif
layout(std140, binding = CM_UNIFORM_CELL_PARTS) uniform CmParts { uvec4 cm_parts[CM_PARTS]; };  // grid::CellPart

// Values are counted along the frame's axes from v0: index of the voxel there in the brick of `voxel`, and index steps
// per axis.
int cm_value_at_v0(vec3 v0, uint shape, ivec3 voxel) {
#if CM_LINEAR
  ivec3 p = ivec3(v0) - (voxel & ivec3(~7));
  return (p.x * 9 + p.y) * 9 + p.z;
#else
  return int(cm_in_block(ivec3(floor(v0 + cm_from_frame(vec3(0.5), shape)))));
#endif
}
ivec3 cm_value_steps(uint shape) {
  uvec3 axis = uvec3((shape >> 3) & 3u, (shape >> 5) & 3u, (shape >> 7) & 3u);
#if CM_LINEAR
  ivec3 steps = mix(mix(ivec3(1), ivec3(9), equal(axis, uvec3(1u))), ivec3(81), equal(axis, uvec3(0u)));
#else
  ivec3 steps = ivec3(64) >> ivec3(3u * axis);
#endif
  return steps * (ivec3(1) - 2 * ivec3(int(shape & 1u), int((shape >> 1) & 1u), int((shape >> 2) & 1u)));
}
// Index offset of a part's value (grid::CellPart) from the one at v0.
int cm_value_of_part(uint word, ivec3 steps) {
  return int(word & 15u) * steps.x + int((word >> 4) & 15u) * steps.y + int((word >> 8) & 15u) * steps.z;
}

// Sum of the weights of a cell's parts.
uint cm_weights_of_level(uint level) { return CM_SIXTH * (CM_BLOCK_POINTS >> level); }

#endif
