#version 450
// Shows that it ran.
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer CmSign { uint cm_sign; };

void main() { cm_sign = 1u; }
