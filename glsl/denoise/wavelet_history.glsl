// History of an image for temporal reprojection, two uvec4 per pixel: its light (like front of wavelet.glsl, with the
// number of samples behind it), and its geometry.
#ifndef CM_WAVELET_HISTORY_GLSL
#define CM_WAVELET_HISTORY_GLSL
#include "denoise/wavelet.glsl"

struct CmLit {
  vec4 front;
  float moment;   // mean squared luminance of a sample
  float samples;  // 0: no history
};

struct CmGeometry {
  vec3 normal;  // like CmGuides'
  float transmittance;
  float open;        // uncovered fraction
  float solid_z;     // view depths; above CM_NOTHING_Z: none
  float scattered_z;
};

// Stored relative to the largest value, so that halves suffice for any unit of light.
uvec4 cm_packed_light(CmLit lit) {
  float deviation = sqrt(lit.moment);
  float most = max(max(lit.front.r, lit.front.g), max(lit.front.b, deviation));
  float scale = most > 0.0 ? 1.0 / most : 0.0;
  return uvec4(floatBitsToUint(most), packHalf2x16(scale * lit.front.rg),
               packHalf2x16(scale * vec2(lit.front.b, deviation)), packHalf2x16(vec2(lit.front.a, lit.samples)));
}

CmLit cm_unpacked_light(uvec4 words) {
  float most = uintBitsToFloat(words.x);
  vec2 low = unpackHalf2x16(words.y);
  vec2 high = unpackHalf2x16(words.z);
  vec2 rest = unpackHalf2x16(words.w);
  return CmLit(vec4(most * vec3(low, high.x), rest.x), most * high.y * most * high.y, rest.y);
}

uvec4 cm_packed_geometry(CmGeometry geometry) {
  return uvec4(packSnorm4x8(vec4(geometry.normal, 0.0)), packHalf2x16(vec2(geometry.transmittance, geometry.open)),
               floatBitsToUint(min(geometry.solid_z, 2.0 * CM_NOTHING_Z)),
               floatBitsToUint(min(geometry.scattered_z, 2.0 * CM_NOTHING_Z)));
}

CmGeometry cm_unpacked_geometry(uvec4 words) {
  vec2 halves = unpackHalf2x16(words.y);
  return CmGeometry(unpackSnorm4x8(words.x).xyz, halves.x, halves.y, uintBitsToFloat(words.z),
                    uintBitsToFloat(words.w));
}

layout(binding = CM_UNIT_GUIDE_ALBEDO) uniform sampler2D cm_albedo;
layout(binding = CM_UNIT_GUIDE_NORMAL) uniform sampler2D cm_normal;

// Geometry of the image being filtered. aovs.comp stores depths beside normals and albedos.
CmGeometry cm_geometry_at(ivec2 texel) {
  CmGuides guides = cm_guides_at(texel);
  return CmGeometry(guides.normal, guides.transmittance, texelFetch(cm_spread, texel, 0).x,
                 texelFetch(cm_normal, texel, 0).w, texelFetch(cm_albedo, texel, 0).w);
}

#endif
