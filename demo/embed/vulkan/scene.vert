#version 450
// A box whose faces are shaded by their directions.
layout(push_constant) uniform Box {
  mat4 to_clip;  // from the cube between (-1, -1, -1) and (1, 1, 1)
  vec4 color;
};
layout(location = 0) out vec3 shaded;

void main() {
  const vec2 corners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1), vec2(-1, 1));
  const int face = gl_VertexIndex / 6;
  const int axis = face / 2;
  const vec2 corner = corners[gl_VertexIndex % 6];
  const float side = (face % 2 == 0) ? -1.0 : 1.0;
  vec3 position, normal = vec3(0.0);
  position[axis] = side;
  position[(axis + 1) % 3] = corner.x;
  position[(axis + 2) % 3] = corner.y;
  normal[axis] = side;
  gl_Position = to_clip * vec4(position, 1.0);
  shaded = color.rgb * (0.35 + 0.65 * max(dot(normal, vec3(0.37, 0.74, 0.56)), 0.0));
}
