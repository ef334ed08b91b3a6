#version 450
// Draws an image that is already in display colors, over a rectangle of its own size.
#include "common/bindings.glsl"

layout(binding = CM_UNIT_SUM) uniform sampler2D cm_picture;  // nearest filter; row 0 is the image's top
layout(location = 0) uniform ivec4 cm_viewport;
layout(location = 1) uniform bool cm_flip_y;

layout(location = 0) out vec4 cm_color;

void main() {
  // Not gl_FragCoord itself: with per-sample shading by the host it is not at the pixel's center.
  ivec2 pixel = ivec2(floor(gl_FragCoord.xy)) - cm_viewport.xy;
  if (!cm_flip_y) pixel.y = cm_viewport.w - 1 - pixel.y;
  // Software drivers filter faster than they fetch.
  cm_color = textureLod(cm_picture, (vec2(pixel) + 0.5) / vec2(cm_viewport.zw), 0.0);
}
