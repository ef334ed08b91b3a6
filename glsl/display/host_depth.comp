#version 450
// Converts the host's depth buffer to view depth, one layer per sample, and reports whether it changed.
// variants: CM_MULTISAMPLE=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "common/numbers.glsl"

#if CM_MULTISAMPLE
layout(binding = CM_UNIT_DEPTH_SOURCE) uniform sampler2DMS cm_source;
#else
layout(binding = CM_UNIT_DEPTH_SOURCE) uniform sampler2D cm_source;
#endif
layout(r32f, binding = CM_IMAGE_HOST_DEPTH) uniform image2DArray cm_z;
layout(std430, binding = CM_STORAGE_DEPTH_CHANGED) buffer CmChanged { uint cm_changed; };
layout(location = 0) uniform ivec2 cm_origin;
layout(location = 1) uniform bool cm_flip_y;
layout(location = 2) uniform bool cm_orthographic;
layout(location = 3) uniform vec3 cm_depth;  // a; the rest of a in double precision; b

// z = b / (d - a), or (d - a) / b if orthographic. Infinite at the far value and beyond, and for NaN.
float cm_view_depth(float d) {
  float infinite = uintBitsToFloat(0x7f800000u);
  bool rising = (cm_depth.z > 0.0) == cm_orthographic;
  if (cm_is_nan(d) || (rising ? d >= 1.0 : d <= 0.0)) return infinite;
  // d is often almost a. Its difference from the float nearest to a is exact; the rest of a is subtracted after it.
  precise float difference = d - cm_depth.x;
  precise float rest = difference - cm_depth.y;
  if (cm_orthographic) return rest / cm_depth.z;
  float z = cm_depth.z / rest;
  return z > 0.0 ? z : infinite;
}

void main() {
  ivec3 size = imageSize(cm_z);
  ivec3 p = ivec3(gl_GlobalInvocationID);
  if (p.x >= size.x || p.y >= size.y) return;
  ivec2 texel = cm_origin + ivec2(p.x, cm_flip_y ? p.y : size.y - 1 - p.y);
  float z = cm_view_depth(texelFetch(cm_source, texel, p.z).x);
  if (z != imageLoad(cm_z, p).x) cm_changed = 1u;
  imageStore(cm_z, p, vec4(z));
}
