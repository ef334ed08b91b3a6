/*
 * Cumulet: path-traced volumes on an adaptive tetrahedral grid, inside the host's own OpenGL context.
 *
 * Overview
 * --------
 * A viewer turns one volume (an OpenVDB or NanoVDB file, or voxels in memory) into an adaptive, conforming tetrahedral
 * grid (Benyoub and Dupuy, "Adaptive Tetrahedral Grids for Volumetric Path-Tracing", SIGGRAPH Talks 2025), path-traces
 * it progressively with compute shaders, and draws the picture so far into whatever framebuffer the host names:
 *
 *     cumulet_create -> cumulet_load_volume -> each frame: cumulet_render -> cumulet_destroy
 *
 * Surfaces (a glTF 2.0 file, or a host's own triangles) may stand in the volume, or alone: one picture, with light
 * between the two (cumulet_load_surfaces, cumulet_set_surfaces).
 *
 * The library makes no window and no context and links no OpenGL: functions come from the host's get_proc callback.
 * There are no globals that a result depends on: viewers, in one context or several, in one thread or several, do not
 * know of each other, unless they share programs (cumulet_programs).
 *
 * Life cycle
 *     A viewer is attached to a GL context or detached. cumulet_create attaches it if given get_proc, else
 *     cumulet_attach does. Detached, it loads, builds and takes settings, but cannot render. When the host's context
 *     goes away (a widget moved between windows), call cumulet_detach while it is still current, or
 *     cumulet_context_lost when it is gone, and cumulet_attach in the new one: volume, grid, surfaces, settings and
 *     camera are kept, GL objects are made anew within the next frames. cumulet_destroy needs the context current if
 *     the viewer is attached, and none if it is not; without it, GL objects stay behind until the context goes.
 *
 * Threads
 *     Calls for one viewer must not overlap, from whatever thread they come, with two exceptions that are safe at any
 *     time: cumulet_cancel and cumulet_get_progress. Calls marked [GL] need the attached context, or one that shares
 *     objects with it, current on the calling thread: without, they are CUMULET_ERROR_GL each time and change nothing,
 *     and the next call with it goes on. No other call touches GL. Camera, volume, sequence, live, surfaces, model and
 * programs handles may be used from any thread at any time. Files are read, grids are built, surfaces are posed and
 * physical skies are computed on worker threads of the viewer's own; cumulet_render uploads what they made, within its
 * time budget, and shows the last good picture until then. The newest wish wins and none starves: what changes faster
 * than it is read, built, posed or uploaded is shown as often as it can be, and the newest last. The update callback
 * comes from any thread, a worker's included, and not after cumulet_destroy. Neither it nor the log callback may call
 * the library, but for the two exceptions and to retain and release handles: any other call from inside one, for
 * whatever viewer or handle, is refused with CUMULET_ERROR_INVALID_ARGUMENT (cumulet_destroy does nothing). They may
 * come while [GL] calls of other viewers with the same programs wait for their turn: take no lock in them that is held
 * around a [GL] call. Calls that change a camera, an instance, a model, a sequence or a live volume run the update
 * callbacks of the viewers that show it while other calls for the same handle wait for them: nor take a lock that is
 * held around calls for such handles.
 *
 * End of the process
 *     A process may end while viewers work: by exit() on any thread, a callback's included, by a return from main, or
 *     by dlclose of the library. Work under way is cancelled and the threads of the library are joined before the
 *     library's static objects, and those of the libraries that it uses, are destroyed. No callback is made from then
 *     on. Calls that other threads have under way are waited for, 10 seconds at most (1 second if exit() is called in a
 *     callback), and further calls from them fail with CUMULET_ERROR_CANCELLED. The thread that ends the process may
 *     still destroy viewers and release handles in destructors of static objects. A callback that may be made while
 *     the language runtime of the host shuts down (Python's, for example) must be able to run then: destroy the viewer
 *     before. _exit, quick_exit and abort join nothing. In a forked child, viewers of the parent are refused by every
 *     call, cumulet_destroy does nothing with them, and exit() does not wait for threads that the child does not have.
 *
 * OpenGL state
 *     Version 4.5, core or compatibility profile. With CUMULET_GL_STATE_RESTORE (the default) a [GL] call leaves all
 *     state as it found it. It reads no state but: pixel buffers and parameters, bindings and capabilities are set to
 *     what it needs first. What a call does not use it neither asks for nor sets; what it does it asks for once, and
 *     puts back. It may use:
 *       - the current program and program pipeline, the vertex array binding, the draw and read framebuffer bindings
 *       - active texture; on units 0-15 the texture bindings of every target and the sampler
 *       - storage buffer bindings 0-7, uniform buffer bindings 0-7 and their generic points, the dispatch indirect
 *         buffer, image units 0-7
 *       - pixel pack and unpack buffers and all pixel store parameters
 *       - viewport 0, scissor test and box 0, colour mask (of every draw buffer), depth mask, function, test and range,
 *         depth clamp, stencil test
 *       - blending (enable, functions, equations) of draw buffers 0 and 1 and the enable of the others
 *       - cull face (enable, mode), front face, polygon mode and smoothing, polygon offset enables
 *       - rasterizer discard, logic op, multisample, sample shading, sample alpha to coverage and to one
 *       - sample coverage and mask, primitive restart (both), clip distances 0-7, clip control, dither
 *       - GL_FRAMEBUFFER_SRGB, read color clamp
 *     and in a context of the compatibility profile:
 *       - alpha test, polygon stipple, fragment color clamp
 *       - on units 0-15 the level-of-detail bias (glTexEnv, GL_TEXTURE_LOD_BIAS)
 *       - pixel transfer: color and stencil maps (their enables), index shift and offset, all scales and biases
 *       - with GL_ARB_imaging: the enables of color tables, convolutions, histogram and minmax, the color matrix, the
 *         matrix mode
 *
 *     and the contents of the frame's own target. It never touches: queries, transform feedback, sync objects of the
 *     host (but to wait for, on the device, the one in cumulet_gl_state_desc), the debug callback and its filters, or
 *     any other object. Do not call it inside transform feedback, conditional rendering or a query of the host's. With
 *     CUMULET_GL_STATE_HOST_RESETS nothing is saved or restored: afterwards the state listed above is undefined.
 *     Objects get labels and passes are debug groups (KHR_debug), up to two on top of the host's own, and none where
 *     these fill the driver's stack. glGetError is clean after every call; errors that were pending before are dropped.
 *     State of extensions, such as a depth bounds test or window rectangles, is the host's to disable.
 *
 * Compatibility profile
 *     Other legacy state neither changes pictures nor is touched: fog, lighting, shade model, texture enables, client
 *     arrays, pixel maps, matrix and attribute stacks. Calls may come between glPushAttrib and glPopAttrib. A [GL] call
 *     is CUMULET_ERROR_GL, names the cause and changes nothing
 *       - while a display list is open (glNewList), which would record it
 *       - while the render mode is GL_SELECT or GL_FEEDBACK
 *       - between glBegin and glEnd. GL then keeps an error of its own, which glGetError gives after glEnd.
 *     The next call outside of these goes on. cumulet_detach and cumulet_destroy work in display lists and render
 *     modes, because GL deletes objects at once. Between glBegin and glEnd, cumulet_destroy leaves GL objects behind.
 *     get_proc must give glPixelTransferf, glTexEnvf and glGetTexEnvfv, and with GL_ARB_imaging glMatrixMode and
 *     glLoadMatrixf; without one of them, attaching is CUMULET_ERROR_UNSUPPORTED. It is also asked for
 *     eglGetCurrentContext, OSMesaGetCurrentContext, wglGetCurrentContext and glXGetCurrentContext, and may give NULL
 *     for each. They tell a call between glBegin and glEnd from one without a context; without them, the error names
 *     both. Object names must come from glGen or glCreate calls: names that a host makes up may be the library's.
 *
 * Ownership
 *     Handles belong to the caller that got them and end with the function named beside the type; what a handle refers
 *     to lives on while a viewer uses it. The host's textures and framebuffers stay the host's; a texture in a
 *     cumulet_frame_result stays the viewer's. Strings and arrays that are passed in are copied.
 *
 * Errors
 *     Every function that can fail returns a cumulet_status; cumulet_last_error (or the error buffer of a call without
 *     a viewer) gives one line that names the file, where there is one, and the cause. A call that fails leaves the
 *     viewer as it was, and it still draws what it had. No C++ exception leaves the library.
 *     Numbers in texts are those of the classic locale, and files are read alike, in every locale of the process.
 *
 *     Work that fails on a worker thread is reported by cumulet_wait, by `status` of cumulet_progress and by
 *     CUMULET_RENDER_FAILED (which leaves out CUMULET_ERROR_CANCELLED), by one rule for all kinds of content. The kinds
 *     are, in this order: the volume (of a file, a cumulet_volume, a sequence or a live volume), the volumes of
 *     instances, the surfaces, the models, and the environment or physical sky. Each kind keeps the failure of its last
 *     work until the next call that loads or sets this kind, with NULL too; work that such a call ends counts as
 *     cancelled. For instances and models it is kept as long as one that failed is shown. Reported is the first kind
 *     that has a failure, each time, until a call begins other work: a load, a set call of any kind, or a setting that
 *     has something built anew. From then on a failure that was reported is not reported again. volume_status,
 *     surfaces_status and environment_status of cumulet_progress still have it.
 *
 * Files
 *     Paths are UTF-8. A relative path is relative to the current folder of the process at the time of the call that
 *     gives it, as are files that this file names; the folder may change while a worker reads. Messages have the path
 *     as it was given.
 *
 * Descriptors
 *     Set struct_size to sizeof the struct and zero the rest: zero means the default. Unknown enum values are errors.
 *     A struct from an older header is shorter, and what it lacks is zero. Any other size, one that cuts a field or
 *     that a newer header has among them, is CUMULET_ERROR_INVALID_ARGUMENT.
 *
 * Units and conventions
 *     World space is the VDB's own (metres, +Y up, right-handed). Extinction is density_scale x grid value in
 *     1 / world unit. Radiance and irradiance are linear Rec. 709 RGB in any consistent unit. Matrices are 16 doubles,
 *     column-major, for column vectors, as OpenGL takes them. Sizes and positions on screen are physical pixels;
 *     pixel (0, 0) is the top left, and positions are of a pixel's top left corner.
 *
 *     Places are doubles and may be anywhere within 1e12 of the origin: a scene in map or earth-centered coordinates
 *     looks as it does at the origin. The viewer subtracts a scene origin, in double precision, before anything becomes
 *     a float. Where a scene is much wider than the thing nearest to the camera, that origin follows the camera. Floats
 * that a host or a file stores far from 0 have lost precision before: keep such offsets in matrices and in nodes'
 *     translations. A warning in the log reports vertices that are rounded by 1/4096 of their mesh's size or more.
 */
#ifndef CUMULET_CUMULET_H
#define CUMULET_CUMULET_H

#include <stddef.h>
#include <stdint.h>

#if defined(CUMULET_STATIC)
#define CUMULET_API
#elif defined(_WIN32)
#if defined(CUMULET_BUILDING)
#define CUMULET_API __declspec(dllexport)
#else
#define CUMULET_API __declspec(dllimport)
#endif
#else
#define CUMULET_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define CUMULET_VERSION_MAJOR 0
#define CUMULET_VERSION_MINOR 2
#define CUMULET_VERSION_PATCH 0

typedef struct cumulet_viewer cumulet_viewer;           /* cumulet_destroy */
typedef struct cumulet_volume cumulet_volume;           /* cumulet_volume_release */
typedef struct cumulet_surfaces cumulet_surfaces;       /* cumulet_surfaces_release */
typedef struct cumulet_camera cumulet_camera;           /* cumulet_camera_release */
typedef struct cumulet_programs cumulet_programs;       /* cumulet_programs_release */
typedef struct cumulet_environment cumulet_environment; /* cumulet_environment_release */
typedef struct cumulet_sequence cumulet_sequence;       /* cumulet_sequence_release */
typedef struct cumulet_live cumulet_live;               /* cumulet_live_release */

typedef enum cumulet_status {
  CUMULET_OK = 0,
  CUMULET_ERROR_INVALID_ARGUMENT = -1, /* a null handle, a bad size, an unknown enum value, a bad number */
  CUMULET_ERROR_UNSUPPORTED = -2,      /* the context lacks a version, a function or a limit */
  CUMULET_ERROR_FILE = -3,             /* unreadable, malformed or unsuitable file (or voxels in memory) */
  CUMULET_ERROR_OUT_OF_MEMORY = -4,    /* host or GL memory */
  CUMULET_ERROR_GL = -5,               /* any other GL error, a [GL] call without the attached context among them */
  CUMULET_ERROR_INTERNAL = -6,         /* a bug in Cumulet: please report it */
  CUMULET_ERROR_CANCELLED = -7,        /* by cumulet_cancel, or because the process ends */
  CUMULET_ERROR_CONTEXT_LOST = -8,     /* the driver reset the context: the viewer is detached now */
  CUMULET_ERROR_DETACHED = -9,         /* a [GL] call on a viewer without a context */
  CUMULET_ERROR_TIMEOUT = -10          /* cumulet_wait: not ready in time */
} cumulet_status;

/* A status in a few English words. Any thread. */
CUMULET_API const char* cumulet_status_text(cumulet_status status);
/* The library's version, as major * 10000 + minor * 100 + patch. Any thread. */
CUMULET_API uint32_t cumulet_version(void);

/* ---- Viewer ---------------------------------------------------------------------------------------------------- */

typedef enum cumulet_log_level {
  CUMULET_LOG_DEBUG = 0,
  CUMULET_LOG_INFO = 1,
  CUMULET_LOG_WARNING = 2,
  CUMULET_LOG_ERROR = 3
} cumulet_log_level;

/*
 * The address of a GL function, or NULL. Called during cumulet_create and cumulet_attach only. The functions are called
 * for as long as the viewer is attached, and any other viewer that shares its programs (cumulet_programs).
 */
typedef void* (*cumulet_get_proc_fn)(void* user, const char* name);
/* From the calling thread or the viewer's worker; message, one line, lives until return. */
typedef void (*cumulet_log_fn)(void* user, cumulet_log_level level, const char* message);
/*
 * There is something new to render: a volume was loaded, a grid is ready, a setting or the camera changed. From any
 * thread. Schedule a frame and return; do not call the library. Coalesced: not called again before the next
 * cumulet_render.
 */
typedef void (*cumulet_update_fn)(void* user);

/*
 * A piece of work has ended, for a timeline: "frame" (cumulet_render), its passes ("cumulet: trace"), a
 * "cumulet: warm-up", or a job of a worker ("building the grid", a file). From the thread that did it; begin and end
 * are seconds of its steady clock (CLOCK_MONOTONIC); pieces of one thread lie in each other or apart. name lives until
 * return. As for the update callback: do not call the library.
 */
typedef void (*cumulet_trace_fn)(void* user, const char* name, double begin, double end);

typedef enum cumulet_gl_state {
  CUMULET_GL_STATE_RESTORE = 0,    /* [GL] calls leave the state as they found it */
  CUMULET_GL_STATE_HOST_RESETS = 1 /* they do not: the host sets all it needs afterwards (Qt's and GTK's do) */
} cumulet_gl_state;

typedef struct cumulet_programs_desc {
  size_t struct_size;
  /*
   * Where binaries of programs are kept between runs, so that the driver need not compile again: files of at most
   * 256 MiB together, the least used go first; made with the first of them, in UTF-8. They are good for one driver and
   * one version of the library; what is damaged or another's is ignored and written anew, and any number of processes
   * may use one folder. What is in them runs in the driver: nobody else should be able to write there. NULL or "":
   * nowhere. A folder that cannot be written is told by one warning in the log.
   */
  const char* folder;
  /*
   * For those who work on the library: the shaders of this folder (a copy of glsl/) instead of the library's own, read
   * anew when they change; one that does not build is told by one warning, and the one before it serves on. Debug
   * builds of the library alone: CUMULET_ERROR_UNSUPPORTED in others. NULL or "": the library's own.
   */
  const char* shaders;
} cumulet_programs_desc;

/*
 * GL programs, to be shared by viewers (cumulet_create_desc): those that are attached to one context, or to contexts
 * that share objects, compile each program once among them. Programs end with the last viewer that is attached to them,
 * what is in the folder does not. They have in common, too, what live volumes keep in GL. [GL] calls of viewers that
 * share programs wait for each other where they come from several threads at once; callbacks of the one whose turn it
 * is come meanwhile: take no lock in them that is held around a [GL] call. Functions that get_proc gave one of these
 * viewers stay callable until none of them is attached. Any thread; error as in cumulet_create.
 */
CUMULET_API cumulet_status cumulet_programs_create(const cumulet_programs_desc* desc, cumulet_programs** out,
                                                   char* error, size_t error_size);
CUMULET_API cumulet_programs* cumulet_programs_retain(cumulet_programs* programs); /* returns it; NULL is allowed */
CUMULET_API void cumulet_programs_release(cumulet_programs* programs);             /* NULL is allowed */

typedef struct cumulet_create_desc {
  size_t struct_size;
  cumulet_get_proc_fn get_proc; /* NULL: detached */
  void* get_proc_user;
  cumulet_log_fn log; /* NULL: silence */
  void* log_user;
  cumulet_update_fn update; /* NULL: none */
  void* update_user;
  cumulet_gl_state gl_state;
  cumulet_trace_fn trace; /* NULL: none */
  void* trace_user;
  cumulet_programs* programs; /* retained; NULL: the viewer's own, kept nowhere */
} cumulet_create_desc;

/*
 * [GL] if get_proc is given: checks the current context (version 4.5, compute limits); compiles and allocates nothing
 * yet. On failure *out is NULL and error (if not NULL) receives the zero-terminated cause in error_size bytes.
 */
CUMULET_API cumulet_status cumulet_create(const cumulet_create_desc* desc, cumulet_viewer** out, char* error,
                                          size_t error_size);
/*
 * [GL] if attached. Cancels and waits for the worker, frees everything. NULL is allowed.
 *
 * The worker looks every few milliseconds whether it is cancelled, in all that it does: some 20 ms on an idle machine.
 * It does not wait for what cannot be interrupted, a library's decoder under way (an image, a compressed mesh, JSON) or
 * gigabytes on their way back to the system. Those end on threads of the library that may outlive the viewer by a
 * second or so. They call back nothing, know no GL and no handle, and use no file; unloading the library and exit()
 * wait for them.
 */
CUMULET_API void cumulet_destroy(cumulet_viewer* viewer);
/* The last failed call of this viewer in one line, "" if the last call succeeded; lives until the next call. */
CUMULET_API const char* cumulet_last_error(const cumulet_viewer* viewer);

/* [GL] Attaches a detached viewer to the current context; checks as cumulet_create does. */
CUMULET_API cumulet_status cumulet_attach(cumulet_viewer* viewer, cumulet_get_proc_fn get_proc, void* get_proc_user);
/* [GL] Deletes the viewer's GL objects and detaches it. Nothing if it is detached already. */
CUMULET_API cumulet_status cumulet_detach(cumulet_viewer* viewer);
/* Detaches without touching GL: the context, and with it every object, is gone. */
CUMULET_API cumulet_status cumulet_context_lost(cumulet_viewer* viewer);

/* ---- Volumes --------------------------------------------------------------------------------------------------- */

/*
 * A scalar fog volume in main memory: immutable, counted, free of GL, to be shown by any number of viewers. These
 * calls are synchronous, for any thread; error as in cumulet_create. cumulet_load_volume is the asynchronous way.
 * The medium is zero outside the bounds of the active voxels. Negative and non-finite voxels count as zero, and so do
 * those beyond 1e30 or -1e30 of every field, as fill values are. A grid
 * without active voxels is an empty volume, which shows nothing: cumulet_volume_info tells, cumulet_load_volume logs
 * warnings.
 */

/*
 * Reads one scalar grid of a .vdb or .nvdb file. grid_name NULL or "": the one called "density"; else the first of
 * those called "smoke", "soot", "flames", "flame", "fire", "temperature", "heat"; else the first scalar fog grid of the
 * file. A name in this case comes before the same name in another case. cumulet_load_volume logs a warning that names
 * the other grids. "name[1]" is the second of that name.
 */
CUMULET_API cumulet_status cumulet_volume_open(const char* path, const char* grid_name, cumulet_volume** out,
                                               char* error, size_t error_size);

/* One grid of a file, and where it stands. */
typedef struct cumulet_volume_file_desc {
  size_t struct_size;
  const char* path;
  const char* grid_name; /* as above */
  /*
   * Affine: from the world space of the file to that of the picture, in which +Y is up; zero: identity. For a file
   * whose up axis is Z, as Blender's and Mantaflow's, (x, y, z) to (x, z, -y): columns 1,0,0,0, 0,0,-1,0, 0,1,0,0,
   * 0,0,0,1.
   */
  double to_world[16];
  /*
   * What else of the file is shown. NULL or "": by name (as docs/grids.md says); "none": not at all; else a grid's
   * name, and that it is not there is an error. Grids of other voxels than density's are resampled to these.
   */
  const char* temperature_grid;
  const char* flame_grid;
  const char* color_grid;
  /*
   * Henyey-Greenstein g from place to place, -1 to 1: where the file has it, it stands in place of
   * cumulet_medium_desc.anisotropy, of two lobes the first one's; not of Mie. A cell has the mean of what scatters in
   * it, at most 0.999 either way; where the grid has nothing, 0.
   */
  const char* anisotropy_grid;
  /*
   * 1: cumulet_load_volume_file gives the medium, as the volume is shown, the density scale that
   * cumulet_volume_suggest_density_scale tells of it, and builds the grid for that. Cells are built for a density scale
   * (cumulet_grid_desc): who sets it when the volume is there may have them built twice. What cumulet_set_medium
   * says until then does not count. 0: it is left as it is, as of a volume that shows nothing, and by
   * cumulet_volume_open_file.
   */
  int32_t suggested_density_scale;
  /*
   * How what is there moves, world units a second: what CUMULET_AOV_VELOCITY tells, and what nothing else of a picture
   * depends on. A grid of vectors, or the three of numbers with x, y and z behind this name; to_world turns and
   * stretches them. "none" saves its reading, up to 36 bytes a voxel of main memory, and 8 a cell of either.
   * One that is named must be good; one that is found by its name alone is left out where it cannot be had, with a
   * warning.
   */
  const char* velocity_grid;
  /*
   * Gets the notes and warnings of cumulet_volume_open and cumulet_volume_open_file, on the calling thread, before they
   * return. NULL: they are dropped. Calls that load through a viewer log to that viewer's callback and ignore this one.
   */
  cumulet_log_fn log;
  void* log_user;
} cumulet_volume_file_desc;

CUMULET_API cumulet_status cumulet_volume_open_file(const cumulet_volume_file_desc* desc, cumulet_volume** out,
                                                    char* error, size_t error_size);

/* Voxels in a box. Active are those that are not zero. */
typedef struct cumulet_dense_desc {
  size_t struct_size;
  const float* values; /* x fastest, then y, then z */
  uint64_t value_count;
  int32_t size[3];           /* value_count is their product */
  double index_to_world[16]; /* affine; voxel (i,j,k) is the unit cube centred on (i,j,k); zero: identity */
  const char* name;          /* for messages; NULL: "dense" */
} cumulet_dense_desc;

CUMULET_API cumulet_status cumulet_volume_from_dense(const cumulet_dense_desc* desc, cumulet_volume** out, char* error,
                                                     size_t error_size);

/* A box of voxels of one value, bounds inclusive. */
typedef struct cumulet_tile {
  int32_t min[3];
  int32_t max[3];
  float value;
  int32_t active; /* 0 or 1 */
} cumulet_tile;

/* A tree as OpenVDB has it (cumulet_openvdb.hpp makes this of an openvdb grid): bricks of 8^3 voxels, and tiles. */
typedef struct cumulet_sparse_desc {
  size_t struct_size;
  const int32_t* brick_origins; /* 3 a brick: its lowest voxel, multiples of 8, no two the same */
  const float* brick_values;    /* 512 a brick, z fastest, then y, then x */
  const uint64_t* brick_active; /* 8 words a brick, word x, bit y * 8 + z; NULL: all voxels are active */
  uint64_t brick_count;
  const cumulet_tile* tiles; /* disjoint, not over bricks */
  uint64_t tile_count;
  float background;          /* of voxels in no brick and no tile */
  double index_to_world[16]; /* as above */
  const char* name;          /* for messages; NULL: "sparse" */
} cumulet_sparse_desc;

CUMULET_API cumulet_status cumulet_volume_from_sparse(const cumulet_sparse_desc* desc, cumulet_volume** out,
                                                      char* error, size_t error_size);

/* What the voxels of a field are. Of a colour all three are there or none, and so of a velocity. */
typedef enum cumulet_channel {
  CUMULET_CHANNEL_DENSITY = 0,
  CUMULET_CHANNEL_TEMPERATURE = 1, /* as cumulet_medium_desc has it */
  CUMULET_CHANNEL_FLAME = 2,
  CUMULET_CHANNEL_RED = 3, /* of what scatters: linear Rec. 709 */
  CUMULET_CHANNEL_GREEN = 4,
  CUMULET_CHANNEL_BLUE = 5,
  CUMULET_CHANNEL_ANISOTROPY = 6, /* -1 to 1, as cumulet_volume_file_desc.anisotropy_grid */
  CUMULET_CHANNEL_VELOCITY_X = 7, /* world units a second along the world's axes, as velocity_grid there */
  CUMULET_CHANNEL_VELOCITY_Y = 8,
  CUMULET_CHANNEL_VELOCITY_Z = 9
} cumulet_channel;

/* One channel's voxels. Its desc's name is of no meaning here. */
typedef struct cumulet_field {
  size_t struct_size; /* of all fields of an array the same: the distance between them */
  cumulet_channel channel;
  const cumulet_dense_desc* dense;   /* one of the two, and the other NULL */
  const cumulet_sparse_desc* sparse; /* cumulet_openvdb.hpp makes it of an OpenVDB grid */
} cumulet_field;

/* From any thread. Do not call the library, but to retain and release handles. */
typedef void (*cumulet_release_fn)(void* user);

/*
 * All that a simulation has at one moment: any of the channels, each once, in any order; one of density, temperature
 * and flame at least. A field of other voxels than density's is resampled to these, as a file's grid is
 * (docs/grids.md): hosts that step often give all fields the same size and index_to_world.
 */
typedef struct cumulet_state_desc {
  size_t struct_size;
  const cumulet_field* fields;
  uint64_t field_count;
  const char* name; /* for messages; NULL: "state" */
  /*
   * NULL: voxels are copied within the call. Else they are read later, where they are, and must stay as they are until
   * this is called with release_user: once, when they were read or nobody wants them any more, perhaps within the call;
   * not if the call fails. For cumulet_live_set alone, and updates cannot follow (cumulet_live_update).
   */
  cumulet_release_fn release;
  void* release_user;
} cumulet_state_desc;

/* A volume of several channels; they are copied. */
CUMULET_API cumulet_status cumulet_volume_from_state(const cumulet_state_desc* desc, cumulet_volume** out, char* error,
                                                     size_t error_size);

CUMULET_API cumulet_volume* cumulet_volume_retain(cumulet_volume* volume); /* returns it; NULL is allowed */
CUMULET_API void cumulet_volume_release(cumulet_volume* volume);           /* NULL is allowed */

typedef struct cumulet_volume_info {
  size_t struct_size;
  char name[128];
  uint64_t active_voxels;
  double bounds_min[3]; /* world space */
  double bounds_max[3];
  float max_value;
  uint64_t negative_voxels; /* that count as 0 */
  uint64_t non_finite_voxels;
  uint64_t huge_voxels;     /* finite, but beyond 1e30 or -1e30, as fill values are: they count as 0 */
  double temperature_scale; /* kelvin where its temperature is 1, for a medium whose temperature_scale is 0;
                               0: it has no temperature */
} cumulet_volume_info;

CUMULET_API cumulet_status cumulet_volume_get_info(const cumulet_volume* volume, cumulet_volume_info* info);

/*
 * A density scale (of cumulet_medium_desc) with which the volume looks like a body rather than a ghost or a block: a
 * mean optical depth of 8, taken over rays from all directions through what is visibly occupied: haze and a few extreme
 * voxels count for little. It depends on the volume alone, not on the camera; for a sequence, ask once, of a frame that
 * is not empty. Some milliseconds. CUMULET_ERROR_INVALID_ARGUMENT, *scale unchanged, for a volume that shows nothing.
 */
CUMULET_API cumulet_status cumulet_volume_suggest_density_scale(const cumulet_volume* volume, double* scale);

/* One grid of a file: refusal is "" if it can be shown, else why not. */
typedef void (*cumulet_grid_fn)(void* user, const char* name, const char* type, const char* refusal);
/* Calls fn for each grid of a .vdb or .nvdb file, reading no voxels. */
CUMULET_API cumulet_status cumulet_list_grids(const char* path, cumulet_grid_fn fn, void* user, char* error,
                                              size_t error_size);

/*
 * What is in a file, for a dialog that lets a person choose: immutable, for any thread. Texts live until it is
 * released.
 */
typedef struct cumulet_inspection cumulet_inspection; /* cumulet_inspection_release */

/* Reads the directory of a .vdb or .nvdb file; error as in cumulet_create. */
CUMULET_API cumulet_status cumulet_inspect_volume_file(const char* path, cumulet_inspection** out, char* error,
                                                       size_t error_size);
CUMULET_API void cumulet_inspection_release(cumulet_inspection* inspection); /* NULL is allowed */

typedef struct cumulet_volume_file_info {
  size_t struct_size;
  const char* format; /* "OpenVDB 225", "NanoVDB 32.9" */
  uint64_t bytes;     /* of the file */
  uint32_t grid_count;
  uint32_t metadata_count; /* entries of the file as a whole */
  int32_t default_grid;    /* the one that is read if none is named; -1: none can be shown */
} cumulet_volume_file_info;

CUMULET_API cumulet_status cumulet_inspection_get_file(const cumulet_inspection* inspection,
                                                       cumulet_volume_file_info* info);

enum { CUMULET_HISTOGRAM_BINS = 64 };

typedef enum cumulet_grid_values {
  CUMULET_GRID_VALUES_NONE = 0,    /* voxels of a type that is not read, or damaged: what follows values is 0 */
  CUMULET_GRID_VALUES_SCALARS = 1, /* numbers */
  CUMULET_GRID_VALUES_LENGTHS = 2  /* of vectors */
} cumulet_grid_values;

typedef struct cumulet_grid_info {
  size_t struct_size;
  const char* name;       /* "name[1]" where the file repeats one */
  const char* type;       /* as the file says: "float", "half", "vec3s", ... */
  const char* grid_class; /* "fog volume", "level set", "unknown", ... */
  const char* refusal;    /* "" if it can be shown, else why not */
  uint32_t metadata_count;
  cumulet_grid_values values;
  double index_to_world[16]; /* in the file's own world space */
  uint64_t active_voxels;
  int32_t voxel_min[3]; /* the box of the active voxels, inclusive */
  int32_t voxel_max[3];
  double bounds_min[3]; /* of the same, world space */
  double bounds_max[3];
  float min_value; /* of the finite active voxels */
  float max_value;
  double mean_value;
  uint64_t negative_voxels;
  uint64_t non_finite_voxels;
  uint64_t memory_bytes; /* what a volume of it holds in main memory, at most */
  /* Counts of the finite active voxels in equal steps from min_value to max_value. */
  uint64_t histogram[CUMULET_HISTOGRAM_BINS];
  /*
   * What it is taken for by its name: "density", "temperature", "flame", "color", "anisotropy", "velocity", or "".
   */
  const char* channel;
} cumulet_grid_info;

/* One grid of the file, from 0. The first call for a grid reads its voxels: seconds, for a large one. */
CUMULET_API cumulet_status cumulet_inspection_get_grid(cumulet_inspection* inspection, uint32_t grid,
                                                       cumulet_grid_info* info);

/* An entry of metadata, as text of at most 4096 bytes, in whatever encoding the file has. */
typedef struct cumulet_metadata {
  size_t struct_size;
  const char* name;
  const char* type; /* "string", "bool", "vec3i", ... */
  const char* value;
} cumulet_metadata;

/* grid -1: of the file as a whole. CUMULET_ERROR_INVALID_ARGUMENT for a grid or an entry that is not there. */
CUMULET_API cumulet_status cumulet_inspection_get_metadata(const cumulet_inspection* inspection, int32_t grid,
                                                           uint32_t index, cumulet_metadata* out);

/* ---- Sequences ------------------------------------------------------------------------------------------------- */

/*
 * Volumes that follow each other in time, of a file each: counted, free of GL, to be played by any number of viewers,
 * all at the same moment. A host moves it, by the clock that its animations have or frame by frame; viewers that show
 * it (cumulet_set_sequence) call their update callback where that is another frame. These calls are for any thread;
 * error as in cumulet_create. Frames count from 0.
 */

typedef struct cumulet_sequence_desc {
  size_t struct_size;
  const char* const* paths; /* of a .vdb or .nvdb file a frame, copied; they need not be there, or right */
  uint64_t count;           /* 1 to 1,000,000 */
  /*
   * What is shown of each file, and where it stands; its path is not looked at. With suggested_density_scale one
   * density scale is suggested for all frames. NULL: what is found by name, there.
   */
  const cumulet_volume_file_desc* file;
  /*
   * Main memory for frames that are ready, in each viewer that shows it: cells, and beside these, as long as there is
   * room, voxels, so that other settings need not read files anew. What is needed last goes first; the frame that is
   * shown, and those that are being read and built, come on top. 0: 2 GiB.
   */
  uint64_t memory_bytes;
} cumulet_sequence_desc;

CUMULET_API cumulet_status cumulet_sequence_create(const cumulet_sequence_desc* desc, cumulet_sequence** out,
                                                   char* error, size_t error_size);
CUMULET_API cumulet_sequence* cumulet_sequence_retain(cumulet_sequence* sequence); /* returns it; NULL is allowed */
CUMULET_API void cumulet_sequence_release(cumulet_sequence* sequence);             /* NULL is allowed */

/* What follows the last frame that is played, and what comes before the first. */
typedef enum cumulet_repeat {
  CUMULET_REPEAT_HOLD = 0,     /* these stay */
  CUMULET_REPEAT_LOOP = 1,     /* they begin anew */
  CUMULET_REPEAT_PING_PONG = 2 /* they run back, and forth again; neither end comes twice */
} cumulet_repeat;

/*
 * What is shown between two frames. Both ways make a volume of each moment, which is built as a frame is, on the same
 * worker and within the same memory, and so is there only as fast as that goes. What cannot be made, for one of the two
 * files cannot be read, is the frame before it.
 */
typedef enum cumulet_between {
  CUMULET_BETWEEN_NONE = 0, /* the frame that came last */
  /* Both frames, each by its share, field by field; colour, anisotropy and velocity by how much smoke has them. */
  CUMULET_BETWEEN_BLEND = 1,
  /*
   * Both frames carried to that moment along their own velocity, one on, the other back (semi-Lagrangian, midpoint
   * rule), and then blended: smoke moves, where blending would fade it from one place to the other. Velocity as the
   * fields of a file have it (docs/grids.md): world units a second. Where one of both has none, blended alone.
   */
  CUMULET_BETWEEN_ADVECT = 2
} cumulet_between;

/* How a clock runs through the frames. */
typedef struct cumulet_playback_desc {
  size_t struct_size;
  double frames_per_second; /* up to 1e6; 0: 24 */
  double offset_seconds;    /* of the clock, when first_frame comes; -1e9 to 1e9 */
  cumulet_repeat repeat;
  uint32_t first_frame; /* that is played */
  uint32_t frame_count; /* how many are; 0: all from the first on */
  cumulet_between between;
  /*
   * Moments from a frame to the next, the frame's own among them, at which another picture may be: each is there until
   * the next comes, so that what was made serves again. 1 to 1000, and 1,000,000 in the whole sequence at most; 0: 4.
   * CUMULET_BETWEEN_NONE: not looked at.
   */
  uint32_t subframes;
  /*
   * By which velocities are multiplied, -1e6 to 1e6; 0: 1. The time between two frames is 1 / frames_per_second: of a
   * simulation of 24 frames a second that is played at 12, and whose velocities are units a second, it is 0.5; of
   * velocities that are units a frame it is frames_per_second.
   */
  double velocity_scale;
} cumulet_playback_desc;

/*
 * From the next cumulet_sequence_set_time on; it stays where it is. CUMULET_ERROR_INVALID_ARGUMENT, and it stays as it
 * was, for frames that it has not.
 */
CUMULET_API cumulet_status cumulet_sequence_set_playback(cumulet_sequence* sequence, const cumulet_playback_desc* desc);
/*
 * To this moment of the clock, -1e9 to 1e9 seconds. Whether time runs forwards or backwards, as it did between the last
 * two of these calls, tells viewers which frames are next.
 */
CUMULET_API cumulet_status cumulet_sequence_set_time(cumulet_sequence* sequence, double seconds);
/*
 * To this frame, 0 to count - 1, played or not; of 2.25 frame 2 is shown, or where something is between frames, what is
 * a quarter of the way to frame 3. Between the last frame of a loop and its first the last one stays.
 */
CUMULET_API cumulet_status cumulet_sequence_set_frame(cumulet_sequence* sequence, double frame);
/* Which frame cumulet_sequence_set_time would come to; it stays where it is. */
CUMULET_API cumulet_status cumulet_sequence_get_frame_at(const cumulet_sequence* sequence, double seconds,
                                                         uint32_t* frame);
/* The other way round: the first moment, from offset_seconds on, at which a frame that is played comes; of one that is
 * not what that would be if it were. */
CUMULET_API cumulet_status cumulet_sequence_get_time_of(const cumulet_sequence* sequence, uint32_t frame,
                                                        double* seconds);

/* ---- Live volumes ---------------------------------------------------------------------------------------------- */

/*
 * A volume that goes on changing: a host hands over state after state, as its simulation steps, and viewers that show
 * it (cumulet_set_live, cumulet_instance_desc.live) show the newest. Counted, free of GL, for any number of viewers.
 * Volumes never change, which is what lets viewers, instances and workers share them; so this is a handle of its own,
 * behind which one volume follows another. These calls are for any thread, also while others are in calls for the same
 * handle; error as in cumulet_create.
 *
 * None of them waits for a build: a call copies what it is given and returns (or does not copy, see
 * cumulet_state_desc.release). A state that nobody began to build when the next one comes is not built: there is one
 * under way and one that waits, however fast they come. In numbers: states count from 1 on, updates among them.
 *
 * Voxels that a simulation has in textures or buffers of OpenGL: cumulet_live_set_gl, a call of a viewer's, below.
 */

typedef struct cumulet_live_desc {
  size_t struct_size;
  /*
   * World bounds of all that the simulation will ever fill, for what must not jump from state to state: where a camera
   * that fits is placed, a ground below, bounds that are told. Zero: those of the state that is shown.
   */
  double bounds_min[3];
  double bounds_max[3];
  /*
   * 1: what cumulet_live_set_gl is given stays in GL, where its grid is made; only what is known of each 8^3 voxels of
   * a field comes to main memory, half a kilobyte. 0: the voxels do. See there.
   */
  int32_t stays_in_gl;
} cumulet_live_desc;

CUMULET_API cumulet_status cumulet_live_create(const cumulet_live_desc* desc, cumulet_live** out, char* error,
                                               size_t error_size);
CUMULET_API cumulet_live* cumulet_live_retain(cumulet_live* live); /* returns it; NULL is allowed */
CUMULET_API void cumulet_live_release(cumulet_live* live);         /* NULL is allowed */

/*
 * The whole of the next state, of whatever channels and sizes: what it has not is gone. As a volume alone of the same
 * fields it is the same grid, bit for bit, and of the same samples the same picture.
 *
 * A number that is not finite is refused, CUMULET_ERROR_FILE with one line that names state, channel and voxel, and so
 * is all else that cumulet_volume_from_state refuses; negative ones count as 0, but for anisotropy and velocity. The
 * state before stays, and the next may be handed over. Where voxels are read later (release) so is what is in them:
 * that it is refused is told by a warning in the log, cumulet_get_progress and CUMULET_RENDER_FAILED, as of a file.
 */
CUMULET_API cumulet_status cumulet_live_set(cumulet_live* live, const cumulet_state_desc* desc, char* error,
                                            size_t error_size);
/*
 * The next state is the last one handed over but for some bricks: sparse fields alone, of which brick_origins,
 * brick_values and brick_active are looked at. A brick takes the place of the one that is there, or is added; give one
 * that is empty from then on zeros, and no active voxels. It still takes 2 KiB. A dense field's bricks begin at voxel
 * 0. What is not named stays. It is the same, bit for bit, as if all of it had been handed over.
 *
 * CUMULET_ERROR_INVALID_ARGUMENT before the first cumulet_live_set, for a channel that the state has not (give it with
 * no bricks), or has with tiles, after one with release, of which the library keeps no voxels, or one refused when it
 * was read.
 */
CUMULET_API cumulet_status cumulet_live_update(cumulet_live* live, const cumulet_state_desc* desc, char* error,
                                               size_t error_size);
/*
 * The newest state as a volume, retained for the caller, who releases it: for what is told of volumes, and for
 * instances. *out is NULL before the first state. Reads the state if nobody did yet, which takes as long as
 * cumulet_volume_from_state. CUMULET_ERROR_UNSUPPORTED where its voxels are in GL (cumulet_live_desc.stays_in_gl):
 * these are brought, and a later call has them.
 */
CUMULET_API cumulet_status cumulet_live_get_volume(cumulet_live* live, cumulet_volume** out, char* error,
                                                   size_t error_size);

/* ---- Surfaces -------------------------------------------------------------------------------------------------- */

/*
 * Triangles with their materials, lights, cameras and animations in main memory: immutable, counted, free of GL, to be
 * shown by any number of viewers, at one moment of an animation each. World space and units are the volume's. These
 * calls are synchronous, for any thread; error as in cumulet_create. cumulet_load_surfaces is the asynchronous way.
 *
 * The library reads all of glTF 2.0's triangles, materials, skins, morph targets, animations, cameras, and these
 * extensions: KHR_lights_punctual, KHR_materials_unlit, _emissive_strength, _ior, _specular, _clearcoat, _transmission,
 * _volume (which refracts and absorbs within closed meshes, one in another two deep; a thickness of 0 is a thin wall,
 * whose light goes straight on where it is smooth), _dispersion, _sheen, _anisotropy, _iridescence, _variants and
 * _pbrSpecularGlossiness (as the metallic-roughness material that looks like it, textures converted as they are read).
 * In previews, before the first samples, and where surfaces are drawn and not traced, volumes are walls of their
 * thickness, unrefracted and of one colour, anisotropic lobes are round, and sheen and films are left out.
 * KHR_texture_transform, KHR_mesh_quantization, KHR_draco_mesh_compression, EXT_meshopt_compression, EXT_texture_webp,
 * KHR_node_visibility (what is hidden neither shows nor counts), KHR_animation_pointer (transforms, weights and
 * visibility of nodes, factors and texture transforms of materials, lights; a warning names what else a file animates),
 * EXT_mesh_gpu_instancing (each mesh once in memory, however many instances it has; those that are flat are not drawn).
 * Watts per steradian and per square metre stand for KHR_lights_punctual's candela and lux. Emissive triangles are
 * lights, to their front alone where the material is single-sided. Surfaces of alphaMode BLEND cover by chance, ray by
 * ray: any order is right.
 */

/* Reads a .gltf or .glb file. */
CUMULET_API cumulet_status cumulet_surfaces_open(const char* path, cumulet_surfaces** out, char* error,
                                                 size_t error_size);

/*
 * The same of a file's bytes, told apart by content. Files that it refers to are looked for in base_directory; NULL:
 * such a file is an error. name stands for the path in messages; NULL: "memory". bytes are not used after the return.
 */
CUMULET_API cumulet_status cumulet_surfaces_from_memory(const void* bytes, size_t size, const char* base_directory,
                                                        const char* name, cumulet_surfaces** out, char* error,
                                                        size_t error_size);

/* Triangles of one material (glTF's metallic-roughness model). */
typedef struct cumulet_mesh_desc {
  size_t struct_size;     /* of all meshes of an array the same: the distance between them */
  const float* positions; /* 3 a vertex; near 0: an offset that is much larger than the mesh belongs in to_world */
  const float* normals;   /* 3 a vertex, of any length; NULL: flat, each triangle's own */
  const float* colors;    /* 4 a vertex, each in [0, 1], linear, times base_color; NULL: white */
  uint64_t vertex_count;
  const uint32_t* indices; /* 3 a triangle, counter-clockwise as seen from its front */
  uint64_t index_count;    /* 0: every three vertices are a triangle */
  double to_world[16];     /* affine; zero: identity */
  float base_color[4];     /* each in [0, 1], linear; below 1, alpha is the part that covers; all zero: white, opaque */
  float metallic;          /* 0 to 1 */
  float smoothness;        /* 1 - roughness, 0 to 1 */
  float emission[3];       /* radiance of the front */
  int32_t double_sided;    /* 0: the camera sees through it from behind; 1: both sides are fronts */
  /*
   * 3 a vertex, of its own space a second: for motion blur (cumulet_sampling_desc.shutter_seconds), while the shutter
   * is open each vertex goes straight by it, and is at its position at the frame's moment. Normals that are given stay.
   * NULL: it stands still.
   */
  const float* velocities;
} cumulet_mesh_desc;

typedef struct cumulet_triangles_desc {
  size_t struct_size;
  const cumulet_mesh_desc* meshes;
  uint64_t mesh_count;
  const char* name; /* for messages; NULL: "triangles" */
} cumulet_triangles_desc;

/* A host's own meshes, copied. What moves is made anew, frame by frame; velocities blur it in between. */
CUMULET_API cumulet_status cumulet_surfaces_from_triangles(const cumulet_triangles_desc* desc, cumulet_surfaces** out,
                                                           char* error, size_t error_size);

CUMULET_API cumulet_surfaces* cumulet_surfaces_retain(cumulet_surfaces* surfaces); /* returns it; NULL is allowed */
CUMULET_API void cumulet_surfaces_release(cumulet_surfaces* surfaces);             /* NULL is allowed */

typedef struct cumulet_surfaces_info {
  size_t struct_size;
  char name[128];     /* the path, or what the host named it */
  uint64_t triangles; /* that are shown: those of a mesh that two nodes place count twice, as those of instances */
  uint32_t materials; /* of the file, used or not, as meshes, primitives and textures */
  uint32_t lights;    /* that are shown, as cameras */
  uint32_t cameras;
  uint32_t animations;
  double bounds_min[3]; /* world space, as it rests; zero without triangles */
  double bounds_max[3];
  uint32_t meshes;
  uint32_t primitives; /* parts of meshes, each of one material */
  uint32_t textures;
  uint32_t variants; /* choices of materials, one of which cumulet_surface_settings_desc may make */
} cumulet_surfaces_info;

/* The first call takes as long as a pose. */
CUMULET_API cumulet_status cumulet_surfaces_get_info(const cumulet_surfaces* surfaces, cumulet_surfaces_info* info);

typedef struct cumulet_animation_info {
  size_t struct_size;
  char name[128];  /* "" if it has none */
  double duration; /* seconds */
} cumulet_animation_info;

/* CUMULET_ERROR_INVALID_ARGUMENT if there is none of this number. */
CUMULET_API cumulet_status cumulet_surfaces_get_animation(const cumulet_surfaces* surfaces, uint32_t index,
                                                          cumulet_animation_info* info);

typedef struct cumulet_variant_info {
  size_t struct_size;
  char name[128]; /* "" if it has none */
} cumulet_variant_info;

/* KHR_materials_variants. CUMULET_ERROR_INVALID_ARGUMENT if there is none of this number. */
CUMULET_API cumulet_status cumulet_surfaces_get_variant(const cumulet_surfaces* surfaces, uint32_t index,
                                                        cumulet_variant_info* info);

/* ---- Environments ------------------------------------------------------------------------------------------------ */

/*
 * A picture of all that is far away, equirectangular, as a light: immutable, counted, free of GL, to surround any
 * number of viewers. Rows go from +Y, the upper edge, down to -Y; the middle is at +Z, and a quarter of the width left
 * of it is +X. Values are linear Rec. 709 radiance, bilinear between the middles of pixels. What of a pixel is not
 * finite, negative or above 1e30 counts as 0: cumulet_environment_info tells, cumulet_set_environment logs a warning.
 * It holds 16 bytes a pixel, and as many in GL. These calls are synchronous, some 0.2 s for 2048 x 1024 pixels, for any
 * thread; error as in cumulet_create. cumulet_load_environment is the asynchronous way.
 */

/*
 * Reads a Radiance (.hdr) or OpenEXR (.exr) file, of up to 16384 pixels a side, which it recognizes by content. Of an
 * OpenEXR file it reads one flat part of channels R, G and B, or Y with or without RY and BY, or X, Y and Z, without a
 * layer if there are such; it places the data window in the display window, resamples a cube map (envmap) of up to 4096
 * pixels a face, and converts its chromaticities to Rec. 709. Of a Radiance file it applies orientation, EXPOSURE,
 * COLORCORR and PRIMARIES. What it chose, converted, ignored or assumed, cumulet_set_environment logs as a warning.
 */
CUMULET_API cumulet_status cumulet_environment_open(const char* path, cumulet_environment** out, char* error,
                                                    size_t error_size);

/* A host's own pixels, copied. */
typedef struct cumulet_environment_desc {
  size_t struct_size;
  const float* values; /* 3 a pixel, first pixel top left */
  uint64_t value_count;
  uint32_t width; /* 1 to 16384; value_count is 3 x width x height */
  uint32_t height;
  const char* name; /* for messages; NULL: "environment" */
} cumulet_environment_desc;

CUMULET_API cumulet_status cumulet_environment_from_pixels(const cumulet_environment_desc* desc,
                                                           cumulet_environment** out, char* error, size_t error_size);

CUMULET_API cumulet_environment* cumulet_environment_retain(cumulet_environment* environment); /* NULL is allowed */
CUMULET_API void cumulet_environment_release(cumulet_environment* environment);                /* likewise */

typedef struct cumulet_environment_info {
  size_t struct_size;
  char name[128]; /* the path, or what the host named it */
  uint32_t width;
  uint32_t height;
  uint64_t replaced_pixels; /* that count as 0 */
  double mean_radiance[3];  /* over all directions */
} cumulet_environment_info;

CUMULET_API cumulet_status cumulet_environment_get_info(const cumulet_environment* environment,
                                                        cumulet_environment_info* info);
/*
 * What it looks like, at another size (1 to 16384 a side), for a picture of it in a panel: 3 floats a pixel, radiance,
 * first pixel top left, each the mean of the environment's pixels in its place. count is the number of floats at rgb,
 * 3 x width x height or more. It looks at each pixel of the environment once: some 0.1 s for 8192 x 4096.
 */
CUMULET_API cumulet_status cumulet_environment_get_pixels(const cumulet_environment* environment, uint32_t width,
                                                          uint32_t height, float* rgb, uint64_t count);

/* ---- What a viewer shows, and the work behind it ---------------------------------------------------------------- */

/*
 * Begins to read a file as cumulet_volume_open does, on the viewer's worker, and then to build its grid; replaces a
 * load or build under way, though never two in a row, so that of a stream of files at least every second is shown.
 * Returns at once; the volume shown before stays until the new one is ready, for good if that fails.
 *
 * Of a .vdb file of some 25 million voxels and more (50,000 bricks of 8^3), while previews are on
 * (cumulet_sampling_desc) and no sequence or live volume is shown, a stand-in is shown first, in place of what was
 * there: density, temperature and flame in voxels of 4^3, of a sixteenth of the bricks, after about a twentieth of the
 * time. Its bounds are the whole's, so that cameras that are fitted to it stay, and so is where there is anything; it
 * has no colour of its own, anisotropy or velocity. Until the whole is there CUMULET_RENDER_LOADING is set and
 * CUMULET_RENDER_CONVERGED is not; cumulet_get_progress tells of the file, cumulet_get_volume and cumulet_get_stats of
 * what there was before, cumulet_get_bounds, pictures and what is read back of them of the stand-in. A density scale
 * that is suggested is the stand-in's own until then. It goes where the load fails or is cancelled, and what was shown
 * before is shown again. Where previews are off when the load begins there is none; turned off, it goes.
 */
CUMULET_API cumulet_status cumulet_load_volume(cumulet_viewer* viewer, const char* path, const char* grid_name);
/* The same of cumulet_volume_open_file. */
CUMULET_API cumulet_status cumulet_load_volume_file(cumulet_viewer* viewer, const cumulet_volume_file_desc* desc);
/* Begins to build this volume's grid, after the build under way, which is shown first. NULL: shows nothing, at once.
 * Cancels a load under way. */
CUMULET_API cumulet_status cumulet_set_volume(cumulet_viewer* viewer, cumulet_volume* volume);
/*
 * Where the volume stands from now on, whichever it is by then: once in each of count places, which share its grid and
 * its memory and may overlap, where extinctions add up. to_world: of each a column-major 4x4 matrix, affine and
 * invertible, from the world space that the volume itself has; zeros: the identity. count 0, and at first: there alone.
 * Any such matrix, sheared or mirrored, too; extinction and emission stay those of a unit of length of the scene.
 * Uploads a table of some 600 bytes a place (of one place nothing) and costs what moving the camera does, except that a
 * size that changes how much the medium hides by more than a factor of 2 rebuilds the grid, as cumulet_set_medium does,
 * and that a grid that follows the camera is fitted anew once they rest. Where more than four overlap at one point,
 * pictures are right, but what is known without samples (AOVs, picks, views, a denoiser's guides) may leave some of
 * them out. CUMULET_ERROR_INVALID_ARGUMENT for a matrix that is not affine, flattens space, or has numbers, or an
 * inverse with numbers, above 1e15; CUMULET_ERROR_UNSUPPORTED, from cumulet_render, for more than the driver holds
 * (200,000 at least) or a place 1e12 away from the others: then the places before stay.
 */
CUMULET_API cumulet_status cumulet_set_volume_places(cumulet_viewer* viewer, const double* to_world, uint32_t count);
/*
 * Where these places are as the shutter opens and as it closes (cumulet_sampling_desc.shutter_seconds), until
 * cumulet_set_volume_places says where they are again: as many matrices each as there are places, as there. Each point
 * goes straight from the one to the other. Either may be NULL, and any of its matrices zeros: that is then where it is
 * at the frame's moment; where both are, count is not looked at. CUMULET_ERROR_INVALID_ARGUMENT, too, for another
 * count, and for what would be flat in between, as what turns halfway round. While a place, an instance or a model
 * moves, the tables of all that are alike take three times as much, and drivers hold a third as many.
 */
CUMULET_API cumulet_status cumulet_set_volume_shutter(cumulet_viewer* viewer, const double* open, const double* close,
                                                      uint32_t count);
/*
 * Shows, in place of a volume, the frame at which the sequence stands, from now on and as it moves; retains it. What
 * was shown before stays until a frame is there. NULL: no sequence, and if there was one, nothing. cumulet_set_volume
 * ends it, too, and so does what cumulet_load_volume and cumulet_load_volume_file read, once it is there: if that fails
 * the sequence goes on.
 *
 * Frames are read and built on a worker of the viewer's, ahead in the direction of play and as many as fit
 * memory_bytes, and are uploaded by cumulet_render within its budget, which waits for none: it shows the nearest frame
 * that is ready, and while previews are on each that it takes up until there is a picture of it.
 * cumulet_get_sequence_info tells which. The first frame of other channels than those before compiles the programs that
 * it needs (cumulet_warm_up). Frame k is the same grid, and of the same samples the same picture, whether it is played
 * or set alone. What is not a frame's own is one for all, so that nothing jumps: where a camera that fits is placed, a
 * ground below, bounds that are told, and the density scale that is suggested, all by the largest of the files that can
 * be read and shows something, which is read first.
 *
 * A file that is missing or cannot be read is told by one warning in the log and by cumulet_get_sequence_frame, and is
 * played over: the nearest earlier frame that can be shown stands in for it, or where there is none the nearest later.
 * cumulet_rebuild reads all files anew; what is one for all stays as the first reading found it. With none that can be
 * shown the load has failed, as by cumulet_load_volume.
 *
 * cumulet_wait waits for the frame at which the sequence stands, not for those ahead; CUMULET_RENDER_LOADING and
 * cumulet_get_progress are about the same. cumulet_cancel stops reading ahead until the sequence moves to another frame
 * or a setting changes.
 */
CUMULET_API cumulet_status cumulet_set_sequence(cumulet_viewer* viewer, cumulet_sequence* sequence);

typedef struct cumulet_sequence_info {
  size_t struct_size;
  uint32_t frames;                /* that it has */
  uint32_t ready_frames;          /* that are in main memory as the settings have them */
  uint32_t failed_frames;         /* for which others stand in, as far as that is known */
  uint32_t asked_frame;           /* at which it stands */
  uint32_t drawn_frame;           /* of the picture that the last cumulet_render drew, where is_drawn */
  int32_t is_drawn;               /* 0: none of its frames */
  uint64_t bytes;                 /* of main memory, of those that are ready */
  double suggested_density_scale; /* cumulet_volume_suggest_density_scale, of the largest; 0: not known yet, or none */
  double asked_position;          /* as asked_frame, in frames: 2.25 is a quarter of the way from frame 2 to frame 3 */
  double drawn_position;          /* as drawn_frame, likewise */
} cumulet_sequence_info;

/*
 * Of the viewer's sequence; CUMULET_ERROR_INVALID_ARGUMENT if it shows none. states: NULL, or where a
 * cumulet_frame_state a frame is written, for a bar; count is the number of them there, info->frames or more.
 */
CUMULET_API cumulet_status cumulet_get_sequence_info(cumulet_viewer* viewer, cumulet_sequence_info* info,
                                                     uint8_t* states, size_t count);
typedef enum cumulet_frame_state {
  CUMULET_FRAME_WAITING = 0, /* not read, or not built for the settings that there are now */
  CUMULET_FRAME_READY = 1,
  CUMULET_FRAME_FAILED = 2 /* another stands in for it */
} cumulet_frame_state;
/* Why a frame failed, in one line that names the file; "" if it did not. Cut to fit, zero-terminated. */
CUMULET_API cumulet_status cumulet_get_sequence_frame(cumulet_viewer* viewer, uint32_t frame, char* cause, size_t size);
/*
 * Shows, in place of a volume, the newest state of this, from now on; retains it. What was shown before stays until a
 * state is there. NULL: none, and if there was one, nothing. cumulet_set_volume and cumulet_set_sequence end it, too,
 * and so does what cumulet_load_volume and cumulet_load_volume_file read, once it is there.
 *
 * States are read and built on a worker of the viewer's, which begins with the newest as soon as it is handed over, or
 * as soon as the one before is taken up by cumulet_render: that one is then uploaded and traced while the next is
 * built. Each that was begun ends and is shown; while previews are on it stays until there is a picture of it. So a
 * host that hands over faster than that sees motion at the rate at which states are built and drawn, and the newest
 * last. A state that cannot be shown leaves the last good one. cumulet_wait waits until the newest is there;
 * cumulet_cancel stops building until another is handed over or a setting changes. The first state of other channels
 * than those before compiles the programs that it needs (cumulet_warm_up). cumulet_stats has what a state took, reading
 * as build_seconds_load.
 */
CUMULET_API cumulet_status cumulet_set_live(cumulet_viewer* viewer, cumulet_live* live);

typedef struct cumulet_live_info {
  size_t struct_size;
  uint64_t handed_state; /* the newest, 0: none yet */
  uint64_t ready_state;  /* that was taken up last, to be uploaded and traced */
  uint64_t drawn_state;  /* of the picture that the last cumulet_render drew; 0: none */
  uint64_t ready_count;  /* how many were taken up since the live volume was set */
  uint64_t drawn_count;  /* how many of these have been drawn */
} cumulet_live_info;

/* What a voxel is in a buffer: numbers one behind another in GL's formats of these names. R16 and R8 are 0 to 1. */
typedef enum cumulet_voxel_format {
  CUMULET_VOXEL_FORMAT_R32F = 0,
  CUMULET_VOXEL_FORMAT_R16F = 1,
  CUMULET_VOXEL_FORMAT_R16 = 2,
  CUMULET_VOXEL_FORMAT_R8 = 3
} cumulet_voxel_format;

/* One channel's voxels in a GL object of the host's: in a texture, or in a buffer. */
typedef struct cumulet_gl_field {
  size_t struct_size; /* of all fields of an array the same: the distance between them */
  cumulet_channel channel;
  /*
   * A GL_TEXTURE_3D, of which level 0 is read as a shader fetches it (floats, or what is normalised; no whole numbers,
   * base level 0): texel (x, y, z) is the voxel. component: 0 to 3, r to a, so that one texture may have three fields.
   */
  uint32_t texture;
  uint32_t component;
  /*
   * Or, where texture is 0, a buffer. offset: bytes to voxel 0. strides: bytes from voxel to voxel along x, y and z;
   * all 0: x fastest, then y, then z, without gaps. All are multiples of a number's bytes, and of a buffer of R16F, R16
   * or R8 the words of four bytes that hold the voxels lie in it.
   */
  uint32_t buffer;
  cumulet_voxel_format format; /* of a buffer, as the next three */
  uint64_t offset;
  uint64_t strides[3];
  int32_t size[3];
  double index_to_world[16]; /* as in cumulet_dense_desc */
} cumulet_gl_field;

/* Voxels that changed; both ends are inclusive. */
typedef struct cumulet_voxel_box {
  int32_t min[3];
  int32_t max[3];
} cumulet_voxel_box;

/* A state as cumulet_state_desc has it, in GL. */
typedef struct cumulet_gl_state_desc {
  size_t struct_size;
  const cumulet_gl_field* fields;
  uint64_t field_count;
  /*
   * NULL, and none: the whole of the next state. Else the next state is the last one handed over but for these boxes:
   * of each field, whose texture or buffer is still that of the whole, all bricks of 8^3 voxels (the first begins at
   * voxel 0) that a box touches are taken. What of a box lies outside of a field is left out.
   */
  const cumulet_voxel_box* changed;
  uint64_t changed_count;
  void* wait;       /* a GLsync that the device waits for before it reads, or NULL; it stays the host's */
  const char* name; /* for messages; NULL: "state" */
} cumulet_gl_state_desc;

/*
 * [GL] As cumulet_live_set, or cumulet_live_update of bricks, of voxels that lie in GL: they never pass through the
 * host's memory. The viewer need not show the live volume: its context does the work, for all viewers that show it.
 *
 * The call queues a copy on the device and returns: commands that the host gives afterwards may overwrite or delete its
 * objects. What shaders wrote before in the same context is seen without a glMemoryBarrier; for another context's there
 * is wait. Only bricks that are not empty are copied back to main memory, in the texture's own precision, so that a
 * sparse plume costs what it has. That is found done by a later cumulet_render of this viewer (or cumulet_warm_up),
 * none of which waits: only then is it a state, counted by cumulet_live_info, and built. Until then cumulet_render has
 * CUMULET_RENDER_MORE. cumulet_wait does not wait for it. The first of a kind (texture or buffer, whole or boxes)
 * compiles a small program, if cumulet_warm_up did not.
 *
 * States become so in the order in which they were handed over by one viewer; memory's (cumulet_live_set) or another
 * viewer's when they are handed over, whatever is on its way. However fast they come the newest whole state wins and
 * none starves: the oldest that is on its way arrives, and of those behind it the newest; boxes on top of one that was
 * left out are part of a newer whole. Two whole states on their way take as much GL memory as twice their voxels, which
 * cumulet_limits_desc.gl_bytes does not bound; cells get what these leave of it.
 *
 * It is the same, bit for bit, as the same numbers by cumulet_live_set in a dense array: of a normalised format k / 255
 * or k / 65535. Refused in one line, with all else as it was, is what cumulet_live_set refuses, and a name that is no
 * such texture or buffer of the context's group, has no size, lacks the component, or whose layers of bricks are larger
 * than the driver's storage blocks (CUMULET_ERROR_UNSUPPORTED). A number that is not finite is found when it arrives:
 * the cumulet_render that finds it draws what there was, and is CUMULET_ERROR_FILE with the line, once; so is what no
 * longer fits the state that is there. Of a whole state that is so refused boxes on top of it are left out with it, and
 * refused from then on, until another whole one is handed over; boxes that are refused are missing, no more. What is on
 * its way when the viewer is detached, or its context is lost, never arrives: the state before stays, and boxes on top
 * of it would miss it, so that a whole state is next.
 *
 * With cumulet_live_desc.stays_in_gl density stays in this viewer's context, alone or with other channels that stand
 * where it does: priorities of splits, values of cells, what is given off, and what density has of the other channels
 * are found there. Its grid is that of the same numbers in main memory but for roundings of priorities and, by some
 * 1e-6, of colours; its control cube begins at a multiple of 16 voxels. What temperature and flame give off is found
 * again where the medium or a ramp of theirs changes, by the next cumulet_render, as one more state; a viewer that
 * shows them in another medium has its own. Viewers that share programs (cumulet_programs), and whose contexts share
 * objects, have it together; by other viewers boxes do not come. These take their bricks alone. Of what is not finite
 * the line names its 8^3 voxels. Who cannot do without the voxels ends that for the live volume, for good: another
 * march or a build on the CPU, a density ramp, a shutter that is open while it moves, a viewer without these programs
 * that shows it, more GL memory than is allowed, cumulet_live_get_volume. Then the next cumulet_render of a viewer that
 * has them brings the voxels of the newest state to main memory, as one more state, and those of the next ones come
 * there at once. cumulet_get_volume gives NULL of a state in GL, and cumulet_live_update is refused on top of one. With
 * the last of these viewers' contexts the state is gone, and nothing of it is shown in another until the next one
 * comes, which the log says.
 */
CUMULET_API cumulet_status cumulet_live_set_gl(cumulet_viewer* viewer, cumulet_live* live,
                                               const cumulet_gl_state_desc* desc);

/* Of the viewer's live volume; CUMULET_ERROR_INVALID_ARGUMENT if it shows none. */
CUMULET_API cumulet_status cumulet_get_live_info(cumulet_viewer* viewer, cumulet_live_info* info);

/* The volume last loaded or set, retained for the caller, who releases it; NULL if there is none. Of a sequence that of
 * the frame that was taken last, or NULL where its voxels are not kept; of a live volume that of the state. */
CUMULET_API cumulet_status cumulet_get_volume(cumulet_viewer* viewer, cumulet_volume** out);
/* Stops loading and building, within some 20 ms (see cumulet_destroy); what was shown stays, with the settings it was
 * built with. Any thread, any time. */
CUMULET_API void cumulet_cancel(cumulet_viewer* viewer);

/*
 * Begins to read a file as cumulet_surfaces_open does, on a worker, and then to pose it; replaces a load under way, as
 * cumulet_load_volume does. The surfaces shown before stay until it is ready, for good if that fails. Surfaces and
 * volume share one world space and one picture: rays end at triangles, and light goes both ways. cumulet_wait,
 * cumulet_get_progress and cumulet_cancel are about this work, too.
 */
CUMULET_API cumulet_status cumulet_load_surfaces(cumulet_viewer* viewer, const char* path);
/* Begins to pose these surfaces, after the pose under way, which is shown first. NULL: shows none, at once. Cancels a
 * load under way. */
CUMULET_API cumulet_status cumulet_set_surfaces(cumulet_viewer* viewer, cumulet_surfaces* surfaces);
/* The surfaces last loaded or set, retained for the caller, who releases them; NULL if there are none. */
CUMULET_API cumulet_status cumulet_get_surfaces(cumulet_viewer* viewer, cumulet_surfaces** out);

/*
 * Begins to read a file as cumulet_environment_open does, on a worker; replaces a load under way, as
 * cumulet_load_volume does. The environment, or sky, before it stays until it is ready, for good if that fails; then it
 * is there as by cumulet_set_environment. cumulet_wait, cumulet_get_progress and cumulet_cancel are about this work,
 * too.
 */
CUMULET_API cumulet_status cumulet_load_environment(cumulet_viewer* viewer, const char* path);
/*
 * This environment is there instead of the sky of cumulet_light_desc: it lights volume and surfaces and is the
 * background, uploaded within the next frames. The sun of cumulet_light_desc stays. What previews rasterise, and
 * CUMULET_SURFACE_LIGHT_NONE, is lit by it and by a physical sky without shadows and coarsely: what is matte within a
 * few per cent, mirrors as if they were blurred. NULL: the sky again. Cancels a load under way.
 */
CUMULET_API cumulet_status cumulet_set_environment(cumulet_viewer* viewer, cumulet_environment* environment);
/* The environment last loaded or set, retained for the caller, who releases it; NULL if there is none. */
CUMULET_API cumulet_status cumulet_get_environment(cumulet_viewer* viewer, cumulet_environment** out);

typedef enum cumulet_surface_light {
  CUMULET_SURFACE_LIGHT_FULL = 0,    /* light goes on between surfaces, and between them and the volume */
  CUMULET_SURFACE_LIGHT_SHADOWS = 1, /* surfaces are lit by sun, sky, lamps and emissive triangles alone, through the
                                        volume's shadow */
  /*
   * No light between surfaces and volume: surfaces are rasterised, lit by sun, sky and lamps without shadows, and hide
   * what is behind them; the volume is lit by sun and sky alone. The fastest, and what previews show in every mode
   * where there is sun or sky. Surfaces of alphaMode BLEND are sorted among each other; in front of the volume, in it
   * and behind it they count as one, at the nearest of a pixel.
   */
  CUMULET_SURFACE_LIGHT_NONE = 2
} cumulet_surface_light;

typedef struct cumulet_surface_settings_desc {
  size_t struct_size;
  double time;        /* seconds into the animation; past its end it begins anew */
  uint32_t animation; /* its number in the file; one that is not there: as the scene rests */
  cumulet_surface_light light;
  /*
   * 0 to 1: surfaces count as no smoother than this once a path was scattered wider than such a surface reflects, so
   * that what mirrors and lakes throw on walls and clouds is soft, without bright specks (path space regularization:
   * Kaplanyan, Dachsbacher 2013). What the camera sees, and what it sees in mirrors, stays as it is. 0, the default:
   * off, without bias.
   */
  float indirect_roughness;
  int32_t double_sided; /* 1: all materials show, and emit from, both of their sides, whatever the file says: for files
                           that are wound inside out (a warning tells of those). 0: as the file says */
  uint32_t variant;     /* of the file's variants of materials the one of index variant - 1 (see
                           cumulet_surfaces_get_variant); 0, or one that is not there: the materials without a choice */
  uint32_t group;       /* of lights, that their emissive triangles and lamps are in */
  int32_t holdout; /* 1: what cameras see of them is a hole, as of a medium: cumulet_medium_desc. What is rasterised
                      leaves them out */
} cumulet_surface_settings_desc;

/* How this viewer shows its surfaces. Poses them on the worker if the moment, double_sided or the variant changed; the
 * last pose is shown until then. */
CUMULET_API cumulet_status cumulet_set_surface_settings(cumulet_viewer* viewer,
                                                        const cumulet_surface_settings_desc* desc);
/* Moves the viewer's camera to one of the surfaces' own, as posed last: see cumulet_wait. */
CUMULET_API cumulet_status cumulet_use_surface_camera(cumulet_viewer* viewer, uint32_t index);

typedef enum cumulet_stage {
  CUMULET_STAGE_IDLE = 0,
  CUMULET_STAGE_LOADING = 1,    /* reading the file */
  CUMULET_STAGE_STATISTICS = 2, /* exact moments of the voxels */
  CUMULET_STAGE_REFINING = 3,   /* where to bisect, and bisection */
  CUMULET_STAGE_RECORDS = 4,    /* the cells' records */
  CUMULET_STAGE_UPLOADING = 5   /* to GL, within cumulet_render */
} cumulet_stage;

typedef struct cumulet_progress {
  size_t struct_size;
  cumulet_stage stage;
  double fraction;       /* of the stage, 0 to 1 */
  cumulet_status status; /* how loads and builds ended: CUMULET_OK, or an error as "Errors" has it at the top */
  char message[512];     /* its cause in one line, "" if it succeeded */
  /* How the last work on the volume or an instance's, on the surfaces or a model, and on the environment ended. Where
   * one fails the others may be there. */
  cumulet_status volume_status;
  char volume_message[512];
  cumulet_status surfaces_status;
  char surfaces_message[512];
  cumulet_status environment_status; /* a physical sky's, too */
  char environment_message[512];
} cumulet_progress;

/* What the worker does. Any thread, any time. */
CUMULET_API cumulet_status cumulet_get_progress(cumulet_viewer* viewer, cumulet_progress* progress);
/*
 * Waits until the worker is idle, at most timeout_ms milliseconds (negative: for ever), and returns how loads and
 * builds ended, as "Errors" has it at the top, with the line as the last error: the same as `status` of
 * cumulet_progress. What is ready is uploaded by the next cumulet_render.
 */
CUMULET_API cumulet_status cumulet_wait(cumulet_viewer* viewer, double timeout_ms);
/* Builds the grid anew though nothing asks for it. */
CUMULET_API cumulet_status cumulet_rebuild(cumulet_viewer* viewer);

/*
 * What a viewer may take of the machine. Zeros, and at first: no limit.
 */
typedef struct cumulet_limits_desc {
  size_t struct_size;
  /*
   * How many threads work for the viewer at a time, in all that its workers do: reading, building, posing;
   * 1 to 1024. From the next piece of work on, not the one under way. What is not counted: physical skies, the
   * thread that calls, those that sleep, free memory or end what cannot be interrupted (cumulet_destroy), and the
   * driver's. Calls on handles work for their caller, on all processors.
   */
  uint32_t threads;
  /*
   * Main memory for volumes and grids: the voxels of the volume that is shown, what is computed of them once and kept,
   * and the cells (cumulet_stats.memory_bytes); of a sequence all frames that are ready, its own memory_bytes if that
   * is less. Cells are as coarse as it takes (cumulet_stats.limited tells). Where not even the coarsest fit, the load
   * or build is refused with CUMULET_ERROR_OUT_OF_MEMORY and one line, and what was shown stays. Not counted: what
   * building takes, surfaces, environments, instances, what a live volume keeps for updates, what the host retains.
   */
  uint64_t memory_bytes;
  /*
   * GL memory. Cells are as coarse as two fifths of what the last frame's rest leaves take (cumulet_stats.limited), of
   * several grids each an equal part; those before them go first where both do not fit, and what is added is shown once
   * the others have made room. Voxels are as they are: a volume that would bring gl_bytes above it, beside the one
   * before, is not uploaded, and that one stays: cumulet_render tells CUMULET_ERROR_OUT_OF_MEMORY once. Surfaces and
   * pictures count, and are not refused.
   */
  uint64_t gl_bytes;
} cumulet_limits_desc;

/* Holds for what is begun from now on; but the cells of a volume that is no sequence's nor live are then cut anew. */
CUMULET_API cumulet_status cumulet_set_limits(cumulet_viewer* viewer, const cumulet_limits_desc* desc);

/* ---- Settings --------------------------------------------------------------------------------------------------- */

/*
 * Lights are in groups, of which a picture may keep the radiance apart (light_groups of cumulet_sampling_desc), so that
 * whoever composites it dims or colours them anew: numbers below this; 0, where nothing is said.
 */
enum { CUMULET_LIGHT_GROUPS = 8 };

typedef enum cumulet_march {
  CUMULET_MARCH_TET = 0,   /* the adaptive tetrahedral grid */
  CUMULET_MARCH_DENSE = 1, /* 3D DDA over every voxel of the bounds (the paper's reference) */
  CUMULET_MARCH_BRICK = 2  /* two-level 3D DDA that skips empty 8^3 bricks */
} cumulet_march;

typedef enum cumulet_cells {
  CUMULET_CELLS_LINEAR = 0,  /* least-squares linear density a cell, non-negative, mean kept */
  CUMULET_CELLS_CONSTANT = 1 /* mean density a cell */
} cumulet_cells;

typedef enum cumulet_criterion {
  /* standard deviation x edge length > threshold x mean optical depth. With a threshold of 0, the default:
     CUMULET_CRITERION_TRANSMITTANCE */
  CUMULET_CRITERION_DEVIATION = 0,
  CUMULET_CRITERION_RANGE_MEAN = 1, /* (max - min) / mean > threshold (the paper's) */
  /* What of a deviation is seen, about the picture's relative error: with extinctions by the density scale, reduced by
     what is scattered forward where they hide, and T the part of the light that gets there, T^2 there and back,
     T^2 x deviation x edge / (1 + extinction x edge) / (1 - exp(-mean optical depth)) > threshold. Cells are built
     anew, in the background, once density_scale, alone or times 1 - anisotropy, is more than twice or less than half of
     what they were built for; until then they stay, and cumulet_rebuild() builds them for what it is now */
  CUMULET_CRITERION_TRANSMITTANCE = 2
} cumulet_criterion;

typedef enum cumulet_build {
  CUMULET_BUILD_CPU = 0, /* by a worker, with all that a volume has */
  /* By compute shaders, within frames' budgets, the old cells being shown meanwhile: the same cells, what they hold
     (density, what glows, colour, anisotropy, velocity) but for a rounding. A worker computes once, a volume and
     medium, what does not depend on the view; a camera that moves then costs the device's passes alone. A grid that is
     larger than the driver's storage blocks, or whose making takes more GL memory than there is or
     cumulet_limits_desc.gl_bytes allows, or that moves while the shutter is open, is built by the CPU, which the log
     says with the reason */
  CUMULET_BUILD_GPU = 1
} cumulet_build;

/* How the cells are made. A change rebuilds them on the worker; the old ones are shown meanwhile. */
typedef struct cumulet_grid_desc {
  size_t struct_size;
  cumulet_march march;
  cumulet_cells cells;
  cumulet_criterion criterion;
  double threshold;   /* split above it. 0: 0.15 by transmittance, 1 for range-mean; negative: split to the voxel */
  uint64_t max_cells; /* 0: 5,400,000. Spent where the criterion is largest */
  int32_t camera_adaptive; /* 1: do not split cells outside the frustum or under pixel_size pixels; 0: off. Needs the
                              size of a frame; built anew when the camera comes to rest elsewhere */
  double pixel_size;       /* pixels a cell's longest edge must cover to be split; 0: 1 */
  cumulet_build build;     /* who makes them, of CUMULET_MARCH_TET */
} cumulet_grid_desc;

/* Where light goes that a medium scatters. */
typedef enum cumulet_phase {
  CUMULET_PHASE_HG = 0,       /* Henyey-Greenstein's lobe */
  CUMULET_PHASE_TWO_LOBE = 1, /* two of them */
  CUMULET_PHASE_MIE = 2       /* water droplets: a fit of Mie's theory (Jendersie and d'Eon 2023) */
} cumulet_phase;

/* The participating medium. A change restarts accumulation; the cells stay, unless they were made for another
   transmittance or emission. */
typedef struct cumulet_medium_desc {
  size_t struct_size;
  /*
   * Extinction = density_scale x grid value, 1 / world unit; up to 1e60; 0: 1. Paths meet at most 2^23 optical
   * depths over the extent of all volumes, because floats resolve no shorter distance: a denser medium looks the same.
   */
  double density_scale;
  float coalbedo[3]; /* 1 - single-scattering albedo, each in [0, 1]; 0: nothing is absorbed */
  float anisotropy; /* Henyey-Greenstein g in (-1, 1), of two lobes the first one's; 0: isotropic. Not of Mie, nor where
                       the volume has an anisotropy_grid */
  uint32_t max_bounces; /* scattering events a path may have; 0: no limit, but from 16384 on each doubling of them
                           halves a path's chance to go on, which keeps the mean */
  /*
   * Source radiance: each point gives off extinction x emission per unit of length, so that a body of the medium too
   * thick to see through glows with this if it does not scatter. It lights the rest of the medium and the surfaces
   * (CUMULET_SURFACE_LIGHT_FULL), as fire does. 0: dark.
   */
  float emission[3];
  cumulet_phase phase;
  float second_anisotropy; /* two lobes: g of the second one, in (-1, 1); 0: isotropic */
  float second_share;      /* two lobes: part of the light that is in the second one, in [0, 1]; 0: 0.5 */
  float droplet_diameter;  /* Mie: in micrometres, in [5, 50]; 0: 20, as in a cloud */
  /*
   * What flame and temperature grids give off: radiance a world unit of length, whatever the density there,
   *   flame_strength x flame_color x flame
   *   + 1e-6 sigma / pi x mix(1, T^4, blackbody) x blackbody_tint x the colour of a black body of T kelvin, of
   * luminance 1 with T = temperature_offset + temperature_scale x temperature, where that is not 0; dark below 100 K.
   * As Blender's Principled Volume but for the scale: files hold 0 to 3 or so. Another value builds the grid anew.
   */
  float flame_strength;     /* 0: 1; to be without flames, flame_grid "none" */
  float flame_color[3];     /* linear Rec. 709; all 0: white */
  float temperature_scale;  /* kelvin; 0: 1 where a value is more than 20, as kelvin are, else 1500
                               (cumulet_volume_info has it). All frames of a sequence have the scale that suits the
                               largest of its files; a live volume stays at 1 once it was there */
  float temperature_offset; /* kelvin */
  float blackbody;          /* intensity; 0: none, but 1 for a volume of a temperature without density and flame */
  float blackbody_tint[3];  /* all 0: white */
  uint32_t group;           /* of lights, that all it gives off is in */
  /*
   * 1: what cameras see of it is a hole: where a camera's ray would be scattered first by it, that is black and without
   * alpha, and no background shows; what stands before it stays. Other light goes through it as it does. So a picture
   * leaves room for what it is composited with. AOVs know it as it is; of previews it is a part once they are traced.
   */
  int32_t holdout;
} cumulet_medium_desc;

/* The grid whose values a ramp changes. */
typedef enum cumulet_ramp {
  CUMULET_RAMP_DENSITY = 0,
  CUMULET_RAMP_TEMPERATURE = 1,
  CUMULET_RAMP_FLAME = 2
} cumulet_ramp;

/* Where sun and sky have their light from. */
typedef enum cumulet_sky {
  CUMULET_SKY_CONSTANT = 0, /* sun_irradiance; sky_radiance, the same from everywhere */
  /*
   * Of a clear day with the sun where it is (Hillaire 2020), seen from the ground at sea level: neither sun_irradiance
   * nor sky_radiance. Below the horizon lies the lit ground, unless there is that of cumulet_set_ground. White and unit
   * are the sun's light outside of the atmosphere, whose irradiance is 5 (some 27 klx to 1): about 4 on the ground at
   * noon, next to none after sunset. It is computed on a worker, in some 0.1 s when the air changes, 0.03 s when the
   * elevation does or a ground comes or goes: until it is there sun and sky stay as they were, cumulet_render tells
   * CUMULET_RENDER_LOADING, and cumulet_wait waits. Of a sun that is dragged each sky that was begun is shown, and the
   * newest last. cumulet_cancel leaves it alone.
   */
  CUMULET_SKY_PHYSICAL = 1
} cumulet_sky;

/* A distant sun (of angle 0 a direction, which no ray sees) and a sky. Restarts accumulation. */
typedef struct cumulet_light_desc {
  size_t struct_size;
  float sun_azimuth_degrees;   /* direction towards the sun, from +Z towards +X */
  float sun_elevation_degrees; /* above the horizon */
  float sun_irradiance[3];     /* on a surface that faces it; 0: no sun */
  float sky_radiance[3];       /* 0: black */
  cumulet_sky sky;
  float turbidity;     /* physical: Linke's, in [1, 10]: 1 no aerosols, 2 very clear, 3 clear, 6 hazy; 0: 3 */
  float ground_albedo; /* physical: what the ground sends back to the air, in [0, 1]; 0: black */
  /*
   * That the sun's disc takes, up to 180: soft shadows, and a disc that is seen. Its irradiance does not depend on it.
   * 0: none, but 0.53 of a physical sky; negative: none.
   */
  float sun_angle_degrees;
  uint32_t sun_group; /* of lights */
  uint32_t sky_group; /* or of the environment that is there instead */
} cumulet_light_desc;

/* How a viewer is surrounded by its environment (cumulet_set_environment). Restarts accumulation. */
typedef struct cumulet_environment_settings_desc {
  size_t struct_size;
  float rotation_degrees; /* from +Z towards +X, -360 to 360 */
  float strength;         /* times its radiance, up to 1e6; 0: 1 */
} cumulet_environment_settings_desc;

typedef enum cumulet_ground {
  CUMULET_GROUND_NONE = 0,
  CUMULET_GROUND_BELOW = 1, /* at the lowest point of what there is */
  CUMULET_GROUND_AT_HEIGHT = 2
} cumulet_ground;

/*
 * A level plane without end that scatters light evenly and catches shadows; from beneath it is not there. It is part of
 * the picture and of its alpha, not of its depth, previews' surfaces and AOVs. Below the horizon a physical sky is dark
 * where there is one. Restarts accumulation.
 */
typedef struct cumulet_ground_desc {
  size_t struct_size;
  cumulet_ground place;
  double height;   /* at a height: its y in the world */
  float albedo[3]; /* all 0: 0.3 */
} cumulet_ground_desc;

typedef enum cumulet_view {
  CUMULET_VIEW_SHADED = 0,
  CUMULET_VIEW_CELLS = 1,    /* the cells on a cut through the middle, coloured by level, with their edges */
  CUMULET_VIEW_STEPS = 2,    /* march steps of the camera ray, as a heat map */
  CUMULET_VIEW_DENSITY = 3,  /* optical depth along the camera ray: 1 - exp(-depth), grey */
  CUMULET_VIEW_WIREFRAME = 4 /* the edges of the cells that hold density, over the density */
} cumulet_view;

typedef enum cumulet_preview {
  CUMULET_PREVIEW_AUTO = 0, /* after a change: as coarse as the budget needs, then finer and finer as things rest */
  CUMULET_PREVIEW_OFF = 1   /* always at full resolution: what is read back depends on the settings alone */
} cumulet_preview;

/* How pictures are sampled. Restarts accumulation, but for a larger number of samples, which goes on. */
typedef struct cumulet_sampling_desc {
  size_t struct_size;
  uint32_t samples; /* target samples a pixel; 0: 256 */
  uint32_t seed;    /* same seed, samples, size and driver: same picture, bit for bit */
  cumulet_view view;
  cumulet_preview preview;
  int32_t volume_alone; /* 1: at full resolution, also keep what cumulet_read_aov gives as CUMULET_AOV_VOLUME */
  /*
   * Where a picture at full resolution has no more noise (cumulet_measure_noise) than this percentage it is converged;
   * samples are then the most that it may take. Looked at with 16 samples a pixel and at each 1.41 times as many, of
   * all pixels: the same settings end with the same picture, whatever the time. 0: it takes its samples. Which pictures
   * stop early is a matter of their samples, so that the mean of many is a little less than that of pictures of fixed
   * counts: by far less than the noise, docs/aovs.md.
   */
  float noise_target_percent;
  /*
   * A pixel's samples are those of the numbers first_sample to first_sample + samples - 1. A sample depends on its
   * number, the seed and the scene alone, and any 2^k in a row from a multiple of 2^k on are even (Owen-scrambled): so
   * parts of a picture are made apart, and their means, each weighed by its samples, are together that of the whole but
   * for rounding. Numbers beyond 2^32 - 1 begin again at 0.
   */
  uint32_t first_sample;
  /*
   * The part of the picture that is made: x, y, width and height as fractions of it from its upper left corner, so that
   * it is the same part at any size; of the pixels those whose middles are within (cumulet_region_pixels), with the
   * bits that they have in the whole picture. A width or height of 0 reaches to the end: zeros, the default, are the
   * whole picture. Frames leave the rest of their target as it is; what is read back is 0 there, transparent, of
   * depths, too; errors are infinite. Denoising knows no other pixels. Progress, noise and samples are of it.
   */
  float region[4];
  /*
   * At full resolution also keep what each of so many groups of lights brings, for cumulet_read_light_group: 8 at most;
   * 0: none. Lights of groups beyond these count in group 0, so that the groups together are the picture. The same
   * samples make the same picture with groups and without. It takes 16 bytes a pixel of GL memory a group, and 32 more.
   */
  uint32_t light_groups;
  /*
   * Motion blur: how long the shutter is open, half of it before the frame's moment and half after, as Blender's
   * default has it; 0: all stands still. Each path is of one moment of that time, evenly (Cook, Porter and Carpenter,
   * "Distributed Ray Tracing", 1984). What moves is what a host says of cameras (cumulet_camera_set_shutter), of places
   * (cumulet_set_volume_shutter, cumulet_instance_desc, cumulet_model_desc), surfaces by the animation that they play
   * and hosts' meshes by their velocities, and by theirs, in world units a second, volumes that have some:
   * docs/motion_blur.md. The frame's moment alone have AOVs, picks, views, maps, what
   * is rasterised (so CUMULET_SURFACE_LIGHT_NONE's surfaces), models' lamps and the host's depth.
   */
  float shutter_seconds;
  /*
   * 1: where there is a noise target, samples go where the picture's noise is: a half of a square of 8 x 8 pixels (its
   * even or its odd rows) is sampled no further once it has its share of those that reach the target with the fewest
   * samples in all, n ~ sigma (Neyman, "On the Two Different Aspects of the Representative Method", 1934). Looked at
   * when the noise is; what each half has is decided by the samples of the other, docs/aovs.md. The same settings end
   * with the same picture, whatever the time. Pixels then have different numbers of samples. 0: all have the same.
   */
  int32_t adaptive;
} cumulet_sampling_desc;

typedef enum cumulet_tone_map {
  CUMULET_TONE_MAP_NEUTRAL = 0, /* Khronos PBR Neutral */
  CUMULET_TONE_MAP_FILMIC = 1,  /* Narkowicz's fit of the ACES curve, 2015 */
  CUMULET_TONE_MAP_CLIP = 2     /* clamped to [0, 1] */
} cumulet_tone_map;

typedef enum cumulet_background {
  CUMULET_BACKGROUND_SKY = 0,         /* the sky's radiance, or the environment, behind the volume: opaque */
  CUMULET_BACKGROUND_TRANSPARENT = 1, /* premultiplied color and alpha: the content of the framebuffer shows through,
                                         and light without alpha, as of flames, is added to it: see cumulet_blend */
  CUMULET_BACKGROUND_COLOR = 2        /* background_color behind the volume: opaque */
} cumulet_background;

typedef enum cumulet_denoise {
  CUMULET_DENOISE_OFF = 0,
  CUMULET_DENOISE_FAST = 1 /* by a filter: see cumulet_display_desc */
} cumulet_denoise;

/*
 * How a picture is shown. Restarts nothing. A background is what the camera sees where neither volume nor surfaces nor
 * the ground cover it: volume and surfaces are lit by sky or environment whatever it is, and mirrors show these.
 */
typedef struct cumulet_display_desc {
  size_t struct_size;
  float exposure_stops; /* radiance is multiplied by 2^stops */
  cumulet_tone_map tone_map;
  cumulet_background background;
  float background_color[3]; /* linear Rec. 709 radiance, exposed and tone-mapped as all is; debug views have black */
  /*
   * Whether what frames draw is filtered: neighbours tell what a pixel's own samples do not yet (an edge-avoiding
   * a-trous wavelet, Dammertz et al. 2010, by variance as of Schied et al. 2017), and so, where previews are on, do
   * frames of other views, found again by depth, as up to 32 samples that fade as the pixel gets 64: pictures converge
   * to what they are without. Each view has random numbers of its own then, beside the seed: what is read back is as
   * right, not the same. cumulet_read_linear and cumulet_read_aov are not filtered,
   * and cumulet_read_denoised knows no other frames. It takes at most four tenths of a frame's budget (in the long run
   * a fifth), 270 bytes a pixel of GL memory and unlit rays: four a pixel at first, two more a sample, and beyond
   * sixteen up to 64 where they are not alike. Until it is done frames draw the last picture of the same scene and
   * camera, else this as it is; those that draw nothing go on with it, too, and say by CUMULET_RENDER_UNDRAWN when
   * there is another. Without memory for it, or for other frames, they are drawn without, which
   * CUMULET_ERROR_OUT_OF_MEMORY says once. Debug views are not filtered.
   */
  cumulet_denoise denoise;
} cumulet_display_desc;

CUMULET_API cumulet_status cumulet_set_grid(cumulet_viewer* viewer, const cumulet_grid_desc* desc);
CUMULET_API cumulet_status cumulet_set_medium(cumulet_viewer* viewer, const cumulet_medium_desc* desc);
/*
 * A curve over the values of a grid, in the grid's own unit on both sides; as of Blender's Map Range and Float Curve,
 * and of Houdini's ramps. points: count pairs of a value and what it becomes, x0, y0, x1, y1, ..., copied; 2 to 32 of
 * them, x strictly ascending, none beyond 1e30, y not negative. Where a voxel has the value v it becomes
 *   y_i + (y_(i+1) - y_i) (v - x_i) / (x_(i+1) - x_i), of the two points about it: x_i <= v <= x_(i+1);
 *   y of the first point below all of them, y of the last above.
 * 0 stays 0 whatever the points say, so that no ramp fills the space where a grid has nothing; a background that is not
 * 0 becomes, within the grid's bounds, what other values become. count 0, the default: all values stay as they are.
 *
 * It comes before all else that the medium makes of values, and after the resampling onto the density's voxels:
 *   extinction = density_scale x ramp(density), T = temperature_offset + temperature_scale x ramp(temperature),
 *   flame_strength x flame_color x ramp(flame)
 * It is that of the viewer for every volume that it is given, and unknown to what is told of a volume by itself: its
 * info, the density scale that is suggested, what of it cameras fit. Each voxel has its own, of which cells are then
 * made, for a mean of ramps is no ramp of a mean. Another ramp builds the grid anew, in the background.
 */
CUMULET_API cumulet_status cumulet_set_ramp(cumulet_viewer* viewer, cumulet_ramp ramp, const float* points,
                                            uint64_t count);
/* What one grid of a volume holds, as its ramp is given it: for whoever draws a curve over it. */
typedef struct cumulet_values_info {
  size_t struct_size;
  float max_value; /* 0: the volume has no such grid */
  /* Counts of the voxels above 0 in equal steps from 0 to max_value. */
  uint64_t histogram[CUMULET_HISTOGRAM_BINS];
} cumulet_values_info;

/* Some milliseconds a million voxels. */
CUMULET_API cumulet_status cumulet_volume_get_values(const cumulet_volume* volume, cumulet_ramp ramp,
                                                     cumulet_values_info* info);

/* ---- Instances: volumes beside the viewer's own -------------------------------------------------------------------
 */

/*
 * A volume in a scene: where it stands and what it is made of. Counted, free of GL, and any number of viewers may show
 * it, each beside its own volume (cumulet_set_volume) and other instances. They may overlap: extinctions add up, and
 * what scatters is of whichever is met. Calls on an instance are for any thread, at any time; what they change is seen
 * from the next frame on, and viewers that show it call their update callback, on that thread.
 *
 * Instances of one cumulet_volume whose media build the same share one grid, made for the one that needs the finest,
 * and with the viewer's own volume, where it is that. Their grids are made as cumulet_set_grid says, one after another
 * in the background; each is shown as soon as it is there. Moving one uploads a table of some 600 bytes an instance,
 * not a grid, except that a grid that follows the camera is made anew. What cumulet_set_volume_places says of units, of
 * the depth of overlaps and of limits holds for them. With CUMULET_MARCH_DENSE and CUMULET_MARCH_BRICK all that is
 * shown has to be of one grid: else CUMULET_ERROR_UNSUPPORTED from cumulet_render, and what was shown before stays.
 */
typedef struct cumulet_instance cumulet_instance;

typedef struct cumulet_instance_desc {
  size_t struct_size;
  cumulet_volume* volume; /* shared; NULL: none, and nothing is shown */
  double to_world[16];    /* as a place of cumulet_set_volume_places; zeros: where the volume itself is */
  const cumulet_medium_desc*
      medium;     /* read in the call; NULL: its defaults. max_bounces is the viewer's own medium's */
  int32_t hidden; /* 1: it is as if it were not there */
  uint64_t tag;   /* the host's own, which cumulet_pick tells */
  /*
   * In place of a volume: the frame at which this stands, from now on and as it moves; NULL: none. One at most. What
   * cumulet_set_sequence says of reading ahead, gaps and bounds holds for it; instances of one sequence whose media
   * build the same share its frames and their grids, others have them a second time. The medium's density_scale is
   * taken as it is given: suggested_density_scale of the sequence's file is not looked at.
   */
  cumulet_sequence* sequence;
  /*
   * In place of both: its newest state, from now on; NULL: none. What cumulet_set_live says of states that come fast,
   * of bounds and of failures holds for it; instances of one live volume whose media build the same share its grids,
   * others have them built a second time.
   */
  cumulet_live* live;
  /* Where it is as the shutter opens and as it closes: as in cumulet_set_volume_shutter; zeros: as at to_world. */
  double open_to_world[16];
  double close_to_world[16];
} cumulet_instance_desc;

/* error as in cumulet_create. */
CUMULET_API cumulet_status cumulet_instance_create(const cumulet_instance_desc* desc, cumulet_instance** out,
                                                   char* error, size_t error_size);
CUMULET_API cumulet_instance* cumulet_instance_retain(cumulet_instance* instance); /* returns it; NULL is allowed */
CUMULET_API void cumulet_instance_release(cumulet_instance* instance);             /* NULL is allowed */
/* All of it but its ramps. CUMULET_ERROR_INVALID_ARGUMENT, and it stays as it was, for what is refused on creation. */
CUMULET_API cumulet_status cumulet_instance_set(cumulet_instance* instance, const cumulet_instance_desc* desc);
/* Where it stands still: what was said of a shutter ends. */
CUMULET_API cumulet_status cumulet_instance_set_to_world(cumulet_instance* instance, const double to_world[16]);
/* cumulet_set_ramp, of the instance alone. */
CUMULET_API cumulet_status cumulet_instance_set_ramp(cumulet_instance* instance, cumulet_ramp ramp, const float* points,
                                                     uint64_t count);
/* Retains it. CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows it already. */
CUMULET_API cumulet_status cumulet_add_instance(cumulet_viewer* viewer, cumulet_instance* instance);
/* CUMULET_ERROR_INVALID_ARGUMENT if it does not. */
CUMULET_API cumulet_status cumulet_remove_instance(cumulet_viewer* viewer, cumulet_instance* instance);
/*
 * As cumulet_get_sequence_info and cumulet_get_sequence_frame, of an instance's sequence in this viewer: what is ready
 * is that of all that share it. CUMULET_ERROR_INVALID_ARGUMENT for one that the viewer does not show, or hides, or that
 * shows no sequence.
 */
CUMULET_API cumulet_status cumulet_get_instance_sequence_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                              cumulet_sequence_info* info, uint8_t* states,
                                                              size_t count);
CUMULET_API cumulet_status cumulet_get_instance_sequence_frame(cumulet_viewer* viewer, cumulet_instance* instance,
                                                               uint32_t frame, char* cause, size_t size);
/* As cumulet_get_live_info, of an instance's live volume, likewise. */
CUMULET_API cumulet_status cumulet_get_instance_live_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                          cumulet_live_info* info);

/* ---- Models: surfaces beside the viewer's own ----------------------------------------------------------------------
 *
 * Surfaces where a host wants them: each at a place, at a moment of an animation, of a variant. Any number of them may
 * share surfaces, which are in memory once for each moment and variant, and any viewers may share models. They may be
 * changed in any thread, by the calls below; a viewer looks at changes in its next call. Another place uploads a
 * matrix, no triangle; another moment poses them on a worker, and what was posed last is shown until then. They pass
 * light on as the viewer's own surfaces do, are drawn by previews, and shine: their emissive triangles and lamps stand
 * where they do (intensities of lamps stay what they are, whatever a place stretches).
 */
typedef struct cumulet_model cumulet_model; /* cumulet_model_release */

typedef struct cumulet_model_desc {
  size_t struct_size;
  cumulet_surfaces* surfaces; /* shared; NULL: none, and nothing is shown */
  double to_world[16];        /* affine, no flattening; from the surfaces' own world; zeros: as they stand there */
  double time;                /* these four: as in cumulet_surface_settings_desc */
  uint32_t animation;
  uint32_t variant;
  int32_t double_sided;
  int32_t hidden;      /* 1: it is as if it were not there */
  int32_t shadow_only; /* 1: cameras do not see it, nor do picks and AOVs; other light meets it, and it shines */
  uint64_t tag;        /* the host's own, which cumulet_pick tells */
  uint32_t group;      /* of lights, that its emissive triangles and lamps are in */
  int32_t holdout;     /* 1: what cameras see of it is a hole, as of a medium: cumulet_medium_desc. What is rasterised
                          leaves it out */
  /* Where it is as the shutter opens and as it closes: as in cumulet_set_volume_shutter; zeros: as at to_world. Its
   * animation goes on meanwhile. */
  double open_to_world[16];
  double close_to_world[16];
} cumulet_model_desc;

/* error as in cumulet_create. */
CUMULET_API cumulet_status cumulet_model_create(const cumulet_model_desc* desc, cumulet_model** out, char* error,
                                                size_t error_size);
CUMULET_API cumulet_model* cumulet_model_retain(cumulet_model* model); /* returns it; NULL is allowed */
CUMULET_API void cumulet_model_release(cumulet_model* model);          /* NULL is allowed */
/* CUMULET_ERROR_INVALID_ARGUMENT, and it stays as it was, for what is refused on creation. */
CUMULET_API cumulet_status cumulet_model_set(cumulet_model* model, const cumulet_model_desc* desc);
/* Where it stands still: what was said of a shutter ends. */
CUMULET_API cumulet_status cumulet_model_set_to_world(cumulet_model* model, const double to_world[16]);
CUMULET_API cumulet_status cumulet_model_set_time(cumulet_model* model, double time);
/* Retains it. CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows it already. */
CUMULET_API cumulet_status cumulet_add_model(cumulet_viewer* viewer, cumulet_model* model);
/* CUMULET_ERROR_INVALID_ARGUMENT if it does not. */
CUMULET_API cumulet_status cumulet_remove_model(cumulet_viewer* viewer, cumulet_model* model);

CUMULET_API cumulet_status cumulet_set_light(cumulet_viewer* viewer, const cumulet_light_desc* desc);
CUMULET_API cumulet_status cumulet_set_environment_settings(cumulet_viewer* viewer,
                                                            const cumulet_environment_settings_desc* desc);
CUMULET_API cumulet_status cumulet_set_ground(cumulet_viewer* viewer, const cumulet_ground_desc* desc);

/* ---- Lamps ---- */

typedef enum cumulet_lamp_kind {
  CUMULET_LAMP_POINT = 0,     /* the same in all directions */
  CUMULET_LAMP_SPOT = 1,      /* a point that shines into a cone */
  CUMULET_LAMP_DISC = 2,      /* of the same radiance all over, on the side where it shines */
  CUMULET_LAMP_RECTANGLE = 3, /* likewise */
  CUMULET_LAMP_SUN = 4        /* far away: the same everywhere */
} cumulet_lamp_kind;

/*
 * A lamp: it lights volume and surfaces, casts shadows, and is itself not seen, neither by the camera nor in mirrors.
 * Its strength is radiant, as Blender's lamps have it. A point of glTF's of I candela, which Cumulet takes as I W/sr,
 * is one of 4 pi I watts; so is a spot, whose power is that of the point it is cut out of. A disc or rectangle has a
 * radiance of power / (4 x area): it sends out pi / 4 of its power.
 */
typedef struct cumulet_lamp_desc {
  size_t struct_size; /* of all lamps of an array the same: the distance between them */
  cumulet_lamp_kind kind;
  double position[3];   /* world, of its middle; not of a sun */
  double direction[3];  /* world, of any length: where it shines; not of a point; zero: down, to -Y */
  double across[3];     /* of a rectangle: along its width, as far as that is upright to the direction; zero, or along
                           the direction: level with the ground, or +X where it shines up or down */
  float color[3];       /* linear Rec. 709, times power, together up to 1e30; all 0: white */
  float power;          /* watts; of a sun W/m2 on a surface that faces it; 0: dark */
  double width;         /* of a rectangle; of a disc the diameter; world units; 0: 1 */
  double height;        /* of a rectangle; 0: 1 */
  double angle_degrees; /* of a spot the whole cone's, up to 180, 0: 45; of a sun what it covers of the sky, up to 90 */
  double blend;         /* of a spot: the part of the cone, from its edge inwards, in which it dims; 0 to 1 */
  uint32_t group;       /* of lights */
} cumulet_lamp_desc;

/*
 * The viewer's lamps from now on, instead of those before; copied. lamps may be NULL where count is 0: none. Those of
 * its surfaces' file stay beside them. At most 4096. What previews rasterise, and CUMULET_SURFACE_LIGHT_NONE, has them
 * without shadows, discs and rectangles from their middle. Restarts accumulation.
 */
CUMULET_API cumulet_status cumulet_set_lamps(cumulet_viewer* viewer, const cumulet_lamp_desc* lamps, uint64_t count);

CUMULET_API cumulet_status cumulet_set_sampling(cumulet_viewer* viewer, const cumulet_sampling_desc* desc);
/*
 * Which pixels of a picture of width x height a region (of cumulet_sampling_desc) is: x, y, width and height, one pixel
 * at least. Regions that share an edge share no pixel and leave none out. Any thread.
 */
CUMULET_API cumulet_status cumulet_region_pixels(const float region[4], uint32_t width, uint32_t height,
                                                 uint32_t pixels[4]);
CUMULET_API cumulet_status cumulet_set_display(cumulet_viewer* viewer, const cumulet_display_desc* desc);

/* ---- Camera and input ------------------------------------------------------------------------------------------- */

typedef enum cumulet_depth {
  CUMULET_DEPTH_STANDARD = 0, /* depth buffers hold 0 at the near plane, 1 at the far plane */
  CUMULET_DEPTH_REVERSED = 1  /* 1 at the near plane, 0 at the far plane */
} cumulet_depth;

typedef enum cumulet_clip {
  CUMULET_CLIP_NEGATIVE_ONE_TO_ONE = 0, /* clip-space z of OpenGL's default */
  CUMULET_CLIP_ZERO_TO_ONE = 1          /* of glClipControl(..., GL_ZERO_TO_ONE) */
} cumulet_clip;

/*
 * A perspective or orthographic camera, of a pinhole or a lens. eye == target: placed once, by the first viewer that
 * renders through it with something to show, so that it fits what is seen from +Z and a little above. Seen are
 * triangles, and the volume where its opacity, at the density scale of that moment, is 5 % or more; where nothing is,
 * the bounds. 6 % of the picture's shorter side, or more, stay free on each side. Near and far plane do not clip the
 * volume: they say what depth buffers mean (d = f (z - n) / (z (f - n)), reversed: 1 - d), and where an orthographic
 * ray begins (at the near plane).
 */
typedef struct cumulet_camera_desc {
  size_t struct_size;
  double eye[3];
  double target[3];           /* what orbiting turns about */
  double up[3];               /* 0: +Y */
  double fovy_degrees;        /* vertical field of view; 0: 40 */
  double orthographic_height; /* world units from bottom to top of the picture; 0: perspective */
  double near_plane;          /* 0: 0.1 for perspective, 0 for orthographic */
  double far_plane;           /* 0: infinite for perspective, 1000 x orthographic_height for orthographic */
  cumulet_depth depth;
  double lens_radius;    /* world units: a thin lens, round; what is not at focus_distance is blurred; 0: a pinhole */
  double focus_distance; /* from the eye along the axis to the plane that is sharp; 0: to the target's */
} cumulet_camera_desc;

/*
 * Depth of field, by a lens: a point at z is a disc of lens_radius x |z - focus| / z, in the plane that is sharp.
 * Traced pictures and AOVs have it. What is rasterised (surfaces of previews, and with CUMULET_SURFACE_LIGHT_NONE),
 * debug views, picks and depths are through the lens' middle, and the host's depth ends rays as if they came from
 * there. A lens is kept by cumulet_camera_set_matrices.
 */
/* Cameras may be shared by viewers. A viewer is made with one of its own. */
CUMULET_API cumulet_status cumulet_camera_create(const cumulet_camera_desc* desc, cumulet_camera** out);
CUMULET_API void cumulet_camera_release(cumulet_camera* camera); /* NULL is allowed */
/* The viewer looks through this camera from now on. */
CUMULET_API cumulet_status cumulet_set_camera(cumulet_viewer* viewer, cumulet_camera* camera);
/* The viewer's camera; the caller releases it. */
CUMULET_API cumulet_status cumulet_get_camera(cumulet_viewer* viewer, cumulet_camera** out);

/*
 * Where things were a frame ago, for CUMULET_AOV_MOTION and CUMULET_AOV_VOLUME_MOTION, and nothing else: what is not
 * said to have been elsewhere stood still. A host gives each frame what it gave as the present one before; a change
 * begins the picture anew.
 *
 * The viewer's camera was where this one is, whose changes it follows; retained. NULL: it stood where it is. seconds,
 * 1e9 at most: from then to now, in which velocities carried media; less than 0: then is yet to come.
 */
CUMULET_API cumulet_status cumulet_set_previous_camera(cumulet_viewer* viewer, cumulet_camera* camera, double seconds);
/* The first count places of the viewer's volume (cumulet_set_volume_places) were there, the others where they are.
 * Errors as there. */
CUMULET_API cumulet_status cumulet_set_previous_volume_places(cumulet_viewer* viewer, const double* to_world,
                                                              uint32_t count);
/* An instance was there, until cumulet_instance_set. NULL: where it is. */
CUMULET_API cumulet_status cumulet_instance_set_previous(cumulet_instance* instance, const double* to_world);
/* A model was there, until cumulet_model_set, and at that moment of its animation, in which it is posed as well. NULL:
 * where it is, at this moment. */
CUMULET_API cumulet_status cumulet_model_set_previous(cumulet_model* model, const double* to_world, const double* time);

CUMULET_API cumulet_status cumulet_camera_set(cumulet_camera* camera, const cumulet_camera_desc* desc);
/* A camera that fits the scene is told as where it came to stand, if a viewer has placed it. */
CUMULET_API cumulet_status cumulet_camera_get(const cumulet_camera* camera, cumulet_camera_desc* desc);
/*
 * The host's own matrices: view is world to eye space (a rotation and a translation), projection any perspective, off
 * axis, infinite or reversed too, or orthographic; clip says what it was made for. The depth convention is the
 * projection's. Camera operations go on from here as from the nearest cumulet_camera_desc.
 */
CUMULET_API cumulet_status cumulet_camera_set_matrices(cumulet_camera* camera, const double view[16],
                                                       const double projection[16], cumulet_clip clip);
/*
 * Where it is as the shutter opens and as it closes (cumulet_sampling_desc.shutter_seconds), until any other call moves
 * it. In between the eye goes straight, the axes turn evenly about one axis (a quaternion's slerp), and what the
 * picture spans at a unit's distance, or its height, changes evenly. Either may be NULL: that is then where it is at
 * the frame's moment. Both are of the camera's own kind, perspective or orthographic, and look somewhere; depth planes,
 * lens and focus distance are the camera's own.
 */
CUMULET_API cumulet_status cumulet_camera_set_shutter(cumulet_camera* camera, const cumulet_camera_desc* open,
                                                      const cumulet_camera_desc* close);
/* The matrices for a picture of this aspect ratio (width / height), for the host's own drawing and gizmos. */
CUMULET_API cumulet_status cumulet_camera_get_matrices(const cumulet_camera* camera, double aspect, cumulet_clip clip,
                                                       double view[16], double projection[16]);

/* Operations, apart from input. Angles in radians; fractions are of the picture's height at the target. */
CUMULET_API cumulet_status cumulet_camera_orbit(cumulet_camera* camera, double yaw, double pitch);
CUMULET_API cumulet_status cumulet_camera_look(cumulet_camera* camera, double yaw, double pitch); /* about the eye */
CUMULET_API cumulet_status cumulet_camera_roll(cumulet_camera* camera, double angle);
CUMULET_API cumulet_status cumulet_camera_pan(cumulet_camera* camera, double right, double up); /* the scene's move */
/* The distance to the target is multiplied by factor (> 0). */
CUMULET_API cumulet_status cumulet_camera_dolly(cumulet_camera* camera, double factor);
/* Moves eye and target by world units along the camera's own axes. */
CUMULET_API cumulet_status cumulet_camera_fly(cumulet_camera* camera, double right, double up, double forward);
/* Keeps the direction and moves so that the box just fills the picture. */
CUMULET_API cumulet_status cumulet_camera_frame(cumulet_camera* camera, const double box_min[3],
                                                const double box_max[3], double aspect);
/* Keeps the direction and fits what is seen of the viewer's volume and triangles, with the margin of a camera that is
 * placed (see cumulet_camera_desc). Some milliseconds. */
CUMULET_API cumulet_status cumulet_frame_all(cumulet_viewer* viewer);

/* Whose habits the mouse follows. In all of them: wheel, + and -: dolly; arrows: orbit by 15 degrees (shift: pan);
 * F, Home, keypad period: frame all. */
typedef enum cumulet_navigation_style {
  CUMULET_NAVIGATION_SIMPLE = 0,  /* left: orbit; middle, or shift + left: pan; right: dolly */
  CUMULET_NAVIGATION_BLENDER = 1, /* middle: orbit; shift + middle: pan; ctrl + middle: dolly; keypad 1, 3, 7: front,
                                     right, top (ctrl: the opposite); keypad 5: perspective or orthographic; keypad 2,
                                     4, 6, 8: orbit */
  CUMULET_NAVIGATION_MAYA = 2     /* alt + left: orbit; alt + middle: pan; alt + right: dolly */
} cumulet_navigation_style;

typedef struct cumulet_navigation_desc {
  size_t struct_size;
  cumulet_navigation_style style;
  int32_t fly;                         /* 1: any button looks around, W A S D E Q move, shift is faster */
  double speed;                        /* of all motion; 0: 1 */
  double turntable_degrees_per_second; /* the camera circles the target while frames are rendered; 0: off */
} cumulet_navigation_desc;

CUMULET_API cumulet_status cumulet_set_navigation(cumulet_viewer* viewer, const cumulet_navigation_desc* desc);

typedef enum cumulet_event_type {
  CUMULET_EVENT_POINTER_MOVE = 0,
  CUMULET_EVENT_BUTTON_DOWN = 1,
  CUMULET_EVENT_BUTTON_UP = 2,
  CUMULET_EVENT_WHEEL = 3,
  CUMULET_EVENT_KEY_DOWN = 4,
  CUMULET_EVENT_KEY_UP = 5,
  CUMULET_EVENT_FOCUS_LOST = 6 /* all buttons and keys are up */
} cumulet_event_type;

typedef enum cumulet_button {
  CUMULET_BUTTON_LEFT = 0,
  CUMULET_BUTTON_MIDDLE = 1,
  CUMULET_BUTTON_RIGHT = 2
} cumulet_button;

/* Letters and digits are their upper-case ASCII codes ('A', '7'). */
typedef enum cumulet_key {
  CUMULET_KEY_NONE = 0,
  CUMULET_KEY_HOME = 256,
  CUMULET_KEY_KEYPAD_0 = 260, /* to CUMULET_KEY_KEYPAD_0 + 9 */
  CUMULET_KEY_KEYPAD_PERIOD = 270,
  CUMULET_KEY_LEFT = 280,
  CUMULET_KEY_RIGHT = 281,
  CUMULET_KEY_UP = 282,
  CUMULET_KEY_DOWN = 283
} cumulet_key;

enum { CUMULET_MODIFIER_SHIFT = 1, CUMULET_MODIFIER_CTRL = 2, CUMULET_MODIFIER_ALT = 4 };

typedef struct cumulet_event {
  size_t struct_size;
  cumulet_event_type type;
  double x; /* of the pointer, from the picture's top left, physical pixels; pointer, button and wheel events */
  double y;
  double wheel; /* steps; positive: towards the scene */
  cumulet_button button;
  int32_t key;        /* a cumulet_key or an ASCII code; others are not handled */
  uint32_t modifiers; /* CUMULET_MODIFIER_*, as they are at this event */
} cumulet_event;

/* Feeds one event to the viewer's camera. *handled (if not NULL): whether it meant something. */
CUMULET_API cumulet_status cumulet_input(cumulet_viewer* viewer, const cumulet_event* event, int32_t* handled);

/* ---- Frames ----------------------------------------------------------------------------------------------------- */

typedef enum cumulet_target {
  CUMULET_TARGET_FRAMEBUFFER = 0, /* the host's, named by framebuffer */
  CUMULET_TARGET_TEXTURE = 1,     /* textures of the viewer's own, told in the result */
  CUMULET_TARGET_NONE = 2         /* nothing is drawn: for readback */
} cumulet_target;

/*
 * What the target's colours mean. The first three take tone-mapped colours. A target's format that cannot hold them is
 * CUMULET_ERROR_INVALID_ARGUMENT; of windows (framebuffer 0) drivers other than Mesa do not report reliably whether
 * they are sRGB, so that this is not checked there.
 */
typedef enum cumulet_colour {
  CUMULET_COLOUR_SRGB = 0,             /* encoded by us; for a format that stores what it is given (GL_RGBA8) */
  CUMULET_COLOUR_SRGB_FRAMEBUFFER = 1, /* encoded by GL (GL_FRAMEBUFFER_SRGB); for sRGB formats (GL_SRGB8_ALPHA8) */
  CUMULET_COLOUR_LINEAR = 2,           /* tone-mapped but not encoded: the host encodes later */
  CUMULET_COLOUR_HDR = 3               /* radiance x exposure, neither tone-mapped nor encoded; for float formats */
} cumulet_colour;

/*
 * Color and alpha are premultiplied: exposure, tone map and encoding are of the premultiplied radiance, so that over
 * black a transparent picture has the colors of the opaque one.
 * With CUMULET_COLOUR_LINEAR, _HDR and _SRGB_FRAMEBUFFER sums are of light: alpha is the part of the pixel that is
 * covered, 0 where it only glows, and color + (1 - alpha) x target is right over any target. CUMULET_COLOUR_SRGB gives
 * encoded values, whose sums are not of light: alpha there is the weight with which the blend is right over black and
 * over white, and between them within 0.1 (of gray pixels; colored flames are up to 0.3 too bright in a channel over
 * middle gray).
 */
typedef enum cumulet_blend {
  CUMULET_BLEND_OVER = 0,   /* premultiplied over what the target holds */
  CUMULET_BLEND_REPLACE = 1 /* colour and alpha replace it, for a host that composites by itself */
} cumulet_blend;

typedef enum cumulet_depth_source {
  CUMULET_DEPTH_SOURCE_NONE = 0,
  CUMULET_DEPTH_SOURCE_TEXTURE = 1,             /* a GL_TEXTURE_2D of a depth format, or of GL_R32F */
  CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE = 2, /* a GL_TEXTURE_2D_MULTISAMPLE of a depth format */
  CUMULET_DEPTH_SOURCE_FRAMEBUFFER = 3          /* the depth attachment of a framebuffer: copied */
} cumulet_depth_source;

typedef struct cumulet_frame_desc {
  size_t struct_size;
  double budget_ms; /* for uploads, tracing and drawing; 0: 10; negative: draw what there is, trace nothing */

  cumulet_target target;
  /*
   * GL name; 0 is the context's default framebuffer, if the host says so. Its draw buffer 0 is drawn to.
   * CUMULET_ERROR_INVALID_ARGUMENT for one that is not complete, has no color there, integers, no green or blue, or an
   * attachment with layers, is smaller than width x height, or has no depth where write_depth is 1.
   */
  uint32_t framebuffer;
  uint32_t width; /* of the whole target, 0 to 16384; with 0 nothing is drawn */
  uint32_t height;
  int32_t viewport[4]; /* x, y, width, height in the target, as glViewport takes them; zero: all of it */
  int32_t flip_y;      /* 0: the picture's top row is at the largest y, as OpenGL has it; 1: at y = 0 */
  double scale;        /* physical pixels a logical one; widths of lines and clicks follow it; 0: 1 */
  uint32_t format;     /* internal format of the target's colour, for its own textures GL_RGBA8, GL_SRGB8_ALPHA8,
                          GL_RGBA16F or GL_RGBA32F, which colour must suit; 0: GL_RGBA16F with
                          CUMULET_COLOUR_HDR, GL_SRGB8_ALPHA8 with CUMULET_COLOUR_SRGB_FRAMEBUFFER, else GL_RGBA8 */
  cumulet_colour colour;
  cumulet_blend blend;
  int32_t write_depth; /* 1: where the volume is at least half opaque, its depth there, in the camera's convention,
                          is written to the target's depth (depth test as the convention has it) */

  cumulet_depth_source depth_source; /* the host's scene, in the camera's convention: volume behind it is hidden */
  uint32_t depth_name;               /* the texture's or the framebuffer's GL name; same size as the viewport, or as the
                                        target if larger: then the same rectangle of it */
  int32_t depth_flip_y;              /* as flip_y, of that depth */
  int32_t depth_unchanged;           /* 1: its contents are as in the last frame: accumulation goes on. 0: whatever is
                                        behind surfaces is traced anew when the depth differs */
} cumulet_frame_desc;

enum {
  CUMULET_RENDER_MORE = 1,      /* there is more to do: render again soon */
  CUMULET_RENDER_CONVERGED = 2, /* every pixel has its samples, at full resolution, of the newest settings */
  CUMULET_RENDER_LOADING = 4,   /* the worker is busy: see cumulet_get_progress */
  CUMULET_RENDER_FAILED = 8,    /* a load or build failed: see "Errors" at the top, and cumulet_get_progress */
  CUMULET_RENDER_PREVIEW = 16,  /* what is shown is coarser than the frame */
  CUMULET_RENDER_UNDRAWN = 32 /* after a frame that draws nothing (CUMULET_TARGET_NONE): the newest picture is not what
                                 was last drawn: without, drawing again is in vain unless the display changes */
};

typedef struct cumulet_frame_result {
  size_t struct_size;
  uint32_t flags;         /* CUMULET_RENDER_* */
  double progress;        /* part of the work on the newest settings that is done, coarse pictures too, 0 to 1 */
  uint32_t width;         /* of the picture that is shown: less than the frame's in a preview, 0 if there is none */
  uint32_t height;        /* likewise */
  uint32_t texture;       /* CUMULET_TARGET_TEXTURE: GL name, valid until the next render or detach */
  uint32_t depth_texture; /* likewise, if write_depth: GL_DEPTH_COMPONENT32F */
} cumulet_frame_result;

/*
 * [GL] One frame: takes up what the worker has made, uploads and traces for about budget_ms in bounded dispatches, and
 * draws the newest picture. result may be NULL. Fails, once, by what cannot be made first (more go to the log), still
 * having drawn what there was before; later frames go on with that until a setting changes.
 *
 * It waits for no result of the device: what a dispatch did is learnt later, at most three of them are under way when
 * the call returns, and what the host has queued neither counts as the tracer's time nor is waited for. A dispatch is
 * sent if it will likely end by the end of the budget, by what dispatches of its kind took at worst; the least that a
 * frame sends (some rounds of 1024 pixels) takes a few milliseconds on software drivers, and the first of a kind waits
 * for the driver to compile. Mesa's llvmpipe runs dispatches within the call, on the cores that the host's drawing is
 * on, and waits for what the host draws into a depth texture that it gives. Calls that read wait for what is under way.
 */
CUMULET_API cumulet_status cumulet_render(cumulet_viewer* viewer, const cumulet_frame_desc* frame,
                                          cumulet_frame_result* result);

typedef enum cumulet_warm_up_scope {
  CUMULET_WARM_UP_SCENE = 0, /* the programs that frames of the present scene with the present settings need */
  CUMULET_WARM_UP_ALL = 1    /* these, and all others of the library are compiled (not used: a driver that compiles more
                                in the first use does so then), but for rare ones: for grids beyond the driver's limit
                                of a texture buffer, or of volumes of more than 32,768 voxels a side, sets of maps that
                                the scene's materials do not have, groups of lights, holdouts and motion blur. One that
                                does not build is told once all others are there */
} cumulet_warm_up_scope;

typedef struct cumulet_warm_up_result {
  size_t struct_size;
  int32_t more;    /* 1: call again */
  double progress; /* 0 to 1, within one warm-up (until more is 0) never less than before; 1 where more is 0 */
} cumulet_warm_up_result;

/*
 * [GL] Compiles the programs of frames like this one, and uses each once for next to nothing, so that no frame waits
 * for the driver later: drivers compile where a program is linked, or where it is first used. As cumulet_render it
 * takes up what the worker has made and uploads, so that all the scene's programs are known; it draws nothing into the
 * frame's target, and reads its depth. Call it after cumulet_wait, or once a frame, until more is 0, and show a bar:
 *
 *     while (cumulet_warm_up(viewer, &frame, CUMULET_WARM_UP_SCENE, &result) == CUMULET_OK && result.more) show_bar();
 *
 * A call that fails leaves result as it was, and ends the warm-up: another begins anew. A load that failed ends it with
 * more 0. With CUMULET_TARGET_NONE, or without a size, no drawing is warmed. For navigation, and for grids that follow
 * the camera, a call counts as a frame.
 *
 * A call works for about the frame's budget_ms (not negative), but a driver that does not compile in parallel
 * (KHR_parallel_shader_compile) takes as long as it takes for the program under way. Where the driver does,
 * cumulet_render does not wait for programs either: until one is there the last picture, a coarser one or the surfaces
 * alone are shown. But a viewer's first [GL] call in a context waits, for one small program, and a frame that has
 * nothing to show instead (the first, one of another encoding) for those that draw. Without a call of this
 * every program is made in the frame that first needs it. result may be NULL. Programs that are there already, another
 * viewer's (cumulet_programs) or a folder's, are not compiled again.
 */
CUMULET_API cumulet_status cumulet_warm_up(cumulet_viewer* viewer, const cumulet_frame_desc* frame,
                                           cumulet_warm_up_scope scope, cumulet_warm_up_result* result);

/* ---- Shadows on what the host draws -------------------------------------------------------------------------------
 */

typedef enum cumulet_map_light {
  CUMULET_MAP_LIGHT_SUN = 0,       /* the viewer's (cumulet_light_desc): parallel light */
  CUMULET_MAP_LIGHT_DIRECTION = 1, /* parallel light of the host's */
  CUMULET_MAP_LIGHT_POINT = 2      /* a lamp that shines in all directions, outside volumes or within */
} cumulet_map_light;

typedef struct cumulet_transmittance_map_desc {
  size_t struct_size;
  uint32_t slot; /* 0 to 15: which of the viewer's maps, each of a light */
  cumulet_map_light light;
  double direction[3]; /* CUMULET_MAP_LIGHT_DIRECTION: world, towards the light, of any length but 0 */
  double position[3];  /* CUMULET_MAP_LIGHT_POINT: world */
  uint32_t size;       /* texels of width and height, 16 to 4096, no more than GL_MAX_3D_TEXTURE_SIZE; 0: 256 */
  uint32_t slices;     /* along the light's rays, 2 to 256; 0: 32. Of no more than 2^27 texels in all */
  double budget_ms;    /* as cumulet_frame_desc's; 0: 2 */
} cumulet_transmittance_map_desc;

typedef struct cumulet_transmittance_map {
  size_t struct_size;
  uint32_t texture; /* GL name of a GL_TEXTURE_3D, GL_R16F, filtered linearly, clamped to its edges: valid until the
                       next call for this slot, or detach */
  uint32_t size;    /* its texels of width and height; smaller than asked for while the scene changes */
  uint32_t slices;
  int32_t more;         /* 1: it is not of the newest scene yet, or coarser than asked for: call again */
  double to_map[16];    /* column by column, as OpenGL has matrices; affine. Of parallel light: world to texture
                           coordinates. Of a point: world to the vector from it, in world units. Far from the
                           origin, multiply it by your own matrix to the world in double precision, not in the shader */
  double near_distance; /* of a point: how far from it the middles of the first and the last slice are; else 0 */
  double far_distance;
} cumulet_transmittance_map;

/*
 * [GL] Shadows of volumes on what the host draws: a deep shadow map (Lokovic and Veach 2000) of one light, which holds
 * what part of it comes through all of the viewer's volumes, instances among them, to points before, within and behind
 * them. Exact in the middles of its texels, by closed form from cell to cell, without noise (of at most four volumes at
 * one place); the viewer's surfaces, its ground and the host's depth throw no shadow in it. The shader of a surface
 * multiplies its light by
 *
 *     uniform sampler3D map;  uniform mat4 to_map;  uniform vec2 range;  // near_distance, far_distance
 *     float shadow = cumulet_transmittance(map, to_map, range, world);   // cumulet_transmittance_map_glsl()
 *
 * Call it once a frame and light, after cumulet_render, whose newest upload it is of. While nothing changes that costs
 * nothing. A map is made within the budget, over some calls if need be, the last one being told meanwhile; before the
 * first, and without a volume, it is one texel of 1: all light. In a scene that changes before a map is done the next
 * is coarser, down to 16 texels, so that it follows; once it rests the map is made in full. 2 bytes a texel, twice
 * while one is being made (256 x 256 x 32: 4 MiB), counted in cumulet_stats.gl_bytes. Fails as cumulet_render; map then
 * stays as it was.
 */
CUMULET_API cumulet_status cumulet_update_transmittance_map(cumulet_viewer* viewer,
                                                            const cumulet_transmittance_map_desc* desc,
                                                            cumulet_transmittance_map* map);
/* [GL] Frees that map; without one it does nothing. */
CUMULET_API cumulet_status cumulet_drop_transmittance_map(cumulet_viewer* viewer, uint32_t slot);
/*
 * GLSL (1.30 and later) for the host's shaders, zero-terminated, to be put after their #version line and before its
 * use: float cumulet_transmittance(sampler3D map, mat4 to_map, vec2 range, vec3 world) the part of the light, 0 to 1,
 * that comes to a point of the world. One look into the texture.
 */
CUMULET_API const char* cumulet_transmittance_map_glsl(void);

typedef struct cumulet_pick {
  size_t struct_size;
  int32_t hit;         /* 1: a surface is met, or the volume reaches half opacity, along the pixel's ray */
  double position[3];  /* world space, where it does */
  double distance;     /* from the ray's origin */
  int32_t met_volume;  /* 1: it is the volume, 0: a surface, or nothing */
  uint32_t place;      /* then: of cumulet_set_volume_places, the one with the most extinction there; of one 0 */
  uint64_t tag;        /* cumulet_instance_desc.tag, if it is one that has the most, or cumulet_model_desc.tag, if it is
                          one that is met; of the viewer's own volume and surfaces 0 */
  int32_t met_surface; /* 1: a triangle of the viewer's surfaces, or of a model, is met */
  uint32_t material;   /* then: its number in the file; of a host's triangles that of their mesh */
  char material_name[128]; /* "" if it has none */
  double normal[3];        /* unit, world space, as its vertices have it, on the side of the ray */
} cumulet_pick;

/* [GL] What is at the position x, y of the picture last rendered, in pixels of its frame. */
CUMULET_API cumulet_status cumulet_pick_at(cumulet_viewer* viewer, double x, double y, cumulet_pick* pick);
/* World bounds of the viewer's volume, its instances, triangles and models. CUMULET_ERROR_INVALID_ARGUMENT if it has
 * neither.
 */
CUMULET_API cumulet_status cumulet_get_bounds(cumulet_viewer* viewer, double box_min[3], double box_max[3]);

/*
 * [GL] The picture so far: width x height (of the result) x 4 floats, first pixel top left, linear radiance in front of
 * the background (premultiplied if that is transparent), and the part of a pixel that is not background. A pixel
 * without samples is 0, before a background of a colour that. count is the number of floats at rgba.
 */
CUMULET_API cumulet_status cumulet_read_linear(cumulet_viewer* viewer, float* rgba, size_t count);
/* [GL] The same as it is displayed: denoised where cumulet_display_desc says so and cumulet_read_denoised can, exposed,
 * tone-mapped, sRGB-encoded, 4 bytes a pixel, opaque unless the background is transparent. Alpha is straight then, as
 * PNG has it: light that is brighter than alpha, as of flames, has no straight color, so alpha is raised until it holds
 * it. Over black such a pixel is as it is displayed; what is behind it shows less than it should. */
CUMULET_API cumulet_status cumulet_read_display(cumulet_viewer* viewer, uint8_t* rgba, size_t count);
/* What cumulet_read_display makes of values as cumulet_read_linear and cumulet_read_denoised give them, of any picture
 * in the shaded view: count floats to as many bytes, a multiple of 4. */
CUMULET_API cumulet_status cumulet_encode_display(cumulet_viewer* viewer, const float* linear, uint8_t* rgba,
                                                  size_t count);

/* By what a picture is denoised. */
typedef struct cumulet_denoise_desc {
  size_t struct_size;
  const char* network; /* a file of Intel's Open Image Denoise: rt_hdr_calb_cnrm.tza or another whose name begins with
                          rt_hdr. The library has none (scripts/install_oidn_weights.sh). NULL: by the filter of
                          CUMULET_DENOISE_FAST, which needs none */
} cumulet_denoise_desc;

/*
 * [GL] cumulet_read_linear's picture so far with its noise taken away by a network that has learned what pictures look
 * like: an estimate, not the mean of samples, and without any promise on its error. Alpha, and what of the picture is
 * not finite, stays. Computed by shaders in this context, with up to 512 MiB of its memory and 80 bytes a pixel for the
 * time of the call; waits for it, 20 to 90 seconds a megapixel on software drivers, and for their compiler; for twice
 * as long where the scene has surfaces or media that give off light: what is known of their light without noise is kept
 * from the network, which sees what is left and what is missing. Without a network: by the filter, alpha as well, with
 * 128 bytes a pixel, a second or two a megapixel on software drivers. Either way rays find that first, of which three
 * take about as long as a sample: 16 a pixel, and up to two a sample, 64 at most, where they are not alike.
 * CUMULET_ERROR_FILE for a file that is missing or no such network, CUMULET_ERROR_UNSUPPORTED for debug views and for a
 * preview over surfaces that are not traced, and as cumulet_read_aov.
 */
CUMULET_API cumulet_status cumulet_read_denoised(cumulet_viewer* viewer, const cumulet_denoise_desc* desc, float* rgba,
                                                 size_t count);
/* Arbitrary output variables: what a compositor wants beside the picture. z is the depth along the camera's axis. */
typedef enum cumulet_aov {
  CUMULET_AOV_BEAUTY = 0, /* 4 floats: premultiplied linear radiance without the background, and alpha: of the volume
                             and our surfaces */
  CUMULET_AOV_VOLUME = 1, /* 4 floats: the same of paths that met the volume first. Needs volume_alone of the sampling.
                             Beauty less this is the surfaces as seen through the volume */
  CUMULET_AOV_TRANSMITTANCE = 2, /* 1 float: of the volume, up to the nearest surface or right through */
  CUMULET_AOV_SURFACE_DEPTH = 3, /* 1 float: z of the nearest surface, ours or the host's, at the pixel's centre;
                                    infinite where there is none */
  CUMULET_AOV_VOLUME_DEPTH = 4,  /* 1 float: z where the volume before that reaches half opacity, infinite where it does
                                    not */
  CUMULET_AOV_NORMAL = 5,        /* 3 floats: mean shading normal of our surfaces in the pixel, world space, towards the
                                    eye, as if there were no volume; 0 where there is none */
  CUMULET_AOV_ALBEDO = 6,        /* 3 floats: mean linear base colour, likewise */
  CUMULET_AOV_ERROR = 7,    /* 1 float: estimated standard error of the pixel's luminance, with the sky's behind it:
                               sqrt((<L^2> - <L>^2) / (n - 1)) of the luminances L of its n samples. Infinite where
                               it has fewer than two */
  CUMULET_AOV_VELOCITY = 8, /* 3 floats: mean velocity of the volume where it scatters the camera's rays for the first
                              time, before the nearest surface; world space, world units a second. 0 where it does
                              nowhere, and where it has no velocities (velocity_grid); surfaces have none. In voxel
                              marches 0, too, of a volume whose box has more than 2^27 voxels or is longer than
                              GL_MAX_3D_TEXTURE_SIZE */
  /*
   * 2 floats, pixels, x to the right and y up: from where something is seen now to where it was seen a frame ago, as
   * Nuke's backward and the first half of Blender's Vector have it. 0 where it was behind the eye, and where nothing is
   * known to have moved (cumulet_set_previous_camera).
   */
  CUMULET_AOV_MOTION = 9,        /* of the nearest surface at the pixel's centre, ours, the host's or the ground, as if
                                    there were no volume, by the camera, the model's place and its pose; where there is
                                    none of what is far away, by the camera's turn (orthographic: 0) */
  CUMULET_AOV_VOLUME_MOTION = 10 /* of the volume, mean over where it scatters the camera's rays for the first time,
                                    before the nearest surface, by the camera, its place and its velocity; 0 where it
                                    does nowhere */
} cumulet_aov;

/*
 * [GL] One of these, of the picture so far: width x height (of the result) pixels, first pixel top left. count is the
 * number of floats at values. Transmittance, depths, normal, albedo, velocity and motion are found when first asked
 * for, by 16 rays a pixel (the depths by the one through its middle; of a picture that was denoised by more where these
 * are not alike), without noise but where surfaces cover or transmit a part of the light, which is a chance; asking
 * again costs the readback. CUMULET_ERROR_INVALID_ARGUMENT for
 * debug views, and for a picture that is still of the volume before.
 */
CUMULET_API cumulet_status cumulet_read_aov(cumulet_viewer* viewer, cumulet_aov aov, float* values, size_t count);
/*
 * [GL] What lights of a group bring to the picture so far, as if no others were there: width x height (of the result) x
 * 3 floats, linear radiance, first pixel top left; the sky, the sun's disc or an environment counted in that are the
 * background, unless that is transparent or a colour. The groups' sum is cumulet_read_linear's radiance but for
 * rounding (and a background's colour). What is rasterised (CUMULET_SURFACE_LIGHT_NONE) counts in group 0. count is the
 * number of floats at rgb. CUMULET_ERROR_INVALID_ARGUMENT for a group that is not gathered, and for debug views; of
 * previews there are none.
 */
CUMULET_API cumulet_status cumulet_read_light_group(cumulet_viewer* viewer, uint32_t group, float* rgb, size_t count);

/* What is in a picture, by name: mattes. */
typedef enum cumulet_object_kind {
  CUMULET_OBJECT_VOLUME = 0,   /* the viewer's own volume, in one of its places, or an instance */
  CUMULET_OBJECT_SURFACES = 1, /* the viewer's own surfaces, or a model */
  CUMULET_OBJECT_GROUND = 2    /* cumulet_ground_desc's */
} cumulet_object_kind;

/*
 * The name of an object, zero-terminated UTF-8, which is used in the call alone; NULL or "": it is in no matte. tag:
 * cumulet_instance_desc.tag or cumulet_model_desc.tag; of the viewer's own and the ground 0. place: of
 * cumulet_set_volume_places; of others 0. Objects of one name share a matte.
 */
typedef const char* (*cumulet_object_name_fn)(void* user, cumulet_object_kind kind, uint64_t tag, uint32_t place);

/*
 * [GL] Mattes of the picture so far, as Cryptomatte has them (Friedman and Jones 2015; specification 1.2 of
 * https://github.com/Psyop/Cryptomatte): width x height (of the result) x ranks pairs of floats, first pixel top left.
 * A pair is an object's id, whose bits are cumulet_cryptomatte_id of its name, and its coverage: the share of the pixel
 * at which it is what camera rays come to first. In a volume that is where they are scattered or absorbed, so that
 * coverages add up to the picture's alpha but for noise. The pair with the largest coverage comes first; where there
 * are no more, both are 0, and what there is beyond ranks (1 to 16; files mostly have 6) is left out, the smallest
 * coverages. Of more than 32 names in one pixel small ones may be left out.
 *
 * name is called for each object that is there, once, in this call; calls of the library from it are refused. What is
 * hidden is not there. A holdout (of a medium, of surfaces, of a model) has no matte, as it has no alpha, and hides
 * what is behind it; so does the host's depth. Models that cameras do not see (shadow_only) have none. Surfaces that
 * transmit count whole, those that cover in part (BLEND) by their coverage.
 *
 * Found anew in each call, by 64 rays a pixel at fixed places, spread over lens and shutter too, along which volumes'
 * coverages are exact (of at most four at one place): without noise, but where surfaces cover in part. It does not
 * depend on the picture's samples. It takes 16 KB of GL's memory a column of pixels for the time of the call. count is
 * the number of floats at values. CUMULET_ERROR_INVALID_ARGUMENT as cumulet_read_aov.
 */
CUMULET_API cumulet_status cumulet_read_cryptomatte(cumulet_viewer* viewer, cumulet_object_name_fn name, void* user,
                                                    uint32_t ranks, float* values, size_t count);
/*
 * The id of a name in Cryptomatte: MurmurHash3_32 of its bytes, seed 0, with the lowest bit of a float's exponent
 * turned over where that would be no finite normal number. What a file's manifest has in hexadecimal. In any thread; 0
 * of NULL, which no name has.
 */
CUMULET_API uint32_t cumulet_cryptomatte_id(const char* name);
/* [GL] Relative standard error of the picture so far: the root of the mean over pixels of the squared standard error of
 * their luminance (CUMULET_AOV_ERROR), over the mean luminance; of the pixels that have two samples. Infinite while it
 * is unknown: no pixel has two samples, or the picture is not finite. So it reaches no target, and 0 means that the
 * samples of each pixel are equal. Samples count as independent: what they spread more evenly than chance makes the
 * true error less. Reads the picture back: now and then, not every frame. */
CUMULET_API cumulet_status cumulet_measure_noise(cumulet_viewer* viewer, double* noise);

/*
 * [GL] All that the samples of the picture under way have come to, for another process to go on with. size: in, the
 * bytes that there is room for; out, those that there are: 32 + 44 a pixel, 60 with volume_alone, and 16 for each group
 * of lights and two more; of an adaptive picture 4 more, and 1 for each square of 8 x 8 pixels. bytes NULL: these
 * alone. Their order is the library's own, and of its version; they say nothing of the scene. Of shaded pictures
 * without previews. CUMULET_ERROR_INVALID_ARGUMENT for others, for too little room and before the first cumulet_render.
 */
CUMULET_API cumulet_status cumulet_read_accumulation(cumulet_viewer* viewer, void* bytes, size_t* size);
/*
 * [GL] The picture under way has these samples, in place of its own. Call it after a cumulet_render that began the
 * picture (with CUMULET_PREVIEW_OFF), with the settings, files, size and driver that it was read with: then it ends as
 * the other would have, bit for bit, with a noise target as well. Of a picture that has all its samples already nothing
 * changes. CUMULET_ERROR_INVALID_ARGUMENT, with everything as it was, for bytes that are not of such a picture of this
 * size and version, or of more samples than it shall have; whether the scene is the same is the host's to know.
 */
CUMULET_API cumulet_status cumulet_restore_accumulation(cumulet_viewer* viewer, const void* bytes, size_t size);

/* What happened, in SI units; fields without a value are 0, but for noise. */
typedef struct cumulet_stats {
  size_t struct_size;
  uint64_t cells;
  uint32_t levels;     /* deepest bisection level of any cell, 0 for the control cube's 24 */
  uint64_t cell_bytes; /* GL bytes the march reads: records and point-location tree, or voxels */
  uint64_t active_voxels;
  double build_seconds_total;
  double build_seconds_load;
  double build_seconds_statistics;
  double build_seconds_refine;
  double build_seconds_records;
  double build_seconds_upload;
  double trace_seconds; /* of the picture under way */
  uint64_t samples;     /* camera paths finished in it, as of the last cumulet_render */
  uint64_t steps;       /* cells or voxels entered by all rays of those paths, as of the last readback */
  double bounds_min[3]; /* world bounds of the volume, wherever it stands */
  double bounds_max[3];
  char gl_vendor[128];
  char gl_renderer[128];
  char gl_version[128];
  int32_t limited;   /* 1: max_cells, not the threshold, ended the refinement */
  uint64_t gl_bytes; /* all GL memory the viewer holds */
  /*
   * What passes took of the device since the viewer was attached, as far as it is known by now, for nothing waits to
   * know it: the difference between two calls is what a graph shows. On a driver that runs dispatches within the call
   * (Mesa's llvmpipe), what they took of the call, without drawing that it puts off.
   */
  double pass_seconds_upload;
  double pass_seconds_host_depth;
  double pass_seconds_surfaces; /* the surface pass of previews */
  double pass_seconds_trace;
  double pass_seconds_inspect; /* debug views, and the volume's depth */
  double pass_seconds_display;
  double noise; /* as cumulet_measure_noise or a readback of the picture found it last; infinite before the first,
                   and where it is unknown */
  uint64_t memory_bytes; /* main memory that cumulet_limits_desc.memory_bytes counts */
  /*
   * Samples of the picture whose light was not finite, or exceeded 1e33. They count as black, so that no NaN or
   * infinity enters the picture, and a warning in the log reports them once a picture (once a viewer with previews). 0
   * is normal.
   */
  uint64_t nonfinite_samples;
} cumulet_stats;

CUMULET_API cumulet_status cumulet_get_stats(cumulet_viewer* viewer, cumulet_stats* stats);

#ifdef __cplusplus
}
#endif

#endif
