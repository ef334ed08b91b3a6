#version 450
// Views of the grid, and the depth at half opacity, by one deterministic ray through each pixel's center.
// variants: VOLUME or VOLUMES or VOLUMES CM_CLIP=1
// variants: - or CM_SURFACES=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/random.glsl"
#include "path/phase.glsl"
#include "common/buffers.glsl"
#include "traversal/march.glsl"
#if CM_SURFACES
#define CM_BVH_SHARED_STACK 64u
#include "surface/surface.glsl"
#endif
#include "traversal/ray.glsl"
#include "traversal/walk.glsl"

layout(rgba32f, binding = CM_IMAGE_SUM) uniform writeonly image2D cm_sum;
layout(rg32ui, binding = CM_IMAGE_COUNTS) uniform writeonly uimage2D cm_counts;
layout(r32f, binding = CM_IMAGE_VOLUME_Z) uniform writeonly image2D cm_volume_z;

#define CM_VIEW_CELLS 1u
#define CM_VIEW_STEPS 2u
#define CM_VIEW_DENSITY 3u
#define CM_VIEW_WIREFRAME 4u
#define CM_VIEW_DEPTH 5u

// Dark blue, teal, green, yellow: lightness increases, so the ramp is readable without color.
vec3 cm_ramp(float x) {
  x = clamp(x, 0.0, 1.0);
  vec3 a = vec3(0.05, 0.03, 0.20);
  vec3 b = vec3(0.03, 0.25, 0.42);
  vec3 c = vec3(0.10, 0.55, 0.30);
  vec3 e = vec3(1.00, 0.85, 0.15);
  return x < 0.33 ? mix(a, b, x / 0.33) : (x < 0.66 ? mix(b, c, (x - 0.33) / 0.33) : mix(c, e, (x - 0.66) / 0.34));
}

// Distance within the slice plane (normal: cube axis) from its point p to a face n.x = c.
float cm_edge(vec3 n, float c, vec3 p, uint axis) {
  vec3 in_plane = n;
  if (axis == 0u) in_plane.x = 0.0;
  if (axis == 1u) in_plane.y = 0.0;
  if (axis == 2u) in_plane.z = 0.0;
  float slope = length(in_plane);
  return slope > 0.0 ? abs(c - dot(n, p)) / slope : 3.0e38;
}

// The four planes n.x = c of a cell, and its level from 0 (coarsest) to 1.
struct CmFaces {
  vec3 normal[4];
  float c[4];
  int count;
  float level;
  float size;
};

CmFaces cm_faces(uvec3 cell, vec3 p) {
  CmFaces faces;
#if CM_MARCH == 0
  uvec4 data = cm_record(cell.x, 1u);
  bool wide = cm_grid_is_wide();
  vec3 v0 = cm_record_v0(data, wide);
  uint shape = cm_record_shape(data, wide);
  uint cell_class = cm_shape_class(shape);
  float unit = cm_shape_unit(shape);
  vec3 normal[4] = vec3[4](vec3(0, 0, 1), vec3(1, -1, 0), vec3(0, 1, -1),
                           vec3(1, cell_class == 0u ? 1 : 0, cell_class == 2u ? 1 : 0));
  for (int i = 0; i < 4; ++i) {
    faces.normal[i] = cm_from_frame(normal[i], shape);
    faces.c[i] = (i == 3 ? (cell_class == 1u ? unit : 2.0 * unit) : 0.0) + dot(faces.normal[i], v0);
  }
  faces.count = 4;
  float depth = 3.0 * float(CM_GRID.root_exponent - cm_shape_exponent(shape)) +
                (cell_class == 0u ? 0.0 : (cell_class == 1u ? 1.0 : -1.0));
  faces.level = depth / max(1.0, float(CM_GRID.levels));
  faces.size = unit;
#else
  // The three faces of a voxel nearest to p; others are too far away to matter.
  vec3 low = vec3(cm_voxel_of(cell));
  vec3 high = low + 1.0;
  bvec3 upper = greaterThan(p - low, vec3(0.5));
  for (int i = 0; i < 3; ++i) {
    faces.normal[i] = vec3(i == 0, i == 1, i == 2);
    faces.c[i] = upper[i] ? high[i] : low[i];
  }
  faces.normal[3] = faces.normal[2];
  faces.c[3] = faces.c[2];
  faces.count = 3;
  faces.level = 1.0;
  faces.size = 1.0;
#endif
  return faces;
}

float cm_density_at(uvec3 cell, vec3 p) {
  float t_1;
  CmBernstein r;
  uvec3 next;
  cm_march_step(cell, cm_march_ray(p, vec3(1.0, 0.0, 0.0)), 0.0, t_1, r, next);
  return r.x;
}

// Color of the ray's cell at t, darkened towards its edges. pixel_size: in world space.
vec3 cm_show_cell(inout CmWalk walk, float t, uint axis, float pixel_size) {
  CmFront front = walk.front[0];
  cm_stand_at(front);
  vec3 d = cm_in_volume(walk.d);
  vec3 p = cm_in_volume_point(walk.o) + t * d;
  CmFaces faces = cm_faces(front.cell, p);
  float edge = 3.0e38;
  for (int i = 0; i < faces.count; ++i) edge = min(edge, cm_edge(faces.normal[i], faces.c[i], p, axis));
  float density = cm_density_at(front.cell, p);
  vec3 color = cm_ramp(faces.level) * (density > 0.0 ? 1.0 : 0.35) + 0.35 * density;
  return mix(vec3(0.0), color, clamp(0.35 + 0.65 * edge / (pixel_size * length(d)), 0.35, 1.0));
}

// Distance of p, on one of the cell's faces, to that face's nearest edge.
float cm_face_edge(CmFaces faces, vec3 p) {
  int face = 0;
  float nearest = 3.0e38;
  for (int i = 0; i < faces.count; ++i) {
    float distance = abs(faces.c[i] - dot(faces.normal[i], p)) * inversesqrt(dot(faces.normal[i], faces.normal[i]));
    if (distance < nearest) {
      nearest = distance;
      face = i;
    }
  }
  vec3 m = normalize(faces.normal[face]);
  float edge = 3.0e38;
  for (int i = 0; i < faces.count; ++i) {
    vec3 in_plane = faces.normal[i] - dot(faces.normal[i], m) * m;
    float slope = length(in_plane);
    if (i != face && slope > 1e-4) edge = min(edge, abs(faces.c[i] - dot(faces.normal[i], p)) / slope);
  }
  return edge;
}

void main() {
  uvec2 local = gl_GlobalInvocationID.xy + uvec2(0u, cm.dispatch.rows.x);
  if (local.x >= cm.dispatch.tile_size.x || local.y >= cm.dispatch.rows.y) return;
  uvec2 pixel = cm.dispatch.tile_corner + local;
  uint view = cm.dispatch.view;
  vec3 o;
  vec3 w;
  float t_per_z = cm_camera_ray(pixel, vec2(0.5), o, w);
  vec3 d = cm_to_cube(w);
  uint steps = 0u;
  vec3 color = vec3(0.02);
  float alpha = 0.0;
  float half_t = 0.0;
  uint densest = 0u;
  float surface_t = t_per_z * cm_surface_z(pixel, vec2(0.5), 0u);
#if CM_SURFACES
  CmHit triangle;
  cm_hit_camera = true;
  bool solid = cm_trace_models(cm_from_cube_point(o), w, 0.0, surface_t, false, triangle);
  if (solid) surface_t = triangle.t;
#endif
  // Width of a pixel in world space; per unit of t if perspective.
  float footprint = 2.0 * length(cm.view.up) / float(cm.view.size.y);
  CmWalk walk = cm_walk(o, d, surface_t, true);
  bool hit = walk.entry < 3.0e38;
  if (view == CM_VIEW_CELLS) {
    vec3 f = abs(cm_to_cube(cm.view.forward));
    uint axis = f.x >= f.y && f.x >= f.z ? 0u : (f.y >= f.z ? 1u : 2u);
    float middle = cm_pick(0.5 * (cm.space.box_min + cm.space.box_max), axis) + 0.217;  // not on a lattice plane
    float t = (middle - cm_pick(o, axis)) / cm_pick(d, axis);
    if (hit && t > walk.entry && t < walk.t_end && cm_walk_to(walk, t)) {
      float pixel_size = footprint * (cm.view.orthographic != 0u ? 1.0 : t);
      color = cm_show_cell(walk, t, axis, pixel_size);
      alpha = 1.0;
    }
  } else if (hit) {
    float used = 0.0;
    vec3 lines = vec3(0.0);
    float clear = 1.0;
    float t_1;
    CmBernstein e;
    for (int i = 0; i < 100000 && clear > 0.02 && cm_walk_part(walk, t_1, e); ++i) {
      float t = walk.t;
      float span = t_1 - t;
      float depth = cm_segment_mean(e) * span;
      if (view == CM_VIEW_DEPTH && used + depth >= 0.69314718) {
        half_t = t + cm_depth_distance(e, span, 0.69314718 - used);
        if (half_t >= walk.t_end) half_t = 0.0;
        densest = cm_walk_densest(walk, half_t);
        break;
      }
      if (view == CM_VIEW_WIREFRAME) {
        float line = 0.0;
        float level = 0.0;
        float size = max(footprint * (cm.view.orthographic != 0u ? 1.0 : t), 1e-20);
        for (int k = 0; CM_IS_FRONT(k, walk); ++k) {
          CmFront front = walk.front[k];
          if (front.t_0 != t || !(cm_segment_mean(front.e) > 0.0)) continue;
          cm_stand_at(front);
          vec3 along = cm_in_volume(walk.d);
          vec3 at = cm_in_volume_point(walk.o) + t * along;
          CmFaces faces = cm_faces(front.cell, at);
          float here = size * length(along);
          // Edges of cells only a few pixels wide would cover everything, so they fade out.
          float of_front =
              clamp(1.2 - cm_face_edge(faces, at) / here, 0.0, 1.0) * smoothstep(0.0, 12.0, faces.size / here);
          if (of_front > line) level = faces.level;
          line = max(line, of_front);
        }
        lines += clear * 0.8 * line * cm_ramp(level);
        clear *= (1.0 - 0.8 * line) * exp(-depth);
      }
      used += depth;
      cm_walk_on(walk, t_1);
      steps += 1u;
    }
    alpha = 1.0 - exp(-used);
    // Steps: each doubling is a tenth of the ramp; 1024 is its end.
    color = view == CM_VIEW_STEPS ? cm_ramp(log2(1.0 + float(steps)) * 0.1) : vec3(alpha);
    if (view == CM_VIEW_WIREFRAME) color = lines + clear * vec3(0.02) + 0.04 * alpha;
  }
  if (view == CM_VIEW_DEPTH) {
    bool hit_volume = half_t > 0.0;
    uvec4 object = uvec4(hit_volume ? 1u : 0u, densest, 0u, 0u);
#if CM_SURFACES
    if (solid && !hit_volume) {
      half_t = triangle.t;
      object = uvec4(2u, triangle.triangle, 0u, 0u);
    }
#endif
    if (cm.dispatch.picks != 0u) imageStore(cm_counts, ivec2(local), object);
    imageStore(cm_volume_z, ivec2(cm.dispatch.picks != 0u ? local : pixel), vec4(half_t / t_per_z));
    return;
  }
  imageStore(cm_sum, ivec2(pixel), vec4(color, alpha));
  imageStore(cm_counts, ivec2(pixel), uvec4(1u, steps, 0u, 0u));
}
