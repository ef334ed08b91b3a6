// Density or extinction along a ray's segment in a cell: a polynomial of the position from 0 at the segment's start to
// 1 at its end. It is linear, or cubic between the centers of voxels: in march_voxel.glsl with CM_LINEAR, and in
// march_tet.glsl with CM_LINEAR 2. CmBernstein has its control points in Bernstein form: the first and the last are the
// values at both ends, and none is negative. Shared by GLSL and C++.
#ifndef CM_SEGMENT_GLSL
#define CM_SEGMENT_GLSL

#undef CM_CUBIC
#undef CmBernstein
#undef CM_CUBIC_EMISSION
#ifdef CM_MARCH
#define CM_CUBIC (CM_LINEAR == 2 || (CM_MARCH != 0 && CM_LINEAR != 0))
#define CM_CUBIC_EMISSION (CM_MARCH != 0 && CM_LINEAR != 0)
#else
#define CM_CUBIC 0
#define CM_CUBIC_EMISSION 0
#endif

#if CM_CUBIC
#define CmBernstein vec4

// The segment of a linear function, from its values at both ends.
CM_FN CmBernstein cm_segment_between(float at_0, float at_1) {
  float third = (at_1 - at_0) * 0.333333333f;
  return vec4(at_0, at_0 + third, at_1 - third, at_1);
}
CM_FN float cm_segment_end(CmBernstein b) { return b.w; }
CM_FN float cm_segment_mean(CmBernstein b) { return 0.25f * (b.x + b.y + b.z + b.w); }
CM_FN CmBernstein cm_segment_reversed(CmBernstein b) { return vec4(b.w, b.z, b.y, b.x); }

// The value at s, by de Casteljau's algorithm.
CM_FN float cm_segment_at(CmBernstein b, float s) {
  vec3 once = mix(vec3(b.x, b.y, b.z), vec3(b.y, b.z, b.w), s);
  vec2 twice = mix(vec2(once.x, once.y), vec2(once.y, once.z), s);
  return mix(twice.x, twice.y, s);
}

// The part from s_0 to s_1: values of the polar form.
CM_FN CmBernstein cm_segment_part(CmBernstein b, float s_0, float s_1) {
  vec3 at_0 = mix(vec3(b.x, b.y, b.z), vec3(b.y, b.z, b.w), s_0);
  vec3 at_1 = mix(vec3(b.x, b.y, b.z), vec3(b.y, b.z, b.w), s_1);
  vec2 at_00 = mix(vec2(at_0.x, at_0.y), vec2(at_0.y, at_0.z), s_0);
  vec2 at_11 = mix(vec2(at_1.x, at_1.y), vec2(at_1.y, at_1.z), s_1);
  return vec4(mix(at_00.x, at_00.y, s_0), mix(at_00.x, at_00.y, s_1), mix(at_11.x, at_11.y, s_0),
              mix(at_11.x, at_11.y, s_1));
}

// Optical depth of the first `way` of a ray's segment in a cell. span: the segment's length.
CM_FN float cm_depth_of(CmBernstein e, float span, float way) {
  float part = clamp(way / max(span, 1e-30f), 0.0f, 1.0f);
  return cm_segment_mean(cm_segment_part(e, 0.0f, part)) * part * span;
}

// Distance into a ray's segment in a cell at which this optical depth is used up. span: the segment's length. The depth
// is a quartic that only increases, so its root is in a bracket that Newton's method narrows; a step that leaves the
// bracket bisects it.
CM_FN float cm_depth_distance(CmBernstein e, float span, float depth) {
  float low = 0.0f;
  float high = 1.0f;
  float s = clamp(depth / max(cm_segment_mean(e) * span, 1e-30f), 0.0f, 1.0f);
  bool found = false;
  for (int i = 0; i < 32 && !found; ++i) {
    float excess = cm_depth_of(e, span, s * span) - depth;
    if (excess > 0.0f) {
      high = s;
    } else {
      low = s;
    }
    float next = s - excess / max(cm_segment_at(e, s) * span, 1e-30f);
    if (!(next >= low && next <= high)) next = 0.5f * (low + high);
    found = abs(next - s) <= 1e-7f;
    s = next;
  }
  return s * span;
}

#else
#define CmBernstein vec2

CM_FN float cm_segment_end(CmBernstein b) { return b.y; }
CM_FN float cm_segment_mean(CmBernstein b) { return 0.5f * (b.x + b.y); }
CM_FN CmBernstein cm_segment_reversed(CmBernstein b) { return vec2(b.y, b.x); }
CM_FN float cm_segment_at(CmBernstein b, float s) { return b.x + (b.y - b.x) * s; }
CM_FN CmBernstein cm_segment_part(CmBernstein b, float s_0, float s_1) {
  return vec2(cm_segment_at(b, s_0), cm_segment_at(b, s_1));
}

// Optical depth of the first `way` of a ray's segment in a cell. span: the segment's length.
CM_FN float cm_depth_of(CmBernstein e, float span, float way) {
  float part = clamp(way / max(span, 1e-30f), 0.0f, 1.0f);
  return (e.x + 0.5f * (e.y - e.x) * part) * part * span;
}

// Distance into a ray's segment in a cell at which this optical depth is used up. span: the segment's length. Solves
// e.x s + (e.y - e.x) s^2 / (2 span) = depth in the form without cancellation.
CM_FN float cm_depth_distance(CmBernstein e, float span, float depth) {
  float root = sqrt(max(0.0f, e.x * e.x + 2.0f * (e.y - e.x) / span * depth));
  return min(span, 2.0f * depth / (e.x + root));
}
#endif

#endif
