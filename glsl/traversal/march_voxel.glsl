// Traversal of voxel grids, for comparison: a 3D DDA over every voxel (Amanatides and Woo 1987), and the same with
// empty 8^3 bricks skipped. A cell is a voxel of cube space: x | y << 16, z, and (bricks) the slot of its brick,
// CM_NONE if not looked up yet. Shared by GLSL and C++; the includer provides
//   float cm_voxel(ivec3 voxel)                   dense: density of a voxel in the bounds
//   uint cm_brick_slot(ivec3 brick)               bricks: slot of a brick in the bounds, CM_EMPTY_BRICK if it is empty
//   float cm_brick_voxel(uint slot, uint index)   bricks: density; index = (x * S + y) * S + z, S = CM_BRICK_SIDE
// with CM_CHANNELS also
//   vec3 cm_emission_voxel(ivec3 voxel)           voxel in the bounds; 0 in empty bricks
//   vec3 cm_scattering_voxel(ivec3 voxel)         density x color
//   float cm_anisotropy_voxel(ivec3 voxel)
// with CM_MOTION also half of the density's change from shutter open to shutter close
//   float cm_voxel_change(ivec3 voxel), float cm_brick_change(uint slot, uint index)
// and with CM_VELOCITY
//   vec3 cm_velocity_voxel(ivec3 voxel)           voxels per second
// With CM_LINEAR a voxel is a sample at its integer coordinates, and a cell has eight voxels at its corners, of which
// its own has the lowest coordinates. Voxels up to the bounds' upper corner are then read, and CM_BRICK_SIDE is 9.
#ifndef CM_MARCH_VOXEL_GLSL
#define CM_MARCH_VOXEL_GLSL

#define CM_EMPTY_BRICK 0xfffffffeu
#undef CM_BRICK_SIDE
#if CM_LINEAR
#define CM_BRICK_SIDE 9
#else
#define CM_BRICK_SIDE 8
#endif

CM_FN ivec3 cm_voxel_of(uvec3 cell) { return ivec3(int(cell.x & 0xffffu), int(cell.x >> 16), int(cell.y)); }

CM_FN uvec3 cm_voxel_cell(ivec3 v, uint slot) { return uvec3(uint(v.x) | (uint(v.y) << 16), uint(v.z), slot); }

CM_FN uint cm_brick_index(ivec3 voxel) {
  return uint(((voxel.x & 7) * CM_BRICK_SIDE + (voxel.y & 7)) * CM_BRICK_SIDE + (voxel.z & 7));
}

// Density of a voxel at mid-shutter, and with CM_MOTION at cm_now. slot: of the cell's brick, which has its corners.
CM_FN float cm_mean_density(ivec3 voxel, uint slot, uint index) {
#if CM_MARCH == 2
  return cm_brick_voxel(slot, index);
#else
  return cm_voxel(voxel);
#endif
}
CM_FN float cm_density_now(ivec3 voxel, uint slot, uint index) {
  float density = cm_mean_density(voxel, slot, index);
#if CM_MOTION
#if CM_MARCH == 2
  if (CM_MEDIUM.changes != 0u) density += (2.0f * cm_now - 1.0f) * cm_brick_change(slot, index);
#else
  if (CM_MEDIUM.changes != 0u) density += (2.0f * cm_now - 1.0f) * cm_voxel_change(voxel);
#endif
  density = max(0.0f, density);  // halves are rounded
#endif
  return density;
}

#if CM_LINEAR
// Reads the densities of a cell's corners. now: at cm_now, else at mid-shutter.
CM_FN CmCellCorners cm_density_corners(ivec3 voxel, uint slot, bool now) {
  CmCellCorners corners = cm_no_corners();
  uint first = cm_brick_index(voxel);
  for (int i = 0; i < 8; ++i) {
    ivec3 offset = cm_corner_offset(i);
    uint index = first + uint((offset.x * CM_BRICK_SIDE + offset.y) * CM_BRICK_SIDE + offset.z);
    float density = now ? cm_density_now(voxel + offset, slot, index) : cm_mean_density(voxel + offset, slot, index);
    cm_set_corner(corners, i, density);
  }
  return corners;
}

// A point of cube space, relative to a cell.
CM_FN vec3 cm_within_cell(ivec3 voxel, vec3 p) {
  return clamp(p - vec3(voxel), vec3(0.0f, 0.0f, 0.0f), vec3(1.0f, 1.0f, 1.0f));
}
#endif

CM_FN uvec3 cm_march_enter(vec3 p) {
  ivec3 low = ivec3(CM_GRID.box_min);
  ivec3 high = ivec3(CM_GRID.box_max) - ivec3(1, 1, 1);
  return cm_voxel_cell(clamp(ivec3(floor(p)), low, high), CM_NONE);
}

// A ray in cube space, with data that the traversal precomputes.
struct CmMarchRay {
  vec3 o;
  vec3 d;
  vec3 inv_d;
};
CM_FN CmMarchRay cm_march_ray(vec3 o, vec3 d) {
  CmMarchRay ray;
  ray.o = o;
  ray.d = d;
  ray.inv_d = vec3(1.0f, 1.0f, 1.0f) / d;
  return ray;
}

CM_FN void cm_march_step(uvec3 cell, CmMarchRay ray, float t, CM_OUT(float) t_1, CM_OUT(CmBernstein) r,
                         CM_OUT(uvec3) next) {
  vec3 o = ray.o;
  vec3 d = ray.d;
  vec3 inv_d = ray.inv_d;
  ivec3 voxel = cm_voxel_of(cell);
  ivec3 low = voxel;
  int size = 1;
#if CM_MARCH == 2
  uint slot = cell.z;
  if (slot == CM_NONE) slot = cm_brick_slot(voxel >> 3);
  bool empty = slot == CM_EMPTY_BRICK;
  if (empty) {
    low = voxel & ivec3(~7, ~7, ~7);
    size = 8;
  }
#else
  uint slot = CM_NONE;
  bool empty = false;
#endif
  // Plane that the ray reaches on each axis, from the integer, so that both sides agree; then the axis of the nearest.
  vec3 plane = vec3(float(low.x + (d.x > 0.0f ? size : 0)), float(low.y + (d.y > 0.0f ? size : 0)),
                    float(low.z + (d.z > 0.0f ? size : 0)));
  float t_x = d.x != 0.0f ? (plane.x - o.x) * inv_d.x : 3.0e38f;
  float t_y = d.y != 0.0f ? (plane.y - o.y) * inv_d.y : 3.0e38f;
  float t_z = d.z != 0.0f ? (plane.z - o.z) * inv_d.z : 3.0e38f;
  float t_exit = min(t_x, min(t_y, t_z));
  t_1 = max(t, t_exit);
  r = CmBernstein(0.0f);
#if CM_LINEAR
  if (!empty) {
    r = cm_trilinear_along(cm_density_corners(voxel, slot, true), cm_within_cell(voxel, o + t * d),
                           cm_within_cell(voxel, o + t_1 * d));
  }
#else
  if (!empty) r = CmBernstein(cm_density_now(voxel, slot, cm_brick_index(voxel)));
#endif
  ivec3 v = voxel;
#if CM_MARCH == 2
  if (empty) v = clamp(ivec3(floor(o + t_1 * d)), low, low + ivec3(7, 7, 7));
#endif
  if (t_exit == t_x) {
    v.x = d.x > 0.0f ? low.x + size : low.x - 1;
  } else if (t_exit == t_y) {
    v.y = d.y > 0.0f ? low.y + size : low.y - 1;
  } else {
    v.z = d.z > 0.0f ? low.z + size : low.z - 1;
  }
  ivec3 box_low = ivec3(CM_GRID.box_min);
  ivec3 box_high = ivec3(CM_GRID.box_max);
  bool outside = v.x < box_low.x || v.y < box_low.y || v.z < box_low.z || v.x >= box_high.x || v.y >= box_high.y ||
                 v.z >= box_high.z;
#if CM_MARCH == 2
  bool same = (v.x >> 3) == (voxel.x >> 3) && (v.y >> 3) == (voxel.y >> 3) && (v.z >> 3) == (voxel.z >> 3);
  next = cm_voxel_cell(v, same ? slot : CM_NONE);
#else
  next = cm_voxel_cell(v, CM_NONE);
#endif
  if (outside) next.x = CM_NONE;
}

#if CM_CHANNELS
CM_FN CmEmission cm_march_emission(uvec3 cell, vec3 o, vec3 d) {
  CmEmission e;
  e.mean = vec3(0.0f, 0.0f, 0.0f);
  e.at_0 = 1.0f;
  e.slope = 0.0f;
  e.distance = 0.0f;
#if CM_LINEAR
  ivec3 voxel = cm_voxel_of(cell);
  e.red = cm_no_corners();
  e.green = e.red;
  e.blue = e.red;
  e.o = o - vec3(voxel);
  e.d = d;
  if (CM_MEDIUM.emits != 0u) {
    e.mean = vec3(1.0f, 1.0f, 1.0f);
    for (int i = 0; i < 8; ++i) {
      vec3 emission = cm_emission_voxel(voxel + cm_corner_offset(i));
      cm_set_corner(e.red, i, emission.x);
      cm_set_corner(e.green, i, emission.y);
      cm_set_corner(e.blue, i, emission.z);
    }
  }
#else
  if (CM_MEDIUM.emits != 0u) e.mean = cm_emission_voxel(cm_voxel_of(cell));
#endif
  return e;
}
#endif

#if CM_CHANNELS || CM_VELOCITY
CM_FN uint cm_slot_of(ivec3 voxel) {
#if CM_MARCH == 2
  return cm_brick_slot(voxel >> 3);
#else
  return CM_NONE;
#endif
}
#endif

#if CM_CHANNELS
// p: the point in the cell, in cube space. With CM_LINEAR, values are interpolated with the density as weight.
CM_FN vec3 cm_march_color(uvec2 cell, vec3 p) {
  ivec3 voxel = cm_voxel_of(uvec3(cell.x, cell.y, CM_NONE));
#if CM_LINEAR
  vec3 at = cm_within_cell(voxel, p);
  float density = cm_trilinear(cm_density_corners(voxel, cm_slot_of(voxel), false), at);
  vec3 scattering = vec3(0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 8; ++i)
    scattering += cm_corner_weight(i, at) * cm_scattering_voxel(voxel + cm_corner_offset(i));
#else
  float density = cm_mean_density(voxel, cm_slot_of(voxel), cm_brick_index(voxel));
  vec3 scattering = cm_scattering_voxel(voxel);
#endif
  return min(scattering / max(density, 1e-30f), vec3(1.0f, 1.0f, 1.0f));
}

CM_FN float cm_march_anisotropy(uvec2 cell, vec3 p) {
  ivec3 voxel = cm_voxel_of(uvec3(cell.x, cell.y, CM_NONE));
#if CM_LINEAR
  vec3 at = cm_within_cell(voxel, p);
  CmCellCorners density = cm_density_corners(voxel, cm_slot_of(voxel), false);
  float anisotropy = 0.0f;
  for (int i = 0; i < 8; ++i) {
    anisotropy += cm_corner_weight(i, at) * cm_corner(density, i) * cm_anisotropy_voxel(voxel + cm_corner_offset(i));
  }
  return anisotropy / max(cm_trilinear(density, at), 1e-30f);
#else
  return cm_anisotropy_voxel(voxel);
#endif
}
#endif

#if CM_VELOCITY
CM_FN vec3 cm_march_velocity(uvec2 cell, vec3 p) {
  ivec3 voxel = cm_voxel_of(uvec3(cell.x, cell.y, CM_NONE));
#if CM_LINEAR
  vec3 at = cm_within_cell(voxel, p);
  CmCellCorners density = cm_density_corners(voxel, cm_slot_of(voxel), false);
  vec3 velocity = vec3(0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 8; ++i) {
    velocity += cm_corner_weight(i, at) * cm_corner(density, i) * cm_velocity_voxel(voxel + cm_corner_offset(i));
  }
  return velocity / max(cm_trilinear(density, at), 1e-30f);
#else
  return cm_velocity_voxel(voxel);
#endif
}
#endif

#endif
