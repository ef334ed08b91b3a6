#version 450
layout(location = 0) in vec3 shaded;
layout(location = 0) out vec4 color;

void main() { color = vec4(shaded, 1.0); }
