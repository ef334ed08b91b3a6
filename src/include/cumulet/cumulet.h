/*
 * Cumulet: path-traced volumes on an adaptive tetrahedral grid, inside the host's own OpenGL context.
 *
 * Overview
 * --------
 * A viewer turns one volume (an OpenVDB or NanoVDB file) into an adaptive, conforming tetrahedral grid
 * (Benyoub and Dupuy, "Adaptive Tetrahedral Grids for Volumetric Path-Tracing", SIGGRAPH Talks 2025) and
 * path-traces it progressively with compute shaders:
 *
 *     cumulet_create -> cumulet_load_volume -> cumulet_set_* -> cumulet_render, again and again, until
 *     CUMULET_RENDER_CONVERGED -> cumulet_read_linear -> cumulet_destroy
 *
 * Threads: one viewer may be used by one thread at a time. cumulet_create, cumulet_render, cumulet_read_linear
 * and cumulet_destroy need the OpenGL context that cumulet_create saw (or one that shares with it) current on
 * the calling thread; the other calls need no context. There are no globals: viewers do not know of each other.
 *
 * OpenGL: version 4.5 core, functions only from the host's get_proc callback. cumulet_render and
 * cumulet_read_linear change and restore: the current program, the shader storage, uniform and image bindings they
 * use, the texture bindings of the units they use and the pixel pack buffer and parameters. They draw into
 * textures of their own and never touch the host's framebuffers. Every GL error is taken and reported.
 *
 * Errors: every function that can fail returns a cumulet_status; cumulet_last_error gives one line that names the
 * file (where there is one) and the cause. A call that fails leaves the viewer as it was.
 *
 * Descriptors: set struct_size to sizeof the struct and zero the rest: zero means the default. Unknown enum values
 * are errors.
 *
 * Units: world space is the VDB's own (metres, +Y up, right-handed). Extinction is density_scale x grid value in
 * 1 / world unit. Radiance and irradiance are linear RGB in any consistent unit.
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
#define CUMULET_VERSION_MINOR 1
#define CUMULET_VERSION_PATCH 0

typedef struct cumulet_viewer cumulet_viewer;

typedef enum cumulet_status {
  CUMULET_OK = 0,
  CUMULET_ERROR_INVALID_ARGUMENT = -1, /* a null handle, a bad size, an unknown enum value, a bad number */
  CUMULET_ERROR_UNSUPPORTED = -2,      /* the context lacks a version, a function or a limit */
  CUMULET_ERROR_FILE = -3,             /* unreadable, malformed or unsuitable file */
  CUMULET_ERROR_OUT_OF_MEMORY = -4,    /* host or GL memory */
  CUMULET_ERROR_GL = -5,               /* any other GL error */
  CUMULET_ERROR_INTERNAL = -6          /* a bug in Cumulet: please report it */
} cumulet_status;

typedef enum cumulet_log_level {
  CUMULET_LOG_DEBUG = 0,
  CUMULET_LOG_INFO = 1,
  CUMULET_LOG_WARNING = 2,
  CUMULET_LOG_ERROR = 3
} cumulet_log_level;

/* The address of a GL function, or NULL. Called during cumulet_create only. */
typedef void* (*cumulet_get_proc_fn)(void* user, const char* name);
/* Called from the thread of the call that logs; message lives until return. May not call back in. */
typedef void (*cumulet_log_fn)(void* user, cumulet_log_level level, const char* message);

typedef struct cumulet_create_desc {
  size_t struct_size;
  cumulet_get_proc_fn get_proc; /* required */
  void* get_proc_user;
  cumulet_log_fn log; /* NULL: silence */
  void* log_user;
} cumulet_create_desc;

/* The library's version, as major * 10000 + minor * 100 + patch. Any thread. */
CUMULET_API uint32_t cumulet_version(void);

/*
 * Checks the current context (version 4.5, compute limits), compiles nothing yet, allocates little.
 * On failure *out is NULL and, if error is not NULL, error_size bytes of it receive the zero-terminated cause.
 */
CUMULET_API cumulet_status cumulet_create(const cumulet_create_desc* desc, cumulet_viewer** out, char* error,
                                          size_t error_size);
/* Frees every GL object and all memory. The context must be current. NULL is allowed. */
CUMULET_API void cumulet_destroy(cumulet_viewer* viewer);
/* The last failure of this viewer in one line, "" if none; lives until the viewer's next call. */
CUMULET_API const char* cumulet_last_error(const cumulet_viewer* viewer);

/*
 * Reads one scalar grid of a .vdb or .nvdb file (no GL, no context needed); the grid of cells is built at the next
 * cumulet_build or cumulet_render. grid_name NULL or "": "density", else the only scalar fog grid.
 * On failure the volume loaded before stays.
 */
CUMULET_API cumulet_status cumulet_load_volume(cumulet_viewer* viewer, const char* path, const char* grid_name);

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
  CUMULET_CRITERION_DEVIATION = 0, /* standard deviation x edge length > threshold x mean optical depth */
  CUMULET_CRITERION_RANGE_MEAN = 1 /* (max - min) / mean > threshold (the paper's) */
} cumulet_criterion;

/* How the cells are made. A change rebuilds them at the next cumulet_build or cumulet_render. */
typedef struct cumulet_grid_desc {
  size_t struct_size;
  cumulet_march march;
  cumulet_cells cells;
  cumulet_criterion criterion;
  double threshold;        /* split above it. 0: 0.02 for deviation, 1 for range-mean; negative: split to the voxel */
  uint64_t max_cells;      /* 0: 5,400,000. Spent where the criterion is largest */
  int32_t camera_adaptive; /* 1: do not split cells outside the frustum or under pixel_size pixels; 0: off */
  double pixel_size;       /* pixels a cell's longest edge must cover to be split; 0: 1 */
} cumulet_grid_desc;

/* The participating medium. A change restarts accumulation only. */
typedef struct cumulet_medium_desc {
  size_t struct_size;
  double density_scale; /* extinction = density_scale x grid value, 1 / world unit; 0: 1 */
  float coalbedo[3];    /* 1 - single-scattering albedo, each in [0, 1]; 0: nothing is absorbed */
  float anisotropy;     /* Henyey-Greenstein g in (-1, 1); 0: isotropic */
  uint32_t max_bounces; /* scattering events a path may have; 0: no limit */
} cumulet_medium_desc;

/* A distant sun (a delta direction, invisible to camera rays) and a sky of constant radiance. */
typedef struct cumulet_light_desc {
  size_t struct_size;
  float sun_azimuth_degrees;   /* direction towards the sun, from +Z towards +X */
  float sun_elevation_degrees; /* above the horizon */
  float sun_irradiance[3];     /* on a surface that faces it; 0: no sun */
  float sky_radiance[3];       /* 0: black */
} cumulet_light_desc;

/* A pinhole camera. All zero: fit the volume's bounds from +Z, a little above. */
typedef struct cumulet_camera_desc {
  size_t struct_size;
  double eye[3];
  double target[3];
  double up[3];        /* 0: +Y */
  double fovy_degrees; /* vertical field of view; 0: 40 */
} cumulet_camera_desc;

typedef enum cumulet_view {
  CUMULET_VIEW_SHADED = 0,
  CUMULET_VIEW_CELLS = 1,  /* the cells on a cut through the middle, coloured by level, with their edges */
  CUMULET_VIEW_STEPS = 2,  /* march steps of the camera ray, as a heat map */
  CUMULET_VIEW_DENSITY = 3 /* optical depth along the camera ray: 1 - exp(-depth), grey */
} cumulet_view;

typedef struct cumulet_image_desc {
  size_t struct_size;
  uint32_t width; /* pixels, 1 to 16384 */
  uint32_t height;
  uint32_t samples; /* target samples a pixel; 0: 64 */
  uint32_t seed;    /* same seed, same samples, same driver: same image, bit for bit */
  cumulet_view view;
} cumulet_image_desc;

CUMULET_API cumulet_status cumulet_set_grid(cumulet_viewer* viewer, const cumulet_grid_desc* desc);
CUMULET_API cumulet_status cumulet_set_medium(cumulet_viewer* viewer, const cumulet_medium_desc* desc);
CUMULET_API cumulet_status cumulet_set_light(cumulet_viewer* viewer, const cumulet_light_desc* desc);
CUMULET_API cumulet_status cumulet_set_camera(cumulet_viewer* viewer, const cumulet_camera_desc* desc);
CUMULET_API cumulet_status cumulet_set_image(cumulet_viewer* viewer, const cumulet_image_desc* desc);

/* Builds and uploads what the settings need and is out of date. cumulet_render does it by itself otherwise. */
CUMULET_API cumulet_status cumulet_build(cumulet_viewer* viewer);

enum {
  CUMULET_RENDER_MORE = 1,     /* the target samples are not reached yet */
  CUMULET_RENDER_CONVERGED = 2 /* they are, in every pixel */
};

/*
 * Traces for about budget_ms milliseconds in bounded dispatches and waits for them. flags receives CUMULET_RENDER_*;
 * progress, if not NULL, the part of all samples done, 0 to 1.
 */
CUMULET_API cumulet_status cumulet_render(cumulet_viewer* viewer, double budget_ms, uint32_t* flags, double* progress);

/*
 * The picture so far: width x height x 4 floats, first pixel top left, linear RGB radiance and alpha (the fraction of
 * camera paths that met the volume). A pixel without samples is 0. count is the number of floats at rgba.
 */
CUMULET_API cumulet_status cumulet_read_linear(cumulet_viewer* viewer, float* rgba, size_t count);

/* What happened, in SI units; fields without a value are 0. */
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
  double trace_seconds;
  uint64_t samples;     /* camera paths finished */
  uint64_t steps;       /* cells or voxels (or bricks) entered by all rays of those paths */
  double bounds_min[3]; /* world bounds of the volume */
  double bounds_max[3];
  char gl_vendor[128];
  char gl_renderer[128];
  char gl_version[128];
} cumulet_stats;

CUMULET_API cumulet_status cumulet_get_stats(const cumulet_viewer* viewer, cumulet_stats* stats);

#ifdef __cplusplus
}
#endif

#endif
