// What the surface pass knows of a view and of a material: std140 blocks, and the same structs in C++ (all members are
// 16 bytes, or arrays of such).
#ifndef CM_SURFACE_PARAMETERS_GLSL
#define CM_SURFACE_PARAMETERS_GLSL
#include "harmonics.glsl"

// Textures of a material.
const int CM_MAP_BASE_COLOR = 0;
const int CM_MAP_METALLIC_ROUGHNESS = 1;
const int CM_MAP_NORMAL = 2;
const int CM_MAP_OCCLUSION = 3;
const int CM_MAP_EMISSION = 4;
const int CM_MAP_SPECULAR = 5;
const int CM_MAP_SPECULAR_COLOR = 6;
const int CM_MAP_CLEARCOAT = 7;
const int CM_MAP_CLEARCOAT_ROUGHNESS = 8;
const int CM_MAP_TRANSMISSION = 9;
const int CM_MAPS = 10;

#ifdef __cplusplus
struct CmSurfaceView {
#else
layout(std140, binding = CM_UNIFORM_SURFACE_VIEW) uniform CmSurfaceView {
#endif
  vec4 to_view_x;       // columns of world (from the eye) to picture: x and y are -1 to 1 (times z in perspective), z is
  vec4 to_view_y;       // the view depth
  vec4 to_view_z;
  vec4 clip;            // of view depth z: clip-space depth is x + y z, and w is z + w z
  vec4 forward;         // unit
  vec4 sun_direction;   // unit, towards the sun
  vec4 sun_irradiance;
  vec4 sky_radiance;    // the mean
  CmHarmonics sky;      // what there is beyond it, before it is turned
  vec4 sky_turn;        // from +Z towards +X: cosine, sine; z: times what glossy lobes see of it
  uvec4 counts;         // x: lamps; y: 1 where there is a sky beyond the mean; z: 1 where orthographic
#ifdef __cplusplus
};
#else
} cm_view;
#endif

#ifdef __cplusplus
struct CmMaterial {
#else
layout(std140, binding = CM_UNIFORM_MATERIAL) uniform CmMaterial {
#endif
  vec4 base_color;
  vec4 emission;        // w: alpha cutoff
  vec4 reflection;      // metallic, roughness, normal scale, occlusion strength
  vec4 specular;        // specular colour times ((ior - 1) / (ior + 1))^2, and the weight
  vec4 coat;            // clearcoat, its roughness, transmission
  uvec4 flags;          // y: bits of the maps by the second uv set; z: 1 where unlit
  vec4 uv_rows[20];     // two a map: uv' = (dot(row, (uv, 1)), dot(row, (uv, 1)))
#ifdef __cplusplus
};
#else
} cm_material;
#endif

#endif
