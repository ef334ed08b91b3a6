#version 450
// Views that show the grid rather than light: one deterministic ray a pixel through its centre.
// variant: CM_MARCH=0 CM_LINEAR=0 CM_PAGES=1
// variant: CM_MARCH=0 CM_LINEAR=1 CM_PAGES=8
// variant: CM_MARCH=1 CM_LINEAR=0 CM_PAGES=1
// variant: CM_MARCH=2 CM_LINEAR=0 CM_PAGES=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "shared.glsl"
#include "parameters.glsl"
#include "cell.glsl"
#include "random.glsl"
#include "phase.glsl"
#include "buffers.glsl"
#if CM_MARCH == 0
#include "march_tet.glsl"
#else
#include "march_voxel.glsl"
#endif
#include "path.glsl"

layout(rgba32f, binding = 0) uniform writeonly image2D cm_sum;
layout(rg32ui, binding = 1) uniform writeonly uimage2D cm_counts;

// Dark blue, teal, green, yellow: rises in lightness, so it reads without colour too.
vec3 cm_ramp(float x) {
  x = clamp(x, 0.0, 1.0);
  vec3 a = vec3(0.05, 0.03, 0.20);
  vec3 b = vec3(0.03, 0.25, 0.42);
  vec3 c = vec3(0.10, 0.55, 0.30);
  vec3 e = vec3(1.00, 0.85, 0.15);
  return x < 0.33 ? mix(a, b, x / 0.33) : (x < 0.66 ? mix(b, c, (x - 0.33) / 0.33) : mix(c, e, (x - 0.66) / 0.34));
}

// Distance within the cut plane (normal: cube axis) from its point p to a face n.x = c.
float cm_edge(vec3 n, float c, vec3 p, uint axis) {
  vec3 in_plane = n;
  if (axis == 0u) in_plane.x = 0.0;
  if (axis == 1u) in_plane.y = 0.0;
  if (axis == 2u) in_plane.z = 0.0;
  float slope = length(in_plane);
  return slope > 0.0 ? abs(c - dot(n, p)) / slope : 3.0e38;
}

// Colour of the cell at p and how far its edges are; levels count from the coarsest.
vec3 cm_show_cell(vec3 p, uint axis, float pixel_size) {
  uvec3 cell = cm_march_enter(p);
  float edge = 3.0e38;
  float level = 0.0;
  float density = 0.0;
#if CM_MARCH == 0
  uvec4 data = cm_record(cell.x, 1u);
  vec3 v0 = cm_record_v0(data);
  uint shape = cm_record_shape(data);
  uint cell_class = cm_shape_class(shape);
  vec3 q = cm_to_frame(p - v0, shape);
  float unit = cm_shape_unit(shape);
  vec3 normal[4] = vec3[4](vec3(0, 0, 1), vec3(1, -1, 0), vec3(0, 1, -1),
                           vec3(1, cell_class == 0u ? 1 : 0, cell_class == 2u ? 1 : 0));
  for (int i = 0; i < 4; ++i) {
    float c = i == 3 ? (cell_class == 1u ? unit : 2.0 * unit) : 0.0;
    vec3 n = cm_from_frame(normal[i], shape);
    edge = min(edge, cm_edge(n, c + dot(n, v0), p, axis));
  }
  float depth = 3.0 * float(cm.cube.x - cm_shape_exponent(shape)) +
                (cell_class == 0u ? 0.0 : (cell_class == 1u ? 1.0 : -1.0));
  level = depth / max(1.0, float(cm.cube.w));
  density = unpackHalf2x16(data.z).x;
#else
  vec3 low = vec3(cm_voxel_of(cell));
  for (int i = 0; i < 3; ++i) {
    vec3 n = vec3(i == 0, i == 1, i == 2);
    edge = min(edge, min(cm_edge(n, low[i], p, axis), cm_edge(n, low[i] + 1.0, p, axis)));
  }
  level = 1.0;
  float t_1, r_1;
  uvec3 next;
  vec3 d = vec3(1.0, 0.0, 0.0);
  cm_march_step(cell, p, d, 1.0 / d, 0.0, t_1, density, r_1, next);
#endif
  vec3 colour = cm_ramp(level) * (density > 0.0 ? 1.0 : 0.35) + 0.35 * density;
  return mix(vec3(0.0), colour, clamp(0.35 + 0.65 * edge / pixel_size, 0.35, 1.0));
}

void main() {
  uvec2 local = gl_GlobalInvocationID.xy;
  if (local.x >= cm.tile.z || local.y >= cm.tile.w) return;
  uvec2 pixel = cm.tile.xy + local;
  vec3 w = cm_camera_direction(pixel, vec2(0.5));
  CmPath p;
  p.o = cm.eye.xyz;
  p.d = cm_to_cube(w);
  p.steps = 0u;
  p.depth_0 = 3.0e38;
  p.depth = 3.0e38;
  vec3 colour = vec3(0.02);
  float alpha = 0.0;
  vec2 range = cm_box_range(p.o, p.d);
  bool hit = range.x < range.y;
  uint view = cm.march.y;
  if (view == 1u) {
    vec3 f = abs(cm_to_cube(cm.forward.xyz));
    uint axis = f.x >= f.y && f.x >= f.z ? 0u : (f.y >= f.z ? 1u : 2u);
    float middle = cm_pick(0.5 * (cm.box_min.xyz + cm.box_max.xyz), axis) + 0.217;  // off the lattice
    float t = (middle - cm_pick(p.o, axis)) / cm_pick(p.d, axis);
    if (hit && t > range.x && t < range.y) {
      float pixel_size = t * length(p.d) * 2.0 * length(cm.up.xyz) / float(cm.image.y);
      colour = cm_show_cell(p.o + t * p.d, axis, pixel_size);
      alpha = 1.0;
    }
  } else if (hit) {
    float used = 0.0;
    float t = range.x;
    uvec3 cell = cm_march_enter(clamp(p.o + t * p.d, cm.box_min.xyz, cm.box_max.xyz));
    vec3 inv_d = 1.0 / p.d;
    for (int i = 0; i < 100000 && cell.x != CM_NONE && t < range.y; ++i) {
      float t_1, r_0, r_1;
      uvec3 next;
      cm_march_step(cell, p.o, p.d, inv_d, t, t_1, r_0, r_1, next);
      used += 0.5 * cm.medium.x * (r_0 + r_1) * (t_1 - t);
      t = t_1;
      cell = next;
      p.steps += 1u;
    }
    alpha = 1.0 - exp(-used);
    // Steps: each doubling is a tenth of the ramp, 1024 its end.
    colour = view == 2u ? cm_ramp(log2(1.0 + float(p.steps)) * 0.1) : vec3(alpha);
  }
  imageStore(cm_sum, ivec2(pixel), vec4(colour, alpha));
  imageStore(cm_counts, ivec2(pixel), uvec4(1u, p.steps, 0u, 0u));
}
