#version 450
// A light's transmittance map (cumulet_update_transmittance_map): the transmittance from the light through all volumes
// to the points of a lattice, slice by slice along its rays. This is a deep shadow map (Lokovic and Veach 2000) at
// uniform depths, in closed form per cell and without noise. Parallel rays are those of an orthographic view from the
// light. Rays of a point light use octahedral mapping (octahedron.glsl). Texels lie on its folds, so that filtering
// across a fold mixes equal rays.
// variants: VOLUME or VOLUMES or VOLUMES CM_CLIP=1
layout(local_size_x = 8, local_size_y = 8) in;

#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "common/parameters.glsl"
#include "grid/cell.glsl"
#include "common/buffers.glsl"
#include "traversal/march.glsl"
#include "traversal/ray.glsl"
#include "common/octahedron.glsl"
#include "traversal/walk.glsl"

layout(r16f, binding = CM_IMAGE_TRANSMITTANCE_MAP) uniform writeonly image3D cm_map;
layout(location = 0) uniform bool cm_from_point;
layout(location = 1) uniform vec2 cm_range;  // world: distances of the first and the last slice along a ray

void main() {
  uvec2 texel = gl_GlobalInvocationID.xy + uvec2(0u, cm.dispatch.rows.x);
  if (texel.x >= cm.dispatch.tile_size.x || texel.y >= cm.dispatch.rows.y) return;
  vec3 o;
  vec3 w;
  cm_camera_ray(texel, vec2(0.5), o, w);
  if (cm_from_point) {
    w = cm_from_octahedron(2.0 * vec2(texel) / vec2(cm.dispatch.tile_size - 1u) - 1.0);
  }
  int slices = imageSize(cm_map).z;
  float step_t = (cm_range.y - cm_range.x) / float(slices - 1);
  int slice = 0;
  float used = 0.0;
  // Volumes hidden from cameras still cast shadows.
  CmWalk walk = cm_walk(o, cm_to_cube(w), cm_range.y, false);
  for (int i = 0; i < 100000 && slice < slices; ++i) {
    float t_1;
    CmBernstein e;
    if (!cm_walk_part(walk, t_1, e)) break;
    float span = t_1 - walk.t;
    for (; slice < slices; ++slice) {
      float t = cm_range.x + step_t * float(slice);
      if (t >= t_1) break;
      float here = used + cm_depth_of(e, span, t - walk.t);
      imageStore(cm_map, ivec3(texel, slice), vec4(exp(-here)));
    }
    used += cm_segment_mean(e) * span;
    cm_walk_on(walk, t_1);
  }
  for (; slice < slices; ++slice) imageStore(cm_map, ivec3(texel, slice), vec4(exp(-used)));
}
