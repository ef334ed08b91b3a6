#version 450
// A vertex of the scene, seen from the eye; row 0 of the target is the picture's top.
#include "bindings.glsl"
#include "shared.glsl"
#include "surface_parameters.glsl"

layout(location = 0) in vec3 cm_position;  // world
layout(location = 1) in vec3 cm_normal;
layout(location = 2) in vec4 cm_tangent;
layout(location = 3) in vec4 cm_uv;  // both sets
layout(location = 4) in vec4 cm_color;
layout(location = 0) uniform vec2 cm_shift;  // of the layer, in normalised device coordinates

layout(location = 0) out vec3 cm_from_eye;
layout(location = 1) out vec3 cm_shading_normal;
layout(location = 2) out vec4 cm_shading_tangent;
layout(location = 3) out vec4 cm_texture_uv;
layout(location = 4) out vec4 cm_vertex_color;
layout(location = 5) out float cm_z;

void main() {
  // Near the eye the first difference is exact, however far both are from the origin.
  precise vec3 q = (cm_position - cm_view.eye_high.xyz) - cm_view.eye_low.xyz;
  precise vec3 v = cm_view.to_view_x.xyz * q.x + cm_view.to_view_y.xyz * q.y + cm_view.to_view_z.xyz * q.z;
  float w = cm_view.depth.w != 0.0 ? 1.0 : v.z;
  gl_Position = vec4(v.x + cm_shift.x * w, -v.y + cm_shift.y * w, cm_view.depth.x + cm_view.depth.y * v.z, w);
  cm_from_eye = q;
  cm_shading_normal = cm_normal;
  cm_shading_tangent = cm_tangent;
  cm_texture_uv = cm_uv;
  cm_vertex_color = cm_color;
  cm_z = v.z;
}
