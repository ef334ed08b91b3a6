// Everything a trace needs beside the buffers: a std140 block, and the same struct in C++ (all members are 16 bytes).
#ifndef CM_PARAMETERS_GLSL
#define CM_PARAMETERS_GLSL

// What path.glsl says of variants.
#ifndef CM_SURFACES
#define CM_SURFACES 0
#endif
#ifndef CM_LAYERS
#define CM_LAYERS CM_SURFACES
#endif
#ifndef CM_AOVS
#define CM_AOVS 0
#endif

#ifdef __cplusplus
struct CmParameters {
#else
layout(std140, binding = 0) uniform CmParameters {
#endif
  vec4 eye;             // cube space
  vec4 forward;         // world space; with right and up spans the image plane at distance 1; w: 1 where orthographic
  vec4 right;           // scaled by half the width of that plane
  vec4 up;              // likewise, height
  vec4 to_cube_x;       // columns of the linear part of world to cube space
  vec4 to_cube_y;
  vec4 to_cube_z;
  vec4 box_min;         // cube space: no density outside
  vec4 box_max;
  vec4 sun_world;       // unit vector towards the sun
  vec4 sun_cube;
  vec4 sun_irradiance;  // w: share of the emissive triangles in next-event estimates that are not to the sky
  vec4 sky_radiance;
  vec4 albedo;          // w: least roughness of surfaces that blurred paths meet
  vec4 medium;          // x: extinction of density 1, 1 / world unit; y: anisotropy; z: probability of next-event
                        // estimation towards the sky (other lights have the rest); w: 1 if there is any light
  vec4 emission;        // source radiance of the medium: emission coefficient over extinction; w: where it lights
                        // surfaces, 1 / (3 times cube space's unit of volume in the world), else 0
  uvec4 image;          // width, height, seed, target samples
  uvec4 tile;           // x, y, width, height
  uvec4 march;          // x: rounds a dispatch, y: max bounces (0: no limit), or the view in inspect.comp, z: log2 of
                        // cells a page
  uvec4 cube;           // x: exponent of the root cells, y: number of cells, z: number of tree nodes, w: levels
  uvec4 order;          // inspect.comp's and aovs.comp's: y: 1 to pick one pixel; z, w: first row of the tile, and the
                        // row after the last
  uvec4 surface;        // the host's depth: x: layers (0: none), y: width, z: height
  vec4 from_cube_x;     // columns of the linear part of cube to world space; w: of its origin
  vec4 from_cube_y;
  vec4 from_cube_z;
  uvec4 scene;          // first words of the surfaces' tables: x: triangles, y: vertices, z: materials, w: textures
  uvec4 layers;         // the surface pass: x: layers (0: none), y: width, z: height; w: 1: blended surfaces have layers
                        // of their own after the others, 2: paths that end at it take up its colour
  uvec4 lights;         // x: first word of the punctual lights, y: how many; z: 1 where surfaces pass light on;
                        // w: triangles
  uvec4 emitters;       // x: first word of the emissive triangles' table, y: how many
  uvec4 ggx_albedo;     // x: first word of surface/ggx_albedo.hpp's cells, y: of its averages
#ifdef __cplusplus
};
#else
} cm;
#endif

#endif
