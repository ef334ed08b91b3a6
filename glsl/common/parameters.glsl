// Parameters of all kernels that render an image: one std140 block, and the same structs in C++
// (tests/unit/parameters_test.cpp compares the offset of each field with the driver's). Each struct has one writer,
// named with it.
#ifndef CM_PARAMETERS_GLSL
#define CM_PARAMETERS_GLSL
#include "grid/channels.glsl"

// Variant macros; path.glsl describes them.
#ifndef CM_SURFACES
#define CM_SURFACES 0
#endif
#ifndef CM_LAYERS
#define CM_LAYERS CM_SURFACES
#endif
#ifndef CM_AOVS
#define CM_AOVS 0
#endif
#ifndef CM_CHANNELS
#define CM_CHANNELS 0
#endif
#ifndef CM_VELOCITY
#define CM_VELOCITY 0
#endif
// 1 if NEE samples emissive cells. Voxel grids have no such cells, and surface kernels have no grid.
#define CM_CELL_LIGHTS CM_CHANNELS
#ifdef CM_MARCH
#if CM_MARCH != 0
#undef CM_CELL_LIGHTS
#define CM_CELL_LIGHTS 0
#endif
#endif
#ifndef CM_ANALYTIC_LIGHTS
#define CM_ANALYTIC_LIGHTS CM_SURFACES
#endif
#ifndef CM_EQUIANGULAR
#define CM_EQUIANGULAR 0
#endif
#ifndef CM_EXTENDED_BSDF
#define CM_EXTENDED_BSDF 0
#endif
// 1 if some surfaces let rays pass straight on (cm_bsdf_passes): needs CM_EXTENDED_BSDF.
#ifndef CM_CLEAR_SURFACES
#define CM_CLEAR_SURFACES 0
#endif
// 1 if radiance is also summed by light group (glsl/path/groups.glsl).
#ifndef CM_GROUPS
#define CM_GROUPS 0
#endif
#ifndef CM_ENVIRONMENT
#define CM_ENVIRONMENT 0
#endif
// 1 if the scene has holdouts.
#ifndef CM_HOLDOUT
#define CM_HOLDOUT 0
#endif
// 1 if volume instances are clipped by planes; only with CM_INSTANCES.
#ifndef CM_CLIP
#define CM_CLIP 0
#endif
// 1 if there are several volume instances (glsl/traversal/instance.glsl).
#ifndef CM_INSTANCES
#define CM_INSTANCES 0
#endif
// 1 if anything moves during the shutter interval (glsl/traversal/moment.glsl).
#ifndef CM_MOTION
#define CM_MOTION 0
#endif

#ifdef __cplusplus
#define CM_ALIGN(bytes) alignas(bytes)
#define CM_BLOCK(T) struct alignas(16) T
#define CM_EQUALITY(T) bool operator==(const T&) const = default;
#else
#define CM_ALIGN(bytes)
#define CM_BLOCK(T) struct T
#define CM_EQUALITY(T)
#endif

// The camera. Written by Viewer.
CM_BLOCK(CmView) {
  CM_ALIGN(16) vec3 eye;      // cube space
  uint orthographic;          // 1: parallel rays, with origins around the eye
  CM_ALIGN(16) vec3 forward;  // world, unit; spans with right and up the image plane at distance 1
  float inverse_focus;        // 1 / focus distance of the lens
  CM_ALIGN(16) vec3 right;    // world, half the width of that plane
  float lens_right;           // radius of the lens over the length of right (lens_up: of up); 0: a pinhole
  CM_ALIGN(16) vec3 up;       // world, half the height of that plane
  float lens_up;
  CM_ALIGN(8) uvec2 size;     // pixels
  CM_EQUALITY(CmView)
};

// Cube space, in which rays are traced, and the bounds of all volumes. Written by scene::space_of.
CM_BLOCK(CmSpace) {
  CM_ALIGN(16) vec3 to_cube_x;  // columns of the linear part of world to cube space
  CM_ALIGN(16) vec3 to_cube_y;
  CM_ALIGN(16) vec3 to_cube_z;
  CM_ALIGN(16) vec3 from_cube_x;  // columns of the linear part of cube to world space
  CM_ALIGN(16) vec3 from_cube_y;
  CM_ALIGN(16) vec3 from_cube_z;
  CM_ALIGN(16) vec3 cube_origin;  // world
  float unit_volume;              // world volume of a unit of cube space
  CM_ALIGN(16) vec3 box_min;      // cube space: no density outside
  uint volumes;                   // number of entries of the table of glsl/traversal/instance.glsl; 0 without a table
  CM_ALIGN(16) vec3 box_max;
  CM_EQUALITY(CmSpace)
};

// The data of a volume (glsl/grid/cell.glsl), independent of its instance transform. Written by render::MarchData.
CM_BLOCK(CmGrid) {
  CM_ALIGN(16) vec3 box_min;  // cube space: no density outside
  uint root_exponent;         // edge length of the root cells' cube: 2 to this power
  CM_ALIGN(16) vec3 box_max;
  uint levels;            // number of bisection levels
  uint page_shift;        // log2 of cells per page
  uint first_cell;        // first record in its page, or, with several pages, in all of them together
  uint tree;              // first word of the point-location tree in its page, in 4-byte words; its roots are before it
  float emission_unit;    // radiance per world unit of length of the stored value 1 of voxels
  // First record of each channel in the page of the cells' channels: in texels if records have 16 bytes, else in
  // 4-byte words.
  CM_ALIGN(16) uvec4 first_records[(CM_CHANNEL_COUNT + 3) / 4];
  uint first_glowing;     // first entry of the table of emissive cells in that page, in 16-byte texels
  uint glowing;           // number of its entries
  uint moves;             // 1: there are velocities
  uint first_change;      // CM_MOTION only: first record of density changes, in 4-byte words (CmMedium.changes)
  uint first_corners;     // CM_LINEAR 2 only: first record of corners, in 16-byte texels
  CM_EQUALITY(CmGrid)
};

// NEE of a volume's emissive cells, depending on the instance transform. Written by scene::emissive_of.
CM_BLOCK(CmEmissive) {
  float density;      // volume pdf over a cell's luminance: 1 / power of all cells
  float extent;       // world: approximate length of a ray among the brightest cells
  float min_stretch;  // world: minimum length of a vector that has length 1 in cube space
  CM_EQUALITY(CmEmissive)
};

// The participating medium. With several, emits, colored and anisotropic are 1 if they are 1 for any. Written by
// render::GpuScene.
CM_BLOCK(CmMedium) {
  CM_ALIGN(16) vec3 albedo;  // single-scattering albedo
  float extinction;          // extinction of stored density 1, 1 / world unit
  CM_ALIGN(16) vec3 source;  // radiance: emission coefficient over extinction
  float anisotropy;          // these four are CmPhase of glsl/path/phase.glsl
  float second_anisotropy;
  float second_bend;
  float second_weight;
  uint emits;        // 1: its cells emit light; this and the next two only with CM_CHANNELS
  uint colored;      // 1: cells have a scattering color
  uint anisotropic;  // 1: cells have an anisotropy, which replaces the one above
  uint group;        // light group of its emission; only with CM_GROUPS
  uint holdout;      // 1: holdout; only with CM_HOLDOUT
  uint changes;      // 1: its density changes during the shutter interval; only with CM_MOTION
  CM_EQUALITY(CmMedium)
};

// Distant lights, and the NEE selection probability of each kind (glsl/light/light.glsl). Written by light::LightTable.
CM_BLOCK(CmLights) {
  CM_ALIGN(16) vec3 sun_direction;  // world, unit, towards the sun
  uint any;                         // 1: there is a light to sample
  CM_ALIGN(16) vec3 sun_irradiance;
  float sky_probability;
  CM_ALIGN(16) vec3 sky_radiance;  // for an environment map its mean, which lights the surfaces of previews
  float triangle_probability;
  float analytic_light_probability;  // of all analytic lights together; the sun has the rest
  float emissive_probability;        // probability that a ray from a surface or the ground is aimed at the medium's
                                     // emission
  float cell_probability;            // of emissive cells
  float environment_probability;
  float environment_strength;        // factor on the environment map's radiance
  CM_ALIGN(8) vec2 environment_turn;  // cosine and sine of its rotation
  CM_ALIGN(16) vec3 sun_radiance;     // of a sun with an extent
  float sun_spread;                   // 1 - cosine of half its angular diameter; 0: a direction
  CM_EQUALITY(CmLights)
};

// The bounds of all triangles, and tables that models share (glsl/surface/model_table.glsl). Written by
// render::ModelTable.
CM_BLOCK(CmSurfaceTables) {
  CM_ALIGN(16) vec3 low;  // world
  uint models;            // number of entries of the table
  CM_ALIGN(16) vec3 high;
  uint ggx_albedo;  // word index of the table of src/surface/ggx_albedo.hpp
  uint ggx_albedo_averages;
  uint sheen_albedo;   // word index of the table of src/surface/sheen_albedo.hpp
  uint extended_bsdf;  // the CM_EXTENDED_BSDF that the materials need; above 0 paths keep CM_PATH_WITHIN
  CM_EQUALITY(CmSurfaceTables)
};

// Analytic lights of the scene and the host (glsl/light/punctual.glsl). Written by render::AnalyticLightData, through
// Tracer.
CM_BLOCK(CmAnalyticLights) {
  uint count;  // number of lights for NEE
  CM_EQUALITY(CmAnalyticLights)
};

// The environment map (glsl/light/environment.glsl). Written by render::EnvironmentData.
CM_BLOCK(CmEnvironment) {
  CM_ALIGN(8) uvec2 size;  // texels
  uint words;              // index of the first texel in its page
  float density;           // solid-angle pdf of NEE, over weight / sine
  CM_EQUALITY(CmEnvironment)
};

// The ground plane below everything (glsl/surface/ground.glsl). Written by render::GpuScene.
CM_BLOCK(CmGround) {
  CM_ALIGN(16) vec3 albedo;  // of a shadow catcher: divided by the background's radiance
  float height;              // world
  float reach;               // rays hit it only up to this distance; 0: there is no ground
  uint catches;              // 1: it is a shadow catcher
  CM_EQUALITY(CmGround)
};

// The surface pass at which camera rays end. Written by Tracer::begin.
CM_BLOCK(CmLayers) {
  uint count;              // 0: none
  uint blended;            // 1: blended surfaces have their own layers after the others
  CM_ALIGN(8) uvec2 size;  // pixels
  uint colored;            // 1: paths that end at it get its color
  CM_EQUALITY(CmLayers)
};

// The host's depth buffer. Written by render::HostDepth, through Tracer.
CM_BLOCK(CmHostDepth) {
  CM_ALIGN(8) uvec2 size;  // pixels
  uint layers;             // 0: none
  CM_EQUALITY(CmHostDepth)
};

// How paths continue. Written by Viewer.
CM_BLOCK(CmIntegrator) {
  uint seed;
  uint max_bounces;         // 0: no limit
  float blurred_roughness;  // minimum roughness of surfaces after a wide bounce (path regularization)
  uint light_among_surfaces;  // 1: surfaces light each other and the volume
  uint first_sample;          // number of each pixel's first sample
  uint groups;                // number of light groups with a layer; these three only with CM_GROUPS
  uint sun_group;
  uint sky_group;             // group of the sky or the environment
  CM_EQUALITY(CmIntegrator)
};

// The work of one dispatch. Written by Tracer.
CM_BLOCK(CmDispatch) {
  CM_ALIGN(8) uvec2 tile_corner;  // pixels
  CM_ALIGN(8) uvec2 tile_size;
  uint rounds;   // maximum number of rounds of a lane of trace.comp
  uint samples;  // target number of samples per pixel; for feature rays, the target number of rays
  uint view;     // view of inspect.comp
  uint picks;    // 1: inspect.comp inspects only the tile's one pixel and writes the result to (0, 0)
  CM_ALIGN(8) uvec2 rows;  // rows of the tile, for kernels that run by rows: first, and one past the last
  uint lanes;    // number of lanes for paths
  uint slots;   // number of their pixel slots: pixels of the tile's listed squares, glsl/path/pixel_slots.glsl
  uint rays_before;  // feature rays traced by earlier dispatches: glsl/features/aovs.comp, cryptomatte.comp
  uint rays_least;   // minimum number of feature rays, even if they all agree
  CM_EQUALITY(CmDispatch)
};

// The camera during the shutter interval, with CM_MOTION (glsl/traversal/ray.glsl). Written by GpuScene. It comes last,
// so that it does not change the offsets of other fields.
CM_BLOCK(CmShutter) {
  CmView open;             // at shutter open
  CmView close;            // at shutter close, without the rotation
  CM_ALIGN(16) vec3 axis;  // world, unit: axis of the camera's rotation until then
  float angle;             // angle of that rotation in radians
  uint lasts;              // 1: something moves
  CM_EQUALITY(CmShutter)
};

#ifdef __cplusplus
CM_BLOCK(CmParameters) {
#else
layout(std140, binding = CM_UNIFORM_PARAMETERS) uniform CmParameters {
#endif
  CmView view;
  CmSpace space;
  CmGrid grid;
  CmEmissive emissive;
  CmMedium medium;
  CmLights lights;
  CmSurfaceTables surfaces;
  CmAnalyticLights analytic_lights;
  CmEnvironment environment;
  CmGround ground;
  CmLayers layers;
  CmHostDepth host_depth;
  CmIntegrator integrator;
  CmDispatch dispatch;
  CmShutter shutter;
#ifdef __cplusplus
  CM_EQUALITY(CmParameters)
};
#else
} cm;
#endif

#endif
