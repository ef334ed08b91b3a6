// Trilinear interpolation between the eight voxels at the corners of a cell, for CM_LINEAR of the voxel grids and
// CM_LINEAR 2 of tetrahedra (docs/architecture/interpolation.md). Shared by GLSL and C++.
#ifndef CM_TRILINEAR_GLSL
#define CM_TRILINEAR_GLSL

// Corners at x = 0 and at x = 1; in each, y is the slower axis: (0,0), (0,1), (1,0), (1,1).
struct CmCellCorners {
  vec4 low;
  vec4 high;
};

CM_FN CmCellCorners cm_no_corners() {
  CmCellCorners corners;
  corners.low = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  corners.high = corners.low;
  return corners;
}

// Offset of corner i of a cell, from 0 to 7.
CM_FN ivec3 cm_corner_offset(int i) { return ivec3(i >> 2, (i >> 1) & 1, i & 1); }
CM_FN float cm_corner(CmCellCorners c, int i) { return i < 4 ? c.low[i & 3] : c.high[i & 3]; }
CM_FN void cm_set_corner(CM_INOUT(CmCellCorners) c, int i, float value) {
  if (i < 4) {
    c.low[i & 3] = value;
  } else {
    c.high[i & 3] = value;
  }
}

// Weight of corner i at a point of the cell; at: from 0 to 1 along each axis.
CM_FN float cm_corner_weight(int i, vec3 at) {
  vec3 far = vec3(cm_corner_offset(i));
  vec3 weight = mix(vec3(1.0f, 1.0f, 1.0f) - at, at, far);
  return weight.x * weight.y * weight.z;
}

CM_FN float cm_trilinear(CmCellCorners c, vec3 at) {
  vec4 in_x = mix(c.low, c.high, at.x);
  vec2 in_y = mix(vec2(in_x.x, in_x.y), vec2(in_x.z, in_x.w), at.y);
  return mix(in_y.x, in_y.y, at.z);
}

// The control points of the cubic along the segment from p to q: values of its polar form, which are the means of the
// trilinear function at points whose coordinates are p's and q's. Each is a convex combination of the corners.
CM_FN vec4 cm_trilinear_along(CmCellCorners c, vec3 p, vec3 q) {
  vec4 p_x = mix(c.low, c.high, p.x);
  vec4 q_x = mix(c.low, c.high, q.x);
  vec2 pp = mix(vec2(p_x.x, p_x.y), vec2(p_x.z, p_x.w), p.y);
  vec2 pq = mix(vec2(p_x.x, p_x.y), vec2(p_x.z, p_x.w), q.y);
  vec2 qp = mix(vec2(q_x.x, q_x.y), vec2(q_x.z, q_x.w), p.y);
  vec2 qq = mix(vec2(q_x.x, q_x.y), vec2(q_x.z, q_x.w), q.y);
  const float third = 0.333333333f;
  float one = mix(qp.x, qp.y, p.z) + mix(pq.x, pq.y, p.z) + mix(pp.x, pp.y, q.z);
  float two = mix(pq.x, pq.y, q.z) + mix(qp.x, qp.y, q.z) + mix(qq.x, qq.y, p.z);
  return vec4(mix(pp.x, pp.y, p.z), third * one, third * two, mix(qq.x, qq.y, q.z));
}

#endif
