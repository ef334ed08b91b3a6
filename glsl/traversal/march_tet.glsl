// Traversal of the tetrahedral grid. Shared by GLSL and C++; the includer provides
//   uvec4 cm_record(uint cell, uint part)   part 0: links, part 1: data (glsl/grid/cell.glsl)
//   uint cm_tree(uint node)                 the point-location tree
//   uint cm_root_leaf(uint root), uint cm_root_node(uint root)
// with CM_CHANNELS also
//   uvec4 cm_emission_record(uint cell)     glsl/grid/channels.glsl
//   uint cm_color_record(uint cell)        glsl/grid/channels.glsl
//   uint cm_anisotropy_record(uint cell)    glsl/grid/channels.glsl
// with CM_MOTION also
//   uvec2 cm_change_record(uint cell)       change of the density in its record
// with CM_VELOCITY
//   uvec2 cm_velocity_record(uint cell)     glsl/grid/channels.glsl
// and with CM_LINEAR 2, in which the finest cells have the trilinear function between voxels, for each of them
//   uvec4 cm_corners_record(uint cell)      densities of the corners of its cell of eight voxels, in its frame: halves
#ifndef CM_MARCH_TET_GLSL
#define CM_MARCH_TET_GLSL

#include "grid/clear_cones.glsl"

// CM_WIDE 1: the grid's cube may be wider than 2^15. Other kernels decode only one record format.
#ifndef CM_WIDE
#define CM_WIDE 0
#endif
CM_FN bool cm_grid_is_wide() { return CM_WIDE != 0 && cm_is_wide(CM_GRID.root_exponent); }

// Point location: descends the bisection tree, O(level).
CM_FN uvec3 cm_march_enter(vec3 p) {
  float half_size = uintBitsToFloat((127u + CM_GRID.root_exponent) << 23);
  uint root = cm_root_of(p, half_size);
  vec3 v0;
  uint shape;
  cm_root_cell(root, CM_GRID.root_exponent, v0, shape);
  uint leaf = cm_root_leaf(root);
  uint node = cm_root_node(root);
  uint inside = cm_root_node(root + 1u) - node;
  for (int level = 0; level < 64 && inside > 0u; ++level) {
    uint left = cm_tree(node);
    bool second =
        cm_on_child_1(cm_shape_class(shape), cm_to_frame(p - v0, shape) * cm_shape_inverse_unit(shape));
    if (second) {
      v0 = cm_cell_vertex(v0, shape, 1u);
      leaf += left + 1u;
      node += left + 1u;
      inside -= left + 1u;
    } else {
      node += 1u;
      inside = left;
    }
    shape = cm_child_shape(shape, second ? 1u : 0u);
  }
  return uvec3(leaf, 0u, CM_NONE);
}

// Returns true if point location would find this cell for p, because p is inside the cell by more than rounding. False
// may also mean that p is too close to a face.
CM_FN bool cm_march_contains(uint cell, vec3 p) {
  uvec4 data = cm_record(cell, 1u);
  bool wide = cm_grid_is_wide();
  uint shape = cm_record_shape(data, wide);
  uint cell_class = cm_shape_class(shape);
  vec3 q = cm_to_frame(p - cm_record_v0(data, wide), shape);
  float unit = cm_shape_unit(shape);
  float cap = cell_class == 0u ? 2.0f * unit - q.x - q.y : (cell_class == 1u ? unit - q.x : 2.0f * unit - q.x - q.z);
  // Both calculations round to 2^-24 of the cube's size a few times.
  float rounding = uintBitsToFloat((127u - 19u + CM_GRID.root_exponent) << 23);
  return min(min(q.z, q.x - q.y), min(q.y - q.z, cap)) > rounding;
}

// A ray in cube space, with data that the traversal precomputes.
struct CmMarchRay {
  vec3 o;
  vec3 d;
  uint cone;
};
CM_FN CmMarchRay cm_march_ray(vec3 o, vec3 d) {
  CmMarchRay ray;
  ray.o = o;
  ray.d = d;
  ray.cone = cm_clear_cone(d);
  return ray;
}

// Density of a cell. With CM_MOTION at cm_now: the record holds the value at mid-shutter, and the change is half of the
// difference between both ends. So density along a ray is linear at any time, and optical depth keeps its closed form.
CM_FN vec4 cm_march_fit(uvec4 data, uint cell) {
  vec4 fit = cm_record_fit(data);
#if CM_MOTION
  if (CM_MEDIUM.changes != 0u) {
    uvec2 change = cm_change_record(cell);
    fit += (2.0f * cm_now - 1.0f) * cm_fit(change.x, change.y);
  }
#endif
  return fit;
}

#if CM_CUBIC
// Returns true if this is the shape of a sixth of a cell of eight voxels: class B, unit 1.
CM_FN bool cm_is_sixth(uint shape) { return (shape >> 9) == 1u; }

CM_FN CmCellCorners cm_cell_corners(uint cell) {
  uvec4 words = cm_corners_record(cell);
  vec2 low_0 = unpackHalf2x16(words.x);
  vec2 low_1 = unpackHalf2x16(words.y);
  vec2 high_0 = unpackHalf2x16(words.z);
  vec2 high_1 = unpackHalf2x16(words.w);
  CmCellCorners corners;
  corners.low = vec4(low_0.x, low_0.y, low_1.x, low_1.y);
  corners.high = vec4(high_0.x, high_0.y, high_1.x, high_1.y);
  return corners;
}

// Density of a cell from t to t_1: between the corners of a sixth, in the linear fit of a larger cell.
CM_FN CmBernstein cm_density_along(uvec4 data, uint cell, CmFrame f, uint shape, float t, float t_1) {
  vec4 fit = cm_march_fit(data, cell);
  CmBernstein r = CmBernstein(0.0f);
  if (cm_is_sixth(shape) && data.z != 0u) {
    vec3 from = f.o - f.v0;
    vec3 low = vec3(0.0f, 0.0f, 0.0f);
    vec3 high = vec3(1.0f, 1.0f, 1.0f);
    r = cm_trilinear_along(cm_cell_corners(cell), clamp(from + t * f.d, low, high), clamp(from + t_1 * f.d, low, high));
    // The rest of the fit is its change since mid-shutter.
    fit -= cm_record_fit(data);
  }
  vec2 density = cm_fit_along(fit, f, shape);
  r += cm_segment_between(density.x + density.y * t, density.x + density.y * t_1);
  return max(r, CmBernstein(0.0f));
}
#endif

CM_FN void cm_march_step(uvec3 cell, CmMarchRay ray, float t, CM_OUT(float) t_1, CM_OUT(CmBernstein) r,
                         CM_OUT(uvec3) next) {
  uvec4 links = cm_record(cell.x, 0u);
  uvec4 data = cm_record(cell.x, 1u);
  bool wide = cm_grid_is_wide();
  uint shape = cm_record_shape(data, wide);
  CmFrame frame = cm_cell_frame(cm_record_v0(data, wide), shape, ray.o, ray.d);
  vec4 faces = cm_face_distances(frame, shape);
  float t_exit = cm_nearest_face(faces);
  t_1 = max(t, t_exit);
#if CM_CUBIC
  r = cm_density_along(data, cell.x, frame, shape, t, t_1);
#elif CM_LINEAR
  vec2 density = cm_fit_along(cm_march_fit(data, cell.x), frame, shape);
  r.x = max(0.0f, density.x + density.y * t);
  r.y = max(0.0f, density.x + density.y * t_1);
#else
  r.x = cm_march_fit(data, cell.x).x;
#if CM_MOTION
  r.x = max(0.0f, r.x);  // halves are rounded
#endif
  r.y = r.x;
#endif
  uint link = cm_link_at(links, faces, t_exit);
  // Unchanged words need no select for lanes that stay in their cell.
  next = uvec3(cm_record_is_clear(data, ray.cone) ? CM_NONE : link, cell.y, cell.z);
}

#if CM_CHANNELS
CM_FN CmEmission cm_march_emission(uvec3 cell, vec3 o, vec3 d) {
  uvec4 data = cm_record(cell.x, 1u);
  CmEmission e;
  e.mean = vec3(0.0f, 0.0f, 0.0f);
  e.at_0 = 0.0f;
  e.slope = 0.0f;
  e.distance = 0.0f;
  if ((data.y & CM_RECORD_EMITS) != 0u) {
    bool wide = cm_grid_is_wide();
    uint shape = cm_record_shape(data, wide);
    e = cm_cell_emission(cm_emission_record(cell.x), cm_cell_frame(cm_record_v0(data, wide), shape, o, d), shape);
  }
  return e;
}

// p: the point in the cell, for grids whose values vary in a cell.
CM_FN vec3 cm_march_color(uvec2 cell, vec3 p) { return cm_cell_color(cm_color_record(cell.x)); }
CM_FN float cm_march_anisotropy(uvec2 cell, vec3 p) { return cm_cell_anisotropy(cm_anisotropy_record(cell.x), cell.x); }
#endif

#if CM_VELOCITY
CM_FN vec3 cm_march_velocity(uvec2 cell, vec3 p) { return cm_cell_velocity(cm_velocity_record(cell.x)); }
#endif

#endif
