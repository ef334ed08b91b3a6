#version 450
// Draws an image that is already in display colors, over a rectangle of another size.
#include "common/bindings.glsl"

layout(binding = CM_UNIT_SUM) uniform sampler2D cm_picture;  // bilinear filter; row 0 is the image's top
layout(location = 0) uniform ivec4 cm_viewport;
layout(location = 1) uniform bool cm_flip_y;

layout(location = 0) out vec4 cm_color;

void main() {
  // Not gl_FragCoord itself: with per-sample shading by the host it is not at the pixel's center.
  vec2 at = (floor(gl_FragCoord.xy) + 0.5 - vec2(cm_viewport.xy)) / vec2(cm_viewport.zw);
  if (!cm_flip_y) at.y = 1.0 - at.y;
  cm_color = textureLod(cm_picture, at, 0.0);
}
