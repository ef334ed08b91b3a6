// What every kernel of a picture is told: one std140 block, and the same structs in C++ (tests/unit/parameters_test.cpp
// asks the driver where it has each field). Each struct has one writer, named with it.
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
#ifndef CM_CHANNELS
#define CM_CHANNELS 0
#endif
#ifndef CM_VELOCITY
#define CM_VELOCITY 0
#endif
// Whether paths look for cells that give off light: marches of voxels have none, kernels of surfaces no march.
#define CM_CELL_LIGHTS CM_CHANNELS
#ifdef CM_MARCH
#if CM_MARCH != 0
#undef CM_CELL_LIGHTS
#define CM_CELL_LIGHTS 0
#endif
#endif
#ifndef CM_LAMPS
#define CM_LAMPS CM_SURFACES
#endif
#ifndef CM_EQUIANGULAR
#define CM_EQUIANGULAR 0
#endif
#ifndef CM_RICH
#define CM_RICH 0
#endif
// Whether radiance is added up by groups of lights as well (glsl/groups.glsl).
#ifndef CM_GROUPS
#define CM_GROUPS 0
#endif
#ifndef CM_ENVIRONMENT
#define CM_ENVIRONMENT 0
#endif
// Whether there is what cameras see as a hole.
#ifndef CM_HOLDOUT
#define CM_HOLDOUT 0
#endif
// Whether there are several volumes (glsl/instance.glsl).
#ifndef CM_INSTANCES
#define CM_INSTANCES 0
#endif
// Whether anything moves while the shutter is open (glsl/moment.glsl).
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

// The camera: Viewer.
CM_BLOCK(CmView) {
  CM_ALIGN(16) vec3 eye;      // cube space
  uint orthographic;          // 1: rays are parallel, from points about the eye
  CM_ALIGN(16) vec3 forward;  // world, unit; with right and up it spans the image plane at distance 1
  float inverse_focus;        // 1 over the distance of what a lens has sharp
  CM_ALIGN(16) vec3 right;    // world, half the width of that plane
  float lens_right;           // radius of the lens over the length of right, and of up; 0: a pinhole
  CM_ALIGN(16) vec3 up;       // likewise, height
  float lens_up;
  CM_ALIGN(8) uvec2 size;     // pixels
  CM_EQUALITY(CmView)
};

// Cube space, in which rays are, and the box of all that they march through: scene::space_of.
CM_BLOCK(CmSpace) {
  CM_ALIGN(16) vec3 to_cube_x;  // columns of the linear part of world to cube space
  CM_ALIGN(16) vec3 to_cube_y;
  CM_ALIGN(16) vec3 to_cube_z;
  CM_ALIGN(16) vec3 from_cube_x;  // and of cube to world space
  CM_ALIGN(16) vec3 from_cube_y;
  CM_ALIGN(16) vec3 from_cube_z;
  CM_ALIGN(16) vec3 cube_origin;  // world
  float unit_volume;              // of a unit of cube space, in the world
  CM_ALIGN(16) vec3 box_min;      // cube space: no density outside
  uint volumes;                   // of the table of glsl/instance.glsl; without one 0
  CM_ALIGN(16) vec3 box_max;
  CM_EQUALITY(CmSpace)
};

// A volume's data (glsl/cell.glsl), wherever it stands: render::MarchData.
CM_BLOCK(CmGrid) {
  CM_ALIGN(16) vec3 box_min;  // cube space: no density outside
  uint root_exponent;         // the root cells' cube has edges of 2 to this power
  CM_ALIGN(16) vec3 box_max;
  uint levels;            // of bisection
  uint page_shift;        // log2 of cells a page
  uint first_cell;        // where the records begin in their page, or, of several, in all of them together
  uint tree;              // where the point-location tree begins in its page, in 4-byte words; before it its roots
  uint first_emission;    // where the records of what cells give off begin in their page
  uint first_colour;      // and their colours, in 4-byte words
  uint first_anisotropy;  // and what mean cosine their scattering has, likewise
  float emission_unit;    // radiance a world unit of length of what is stored as 1 for voxels
  uint first_glowing;     // where the table of cells that give off light begins in the page of their channels
  uint glowing;           // how many it has
  uint first_velocity;    // where the velocities of its cells begin in that page, in 4-byte words
  uint moves;             // 1: it has some
  uint first_change;      // with CM_MOTION: where begins, likewise, how its cells' densities change (CmMedium.changes)
  CM_EQUALITY(CmGrid)
};

// Looks for its cells that give off light, where it stands: scene::glow_of.
CM_BLOCK(CmGlow) {
  float density;        // of looks by volume, over a cell's luminance: 1 over what all of them give off
  float extent;         // world: about how much of a ray is among those that give off most
  float least_stretch;  // world: no vector of length 1 in cube space is shorter
  CM_EQUALITY(CmGlow)
};

// The participating medium; of several, whether any has what its last three tell: render::GpuScene.
CM_BLOCK(CmMedium) {
  CM_ALIGN(16) vec3 albedo;  // of single scattering
  float extinction;          // of stored density 1, 1 / world unit
  CM_ALIGN(16) vec3 source;  // radiance: emission coefficient over extinction
  float anisotropy;          // these four: CmPhase of glsl/phase.glsl
  float second_anisotropy;
  float second_bend;
  float second_share;
  uint emits;     // 1: its cells give off light; this one and the next two only with CM_CHANNELS
  uint coloured;  // 1: what scatters has a colour a cell
  uint anisotropic;  // 1: and an anisotropy in place of this one
  uint group;        // of what it gives off; only with CM_GROUPS
  uint holdout;      // 1: cameras see a hole; only with CM_HOLDOUT
  uint changes;      // 1: its density changes while the shutter is open; only with CM_MOTION
  CM_EQUALITY(CmMedium)
};

// Lights that are far away, and the chances with which paths look for each kind (glsl/light.glsl): light::LightTable.
CM_BLOCK(CmLights) {
  CM_ALIGN(16) vec3 sun_direction;  // world, unit, towards the sun
  uint any;                         // 1: there is light to look for
  CM_ALIGN(16) vec3 sun_irradiance;
  float sky_chance;
  CM_ALIGN(16) vec3 sky_radiance;  // of an environment the mean, which previews' surfaces see
  float triangle_chance;
  float lamp_chance;  // of all lamps together; what these leave is the sun's
  float glow_chance;  // that a flight from a surface is aimed at the medium's own light
  float cell_chance;  // of cells that give off light
  float environment_chance;
  float environment_strength;        // times the picture's radiance
  CM_ALIGN(8) vec2 environment_turn;  // cosine and sine of its angle
  CM_ALIGN(16) vec3 sun_radiance;     // of a sun that has one
  float sun_spread;                   // 1 minus the cosine of half the angle that it takes; 0: a direction
  CM_EQUALITY(CmLights)
};

// The box of all triangles, and what models share (glsl/model_table.glsl): render::ModelTable.
CM_BLOCK(CmSurfaceTables) {
  CM_ALIGN(16) vec3 low;  // world
  uint models;            // of the table
  CM_ALIGN(16) vec3 high;
  uint ggx_albedo;  // words: src/surface/ggx_albedo.hpp's cells
  uint ggx_albedo_averages;
  uint sheen_albedo;  // src/surface/sheen_albedo.hpp's words
  uint rich;          // 1: there are materials that only CM_RICH does justice, and paths keep what they are within
  CM_EQUALITY(CmSurfaceTables)
};

// Lamps of the scene and the host (glsl/punctual.glsl): render::LampData, through Tracer.
CM_BLOCK(CmLamps) {
  uint count;  // that are looked for
  CM_EQUALITY(CmLamps)
};

// The picture of all that is far away (glsl/environment.glsl): render::EnvironmentData.
CM_BLOCK(CmEnvironment) {
  CM_ALIGN(8) uvec2 size;  // texels
  uint words;              // where they begin in their page
  float density;           // of looks by solid angle, over weight by sine
  CM_EQUALITY(CmEnvironment)
};

// The plane that paths meet under all else (glsl/ground.glsl): render::GpuScene.
CM_BLOCK(CmGround) {
  CM_ALIGN(16) vec3 albedo;
  float height;  // world
  float reach;   // a ray meets it within that; 0: there is none
  CM_EQUALITY(CmGround)
};

// The surface pass that camera rays end at: Tracer::begin.
CM_BLOCK(CmLayers) {
  uint count;              // 0: none
  uint blended;            // 1: blended surfaces have layers of their own after the others
  CM_ALIGN(8) uvec2 size;  // pixels
  uint coloured;           // 1: paths that end at it take up its colour
  CM_EQUALITY(CmLayers)
};

// The host's own depth: render::HostDepth, through Tracer.
CM_BLOCK(CmHostDepth) {
  CM_ALIGN(8) uvec2 size;  // pixels
  uint layers;             // 0: none
  CM_EQUALITY(CmHostDepth)
};

// How paths are continued: Viewer.
CM_BLOCK(CmIntegrator) {
  uint seed;
  uint max_bounces;         // 0: no limit
  float blurred_roughness;  // least roughness of surfaces that blurred paths meet
  uint light_among_surfaces;  // 1: surfaces pass light on to each other and to the volume
  uint first_sample;          // the number of each pixel's first
  uint groups;                // of lights, that are gathered; these three only with CM_GROUPS
  uint sun_group;
  uint sky_group;             // or the environment's
  CM_EQUALITY(CmIntegrator)
};

// What one dispatch does: Tracer.
CM_BLOCK(CmDispatch) {
  CM_ALIGN(8) uvec2 tile_corner;  // pixels
  CM_ALIGN(8) uvec2 tile_size;
  uint rounds;   // that a lane of trace.comp runs at most
  uint samples;  // that a pixel shall have; of rays without chance those that it shall have been looked along
  uint view;     // of inspect.comp
  uint picks;    // 1: inspect.comp looks at one pixel, the tile's, and tells of it at (0, 0)
  CM_ALIGN(8) uvec2 rows;  // of the tile, for kernels that run by rows: the first, and the one after the last
  uint lanes;    // that there are for paths
  uint places;   // pixels that they take, those of the tile's list of squares: glsl/path_places.glsl
  uint rays_before;  // of rays without chance those that it has been looked along: glsl/aovs.comp, cryptomatte.comp
  uint rays_least;   // and those that it shall be looked along however alike they are
  CM_EQUALITY(CmDispatch)
};

// The camera while the shutter is open, with CM_MOTION (glsl/ray.glsl): GpuScene. Last, so that nothing else moves for it.
CM_BLOCK(CmShutter) {
  CmView open;             // as it opens
  CmView close;            // as it closes, but for the turn
  CM_ALIGN(16) vec3 axis;  // world, unit: about which all has turned by then,
  float angle;             // by so many radians
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
  CmGlow glow;
  CmMedium medium;
  CmLights lights;
  CmSurfaceTables surfaces;
  CmLamps lamps;
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
