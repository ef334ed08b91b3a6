// A cell of the bisected cube: its shape, its record, its children and its faces. Shared by GLSL and C++.
//
// Every cell is one of three tetrahedra in a frame of its own: origin at its vertex v0, axes a signed permutation of
// the cube's, unit 2^exponent voxels.
//
//   class 0 (A)  v0 (0,0,0)  v1 (2,0,0)  v2 (1,1,0)  v3 (1,1,1)   refinement edge: cube edge
//   class 1 (B)  v0 (0,0,0)  v1 (1,1,1)  v2 (1,1,0)  v3 (1,0,0)   refinement edge: body diagonal
//   class 2 (C)  v0 (0,0,0)  v1 (2,2,0)  v2 (2,0,0)  v3 (1,1,1)   refinement edge: face diagonal
//
// v0 v1 is always the longest edge, which bisection halves. All three lie in 0 <= z <= y <= x and differ only in the
// fourth face, the cap: x + y <= 2 (A), x <= 1 (B), x + z <= 2 (C). 3 classes x 48 frames are the 144 shapes of
// docs/architecture.md. Faces are numbered 0: z >= 0, 1: x >= y, 2: y >= z, 3: the cap.
//
// Shape word: bits 0-2 signs of the frame axes x, y, z; bits 3-4, 5-6, 7-8 cube axis of the frame axes x, y, z; bits
// 9-10 class; bits 11 and up exponent, at most 17.
#ifndef CM_CELL_GLSL
#define CM_CELL_GLSL

#define CM_NONE 0xffffffffu

CM_FN uint cm_shape_class(uint shape) { return (shape >> 9) & 3u; }
CM_FN uint cm_shape_exponent(uint shape) { return shape >> 11; }
// 2^exponent and 2^-exponent, exact.
CM_FN float cm_shape_unit(uint shape) { return uintBitsToFloat((127u + cm_shape_exponent(shape)) << 23); }
CM_FN float cm_shape_inverse_unit(uint shape) {
  return uintBitsToFloat(0x7f000000u - floatBitsToUint(cm_shape_unit(shape)));
}

// Log2 of the size of the octree cube that the cell belongs to.
CM_FN uint cm_shape_cube_size(uint shape) { return cm_shape_exponent(shape) + (cm_shape_class(shape) == 1u ? 0u : 1u); }

CM_FN float cm_pick(vec3 v, uint axis) { return axis == 0u ? v.x : (axis == 1u ? v.y : v.z); }
// Flips the sign of value if the lowest bit of sign_bit is set.
CM_FN float cm_signed(float value, uint sign_bit) {
  return uintBitsToFloat(floatBitsToUint(value) ^ (sign_bit << 31));
}

// Converts a vector from cube space to the cell's frame, without scaling; exact. The cube axis of the frame axis z is
// the remaining one, so its bits are not read.
CM_FN vec3 cm_to_frame(vec3 v, uint shape) {
  bool x_is_x = (shape & 0x18u) == 0u;
  bool x_is_y = (shape & 0x18u) == 0x08u;
  bool y_is_x = (shape & 0x60u) == 0u;
  bool y_is_y = (shape & 0x60u) == 0x20u;
  float x = x_is_x ? v.x : (x_is_y ? v.y : v.z);
  float y = y_is_x ? v.x : (y_is_y ? v.y : v.z);
  float z = !(x_is_x || y_is_x) ? v.x : (!(x_is_y || y_is_y) ? v.y : v.z);
  return vec3(cm_signed(x, shape), cm_signed(y, shape >> 1), cm_signed(z, shape >> 2));
}

// The inverse of cm_to_frame.
CM_FN vec3 cm_from_frame(vec3 v, uint shape) {
  float x = cm_signed(v.x, shape);
  float y = cm_signed(v.y, shape >> 1);
  float z = cm_signed(v.z, shape >> 2);
  uint px = (shape >> 3) & 3u;
  uint py = (shape >> 5) & 3u;
  return vec3(px == 0u ? x : (py == 0u ? y : z), px == 1u ? x : (py == 1u ? y : z), px == 2u ? x : (py == 2u ? y : z));
}

// Vertex i in the frame, in units.
CM_FN vec3 cm_frame_vertex(uint cell_class, uint i) {
  if (i == 0u) return vec3(0.0f, 0.0f, 0.0f);
  if (cell_class == 0u) return vec3(i == 1u ? 2.0f : 1.0f, i == 1u ? 0.0f : 1.0f, i == 3u ? 1.0f : 0.0f);
  if (cell_class == 1u) return vec3(1.0f, i == 3u ? 0.0f : 1.0f, i == 1u ? 1.0f : 0.0f);
  return vec3(i == 3u ? 1.0f : 2.0f, i == 1u ? 2.0f : (i == 2u ? 0.0f : 1.0f), i == 3u ? 1.0f : 0.0f);
}

// Midpoint of the refinement edge in the frame, in units.
CM_FN vec3 cm_frame_midpoint(uint cell_class) {
  if (cell_class == 0u) return vec3(1.0f, 0.0f, 0.0f);
  if (cell_class == 1u) return vec3(0.5f, 0.5f, 0.5f);
  return vec3(1.0f, 1.0f, 0.0f);
}

// Centroid in the frame, in units.
CM_FN vec3 cm_frame_centroid(uint cell_class) {
  return vec3(cell_class == 0u ? 1.0f : (cell_class == 1u ? 0.75f : 1.25f), cell_class == 2u ? 0.75f : 0.5f, 0.25f);
}

CM_FN vec3 cm_cell_vertex(vec3 v0, uint shape, uint i) {
  return v0 + cm_from_frame(cm_frame_vertex(cm_shape_class(shape), i) * cm_shape_unit(shape), shape);
}

// Shape of child 0 (which keeps v0 and the frame) or child 1 (whose v0 is the parent's v1).
//   A -> B: child 1 flips x.   B -> C, half the unit: child 1 has axes (-z, -y, -x).   C -> A: child 1 has (-y, -x, z).
CM_FN uint cm_child_shape(uint shape, uint child) {
  uint cell_class = cm_shape_class(shape);
  uint frame = shape & 0x1ffu;
  if (child == 1u) {
    uint sx = frame & 1u;
    uint sy = (frame >> 1) & 1u;
    uint sz = (frame >> 2) & 1u;
    uint px = (frame >> 3) & 3u;
    uint py = (frame >> 5) & 3u;
    uint pz = (frame >> 7) & 3u;
    if (cell_class == 0u) {
      frame = frame ^ 1u;
    } else if (cell_class == 1u) {
      frame = (1u - sz) | ((1u - sy) << 1) | ((1u - sx) << 2) | (pz << 3) | (py << 5) | (px << 7);
    } else {
      frame = (1u - sy) | ((1u - sx) << 1) | (sz << 2) | (py << 3) | (px << 5) | (pz << 7);
    }
  }
  uint exponent = cm_shape_exponent(shape) - (cell_class == 1u ? 1u : 0u);
  uint child_class = cell_class == 2u ? 0u : cell_class + 1u;
  return frame | (child_class << 9) | (exponent << 11);
}

// Returns true if a point (relative to v0, in the frame, in units) lies on child 1's side of the bisecting plane: x = 1
// (A), x + z = 1 (B), x + y = 2 (C).
CM_FN bool cm_on_child_1(uint cell_class, vec3 p) {
  if (cell_class == 0u) return p.x > 1.0f;
  if (cell_class == 1u) return p.x + p.z > 1.0f;
  return p.x + p.y > 2.0f;
}

// Returns which of the root cube's 24 cells contains p, for the cube [0, 2 half_size]^3: 4 * cube face + edge of that
// face.
CM_FN uint cm_root_of(vec3 p, float half_size) {
  vec3 r = p - vec3(half_size, half_size, half_size);
  vec3 a = abs(r);
  uint axis = a.x >= a.y && a.x >= a.z ? 0u : (a.y >= a.z ? 1u : 2u);
  uint axis_1 = axis == 0u ? 1u : 0u;
  uint axis_2 = axis == 2u ? 1u : 2u;
  float r_1 = cm_pick(r, axis_1);
  float r_2 = cm_pick(r, axis_2);
  bool first = abs(r_1) >= abs(r_2);
  uint edge = first ? (r_1 >= 0.0f ? 1u : 0u) : (r_2 >= 0.0f ? 3u : 2u);
  return axis * 8u + (cm_pick(r, axis) >= 0.0f ? 4u : 0u) + edge;
}

// v0 and shape of a root cell. The center of its face is on cube face root / 4, its edge on side root % 4 of that face.
CM_FN void cm_root_cell(uint root, uint exponent, CM_OUT(vec3) v0, CM_OUT(uint) shape) {
  uint axis = root / 8u;
  uint axis_1 = axis == 0u ? 1u : 0u;
  uint axis_2 = axis == 2u ? 1u : 2u;
  bool high = (root & 4u) != 0u;
  bool first = (root & 2u) == 0u;
  bool edge_high = (root & 1u) != 0u;
  uint across = first ? axis_1 : axis_2;
  uint along = first ? axis_2 : axis_1;
  float size = 2.0f * uintBitsToFloat((127u + exponent) << 23);
  v0 = vec3(0.0f, 0.0f, 0.0f);
  v0 += (high ? size : 0.0f) * vec3(axis == 0u ? 1.0f : 0.0f, axis == 1u ? 1.0f : 0.0f, axis == 2u ? 1.0f : 0.0f);
  v0 += (edge_high ? size : 0.0f) *
        vec3(across == 0u ? 1.0f : 0.0f, across == 1u ? 1.0f : 0.0f, across == 2u ? 1.0f : 0.0f);
  // Frame: x along the edge, y from the edge to the face's center, z from there to the cube's center.
  shape = (edge_high ? 2u : 0u) | (high ? 4u : 0u) | (along << 3) | (across << 5) | (axis << 7) | (exponent << 11);
}

// A record has 32 bytes: links (the 4 neighbors across faces 0 to 3, CM_NONE outside) and data. data.xy: v0 and shape;
// CM_RECORD_EMITS is set in y if the cell emits light (glsl/grid/channels.glsl). data.z: half2(density at the centroid,
// gradient x). data.w: half2(gradient y, z). The gradient is along the frame's axes per unit; density is relative to
// the volume's maximum. If z is 0 the cell is empty, and w has its clear cones (glsl/grid/clear_cones.glsl) instead.
#define CM_RECORD_EMITS 0x80000000u
// For cubes up to 2^15: x = v0.x | v0.y << 16, y = v0.z | shape << 16.
CM_FN vec3 cm_record_v0(uvec4 data) {
  return vec3(float(data.x & 0xffffu), float(data.x >> 16), float(data.y & 0xffffu));
}
CM_FN uint cm_record_shape(uvec4 data) { return (data.y >> 16) & 0x7fffu; }

// For wider cubes, up to 2^18, the corner at (1,1,1) of the frame replaces v0. It lies in the cube, and is an odd
// multiple of the cell's unit along each axis, so that it also encodes the exponent. x = corner.x | corner.y << 18, y =
// corner.y >> 14 | corner.z << 4 | frame << 22 | class << 29. The frame has the signs and the cube axes of x and y.
CM_FN bool cm_is_wide(uint root_exponent) { return root_exponent > 14u; }
CM_FN uint cm_wide_shape(uvec4 data) {
  uint frame = (data.y >> 22) & 0x7fu;
  uint axis_z = 3u - ((frame >> 3) & 3u) - (frame >> 5);
  return frame | (axis_z << 7) | (((data.y >> 29) & 3u) << 9) | (uint(findLSB(int(data.x & 0x3ffffu))) << 11);
}
CM_FN vec3 cm_wide_v0(uvec4 data) {
  vec3 corner = vec3(float(data.x & 0x3ffffu), float((data.x >> 18) | ((data.y & 15u) << 14)),
                     float((data.y >> 4) & 0x3ffffu));
  uint shape = cm_wide_shape(data);
  float unit = cm_shape_unit(shape);
  return corner - cm_from_frame(vec3(unit, unit, unit), shape);
}

// Decoding of either format.
CM_FN vec3 cm_record_v0(uvec4 data, bool wide) { return wide ? cm_wide_v0(data) : cm_record_v0(data); }
CM_FN uint cm_record_shape(uvec4 data, bool wide) { return wide ? cm_wide_shape(data) : cm_record_shape(data); }
// Encodes the x and y of a record's data.
CM_FN uvec2 cm_pack_v0_shape(vec3 v0, uint shape, bool wide) {
  if (!wide) return uvec2(uint(v0.x) | (uint(v0.y) << 16), uint(v0.z) | (shape << 16));
  float unit = cm_shape_unit(shape);
  vec3 corner = v0 + cm_from_frame(vec3(unit, unit, unit), shape);
  uint y = uint(corner.y);
  return uvec2(uint(corner.x) | (y << 18),
               (y >> 14) | (uint(corner.z) << 4) | ((shape & 0x7fu) << 22) | (cm_shape_class(shape) << 29));
}

// A ray and a cell's v0 in the cell's frame, not scaled.
struct CmFrame {
  vec3 v0;
  vec3 o;
  vec3 d;
};
CM_FN CmFrame cm_cell_frame(vec3 v0, uint shape, vec3 o, vec3 d) {
  CmFrame f;
  f.v0 = cm_to_frame(v0, shape);
  f.o = cm_to_frame(o, shape);
  f.d = cm_to_frame(d, shape);
  return f;
}

// Distances along a ray to a cell's faces: (c - n.o) / (n.d) if n.d > 0, else CM_FAR_FACE. Both cells of a face round
// alike, so neighbors agree bit for bit.
#define CM_FAR_FACE 3.0e38f
CM_FN vec4 cm_face_distances(CmFrame f, uint shape) {
  uint cell_class = cm_shape_class(shape);
  float unit = cm_shape_unit(shape);
  bool cap_y = cell_class == 0u;
  bool cap_z = cell_class == 2u;
  float cap_a = cap_y ? f.v0.y : (cap_z ? f.v0.z : 0.0f);
  float cap_o = cap_y ? f.o.y : (cap_z ? f.o.z : 0.0f);
  float cap_d = cap_y ? f.d.y : (cap_z ? f.d.z : 0.0f);
  // Precise, so that both cells of a face round its distance alike.
  CM_PRECISE float n_d_0 = -f.d.z;
  CM_PRECISE float n_d_1 = f.d.y - f.d.x;
  CM_PRECISE float n_d_2 = f.d.z - f.d.y;
  CM_PRECISE float n_d_3 = f.d.x + cap_d;
  CM_PRECISE float t_0 = n_d_0 > 0.0f ? (f.o.z - f.v0.z) / n_d_0 : CM_FAR_FACE;
  CM_PRECISE float t_1 = n_d_1 > 0.0f ? ((f.v0.y - f.v0.x) - (f.o.y - f.o.x)) / n_d_1 : CM_FAR_FACE;
  CM_PRECISE float t_2 = n_d_2 > 0.0f ? ((f.v0.z - f.v0.y) - (f.o.z - f.o.y)) / n_d_2 : CM_FAR_FACE;
  CM_PRECISE float cap_c = (f.v0.x + cap_a) + (cell_class == 1u ? unit : 2.0f * unit);
  CM_PRECISE float t_3 = n_d_3 > 0.0f ? (cap_c - (f.o.x + cap_o)) / n_d_3 : CM_FAR_FACE;
  return vec4(t_0, t_1, t_2, t_3);
}
// Distance at which the ray leaves the cell; CM_FAR_FACE for a ray that never does (d = 0).
CM_FN float cm_nearest_face(vec4 t) { return min(min(t.x, t.y), min(t.z, t.w)); }

CM_FN uint cm_link(uvec4 links, uint face) {
  return face == 0u ? links.x : (face == 1u ? links.y : (face == 2u ? links.z : (face == 3u ? links.w : CM_NONE)));
}

// Link of the face at distance t_exit, one of t.
CM_FN uint cm_link_at(uvec4 links, vec4 t, float t_exit) {
  return t_exit == t.x ? links.x : (t_exit == t.y ? links.y : (t_exit == t.z ? links.z : links.w));
}

// Unpacks the last two data words: density at the centroid, and gradient.
CM_FN vec4 cm_fit(uint low_word, uint high_word) {
  vec2 low = unpackHalf2x16(low_word);
  vec2 high = unpackHalf2x16(high_word);
  return vec4(low.x, low.y, high.x, high.y);
}

CM_FN vec4 cm_record_fit(uvec4 data) { return cm_fit(data.z, data.z == 0u ? 0u : data.w); }
// Returns true if the cell has neither density nor emission.
CM_FN bool cm_record_is_empty(uvec4 data) { return data.z == 0u && (data.y & CM_RECORD_EMITS) == 0u; }
CM_FN bool cm_record_is_clear(uvec4 data, uint cone) { return data.z == 0u && (data.w & cone) != 0u; }

// Density at o + t d as a linear function of t: x: value at t = 0, y: slope.
CM_FN vec2 cm_fit_along(vec4 fit, CmFrame f, uint shape) {
  float inverse_unit = cm_shape_inverse_unit(shape);
  vec3 gradient = vec3(fit.y, fit.z, fit.w);
  vec3 from_centroid = (f.o - f.v0) * inverse_unit - cm_frame_centroid(cm_shape_class(shape));
  return vec2(fit.x + dot(gradient, from_centroid), dot(gradient, f.d) * inverse_unit);
}

// Relative density of a record along the ray, in the same form.
CM_FN vec2 cm_cell_density(uvec4 data, CmFrame f, uint shape) { return cm_fit_along(cm_record_fit(data), f, shape); }

#endif
