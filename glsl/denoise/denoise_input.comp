#version 450
// Input channels of the network: exposed and encoded color, albedo, and normals mapped to [0, 1]. Beyond the image it
// is mirrored, because the network would take the image's border for an edge. CM_GUIDES 0: only color.
// variants: CM_GUIDES=0,1
layout(local_size_x = 8, local_size_y = 8) in;
#include "common/bindings.glsl"
#include "denoise/denoise.glsl"

layout(binding = CM_UNIT_DENOISE_COLOR) uniform sampler2D cm_color;
#if CM_GUIDES
layout(binding = CM_UNIT_DENOISE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_DENOISE_NORMAL) uniform sampler2D cm_normal;
#endif
layout(std430, binding = CM_STORAGE_DENOISE_BINS) readonly buffer CmBins { float cm_exposure; };
layout(std430, binding = CM_STORAGE_DENOISE_CHANNELS) writeonly buffer CmChannels { uvec4 cm_channels[]; };
layout(location = 0) uniform uint cm_first;   // index of the first work group
layout(location = 1) uniform uint cm_width;   // size of the tile
layout(location = 2) uniform uint cm_height;
layout(location = 3) uniform ivec2 cm_begin;  // corner of the tile in the image
layout(location = 4) uniform uint cm_to;

ivec2 cm_mirrored(ivec2 texel, ivec2 size) {
  ivec2 low = mix(texel, -1 - texel, lessThan(texel, ivec2(0)));
  ivec2 high = mix(low, 2 * size - 1 - low, greaterThanEqual(low, size));
  return clamp(high, ivec2(0), size - 1);
}

void main() {
  uint group = cm_first + gl_WorkGroupID.x;
  uint groups_x = cm_width / 8u;
  uvec2 p = uvec2(group % groups_x, group / groups_x) * 8u + gl_LocalInvocationID.xy;
  ivec2 texel = cm_mirrored(cm_begin + ivec2(p), textureSize(cm_color, 0));
  vec3 exposed = min(cm_exposure * cm_radiance(texelFetch(cm_color, texel, 0).rgb), vec3(3e38));
  vec3 color = vec3(cm_pu(exposed.r), cm_pu(exposed.g), cm_pu(exposed.b));
#if CM_GUIDES
  vec3 a = texelFetch(cm_albedo, texel, 0).rgb;
  vec3 n = texelFetch(cm_normal, texel, 0).rgb;
  vec3 albedo = cm_is_finite(a) ? clamp(a, 0.0, 1.0) : vec3(0.0);
  vec3 normal = 0.5 + 0.5 * (cm_is_finite(n) ? clamp(n, -1.0, 1.0) : vec3(0.0));
#else
  vec3 albedo = vec3(0.0);
  vec3 normal = vec3(0.0);
#endif
  uint at = cm_to + p.y * cm_width + p.x;
  cm_channels[at] = uvec4(cm_pack(color.rg), cm_pack(vec2(color.b, albedo.r)), cm_pack(albedo.gb),
                          cm_pack(normal.rg));
#if CM_GUIDES
  cm_channels[at + cm_width * cm_height] = uvec4(cm_pack(vec2(normal.b, 0.0)), 0u, 0u, 0u);
#endif
}
