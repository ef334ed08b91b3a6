#version 450
// Transforms a vertex of the scene, relative to the eye; row 0 of the target is the image's top.
#include "common/bindings.glsl"
#include "common/shared.glsl"
#include "surface/surface_parameters.glsl"

layout(location = 0) in vec3 cm_position;  // in its own space
layout(location = 1) in vec3 cm_normal;
layout(location = 2) in vec4 cm_tangent;
layout(location = 3) in vec4 cm_uv;  // both sets of texture coordinates
layout(location = 4) in vec4 cm_color;
layout(location = 5) in vec3 cm_transform_x;  // columns of the linear part from its own space to the world
layout(location = 6) in vec3 cm_transform_y;
layout(location = 7) in vec3 cm_transform_z;
layout(location = 8) in vec3 cm_origin_high;  // its origin relative to the eye, as a sum of two floats
layout(location = 9) in vec3 cm_origin_low;
layout(location = 0) uniform vec2 cm_shift;  // jitter of the layer, in normalized device coordinates

layout(location = 0) out vec3 cm_from_eye;
layout(location = 1) out vec3 cm_shading_normal;
layout(location = 2) out vec4 cm_shading_tangent;
layout(location = 3) out vec4 cm_texture_uv;
layout(location = 4) out vec4 cm_vertex_color;
layout(location = 5) out float cm_z;

void main() {
  // Near the eye the first sum is exact, however far both are from the origin.
  precise vec3 turned =
      cm_transform_x * cm_position.x + cm_transform_y * cm_position.y + cm_transform_z * cm_position.z;
  precise vec3 q = (turned + cm_origin_high) + cm_origin_low;
  precise vec3 v = cm_view.to_view_x.xyz * q.x + cm_view.to_view_y.xyz * q.y + cm_view.to_view_z.xyz * q.z;
  // One expression for every projection: with "orthographic ? 1 : z", NVIDIA's driver 580 does not divide varyings by w
  // again.
  float w = cm_view.clip.z + cm_view.clip.w * v.z;
  gl_Position = vec4(v.x + cm_shift.x * w, -v.y + cm_shift.y * w, cm_view.clip.x + cm_view.clip.y * v.z, w);
  cm_from_eye = q;
  // Scaled, because products of short columns would underflow.
  vec3 longest = max(max(abs(cm_transform_x), abs(cm_transform_y)), abs(cm_transform_z));
  float scale = 1.0 / max(max(longest.x, longest.y), longest.z);
  vec3 x = scale * cm_transform_x;
  vec3 y = scale * cm_transform_y;
  vec3 z = scale * cm_transform_z;
  vec3 across = cross(y, z);
  float side = dot(x, across) < 0.0 ? -1.0 : 1.0;
  vec3 normal = across * cm_normal.x + cross(z, x) * cm_normal.y + cross(x, y) * cm_normal.z;
  vec3 tangent = x * cm_tangent.x + y * cm_tangent.y + z * cm_tangent.z;
  // Normalized to equal lengths, because they are interpolated.
  float n_n = dot(normal, normal);
  float t_t = dot(tangent, tangent);
  cm_shading_normal = n_n > 0.0 ? side * normal * inversesqrt(n_n) * length(cm_normal) : cm_normal;
  cm_shading_tangent = vec4(t_t > 0.0 ? tangent * inversesqrt(t_t) : tangent, side * cm_tangent.w);
  cm_texture_uv = cm_uv;
  cm_vertex_color = cm_color;
  cm_z = v.z;
}
