// Parameters of the surface pass per view and per material: std140 blocks, and the same structs in C++ (all members are
// 16 bytes, or arrays of such).
#ifndef CM_SURFACE_PARAMETERS_GLSL
#define CM_SURFACE_PARAMETERS_GLSL
#include "light/harmonics.glsl"

// Texture maps of a material.
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
  vec4 to_view_x;       // columns of world (relative to the eye) to image: x and y are -1 to 1 (times z in
  vec4 to_view_y;       // perspective), z is the view depth
  vec4 to_view_z;
  vec4 clip;            // for view depth z: clip-space depth is x + y z, and w is z + w z
  vec4 forward;         // unit
  vec4 sun_direction;   // unit, towards the sun
  vec4 sun_irradiance;
  vec4 sky_radiance;    // mean radiance
  CmHarmonics sky;      // difference from the mean, before rotation
  vec4 sky_turn;        // rotation from +Z towards +X: cosine, sine; z: scale of the prefiltered environment
  uvec4 counts;         // x: number of lights; y: 1 if the sky has more than its mean; z: 1 if orthographic
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
  vec4 specular;        // specular color times ((ior - 1) / (ior + 1))^2, and the weight
  vec4 coat;            // clearcoat, its roughness, transmission
  uvec4 flags;          // y: bits of the maps that use the second uv set; z: 1 if unlit
  vec4 uv_rows[20];     // two per map: uv' = (dot(row, (uv, 1)), dot(row, (uv, 1)))
#ifdef __cplusplus
};
#else
} cm_material;
#endif

#endif
