/**
 * @file
 * The C interface of Cumulet: path-traced volumes on an adaptive tetrahedral grid, inside the host's own OpenGL
 * context. @ref cumulet_overview has the rules that hold for all functions.
 */

/**
 * @page cumulet_overview Overview of cumulet.h
 *
 * A viewer turns one volume (an OpenVDB or NanoVDB file, or voxels in memory) into an adaptive, conforming tetrahedral
 * grid (Benyoub and Dupuy, "Adaptive Tetrahedral Grids for Volumetric Path-Tracing", SIGGRAPH Talks 2025). It
 * path-traces the grid progressively with compute shaders, and draws the current image into the framebuffer that the
 * host names:
 *
 *     cumulet_create -> cumulet_load_volume -> each frame: cumulet_render -> cumulet_destroy
 *
 * A scene may also have surfaces (a glTF 2.0 file, or the host's own triangles), with or without a volume. Volume and
 * surfaces are rendered into one image, and light travels between them (cumulet_load_surfaces, cumulet_set_surfaces).
 *
 * The library creates no window and no context, and does not link OpenGL: GL functions come from the host's get_proc
 * callback. No result depends on global state. Viewers are independent of each other, in one context or several and on
 * one thread or several, unless they share shader programs and GL memory (cumulet_shader_cache).
 *
 * @section cumulet_life_cycle Life cycle
 *
 * A viewer is either attached to a GL context or detached. cumulet_create attaches it if get_proc is given; otherwise
 * cumulet_attach does. A detached viewer loads files, builds grids and takes settings, but cannot render.
 *
 * Before the host destroys its context (for example when a widget moves between windows), it calls cumulet_detach
 * while the context is current. If the context is already gone, it calls cumulet_context_lost. Then it calls
 * cumulet_attach in the new context. Volume, grid, surfaces, settings and camera are kept, and the next frames create
 * the GL objects again.
 *
 * cumulet_destroy needs the context current if the viewer is attached. Without it, the GL objects remain until the
 * context is destroyed.
 *
 * @section cumulet_threads Threads
 *
 * - Any function may be called on any thread at any time, with any handle, except that no call for a viewer may overlap
 *   with its cumulet_destroy. The host needs no lock of its own.
 * - Functions marked [GL] need the attached context, or a context that shares objects with it, current on the calling
 *   thread. Otherwise each call returns CUMULET_ERROR_GL and changes nothing; the next call with the context current
 *   works again. No other function uses GL. [GL] calls for one viewer wait for each other.
 * - All other functions (settings, loads, input, queries) do not wait for frames. While another thread is in
 *   cumulet_render, they take effect at once, and the next frame shows it. The running frame shows the state that it
 *   found. There are three exceptions: cumulet_get_stats, cumulet_attach and cumulet_context_lost wait for running [GL]
 *   calls, and cumulet_wait waits for workers. cumulet_context_lost and cumulet_destroy also wait for running [GL]
 *   calls of viewers that share GL memory (cumulet_shader_cache).
 * - Each call is complete in itself. Two threads that read, change and set the same settings need a lock of their own.
 * - Worker threads read files, build grids, pose surfaces and compute physical skies. cumulet_render uploads the
 *   results within its time budget, and shows the last complete image until then.
 * - All viewers of the process share the worker threads. There are at most 8, or two per processor if that is more.
 *   Threads in a callback of the host do not count. Work waits for a free thread, and the viewers take turns.
 * - Requests are coalesced: each kind of work has at most one running and one queued request, and a new request
 *   replaces the queued one. A running build or pose is finished. A new load also cancels the running work, but not
 *   twice in a row. So a stream of requests always has some of its results displayed, and its latest request is always
 *   processed.
 *
 * Callbacks:
 *
 * - The update callback may be called on any thread, including a worker thread, until cumulet_destroy returns.
 * - A callback must not call the library, with these exceptions: cumulet_cancel, cumulet_get_progress, the functions
 *   that retain or release handles, cumulet_status_text, cumulet_version, cumulet_cryptomatte_id, cumulet_region_pixels
 *   and cumulet_transmittance_map_glsl. Other calls inside a callback, for any viewer or handle, return
 *   CUMULET_ERROR_INVALID_ARGUMENT; cumulet_destroy does nothing.
 * - Take no lock in a callback that is also held around calls of the library, because other calls may wait for the
 *   callback: [GL] calls of viewers with the same shader cache, calls for the same viewer or handle, and calls that
 *   replace content.
 * - Log lines and notifications of a call that changes settings come at its end, when other threads may already make
 *   calls.
 * - A call that changes a camera, an instance, a model, a sequence or a dynamic volume runs the update callbacks of all
 *   viewers that show it.
 *
 * @section cumulet_process_end End of the process
 *
 * A process may end while viewers work: by exit() on any thread (also inside a callback), by a return from main, or by
 * dlclose of the library. Running work is cancelled. The library joins its threads before its static objects, and those
 * of the libraries that it uses, are destroyed. From then on no callback is called. Running calls of other threads are
 * waited for, at most 10 seconds (1 second if exit() is called in a callback). Later calls from those threads return
 * CUMULET_ERROR_CANCELLED. The thread that ends the process may still destroy viewers and release handles in
 * destructors of static objects.
 *
 * If the host's language runtime shuts down first (Python's, for example), callbacks may be called while it does.
 * Destroy the viewer before, unless the callbacks can run then. _exit, quick_exit and abort join nothing.
 *
 * In a forked child, every call refuses viewers of the parent, and cumulet_destroy does nothing with them. exit() in
 * the child does not wait for threads that exist only in the parent.
 *
 * @section cumulet_gl OpenGL state
 *
 * The library needs version 4.5, core or compatibility profile. With CUMULET_GL_STATE_RESTORE (the default) a [GL] call
 * leaves all state as it found it. It depends on no state of the host: it first sets pixel buffers and parameters,
 * bindings and capabilities to the values that it needs. A call queries and sets only the state that it uses; it
 * queries each such state once, and restores it. It may use:
 *
 * - the current program and program pipeline, the vertex array binding, the draw and read framebuffer bindings
 * - the active texture; on units 0-15 the texture bindings of every target and the sampler
 * - storage buffer bindings 0-7, uniform buffer bindings 0-7 and their generic points, the dispatch indirect buffer,
 *   image units 0-7
 * - pixel pack and unpack buffers and all pixel store parameters
 * - viewport 0, scissor test and box 0, color mask (of every draw buffer), depth mask, function, test and range, depth
 *   clamp, stencil test
 * - blending (enable, functions, equations) of draw buffers 0 and 1 and the enable of the others
 * - cull face (enable, mode), front face, polygon mode and smoothing, polygon offset enables
 * - rasterizer discard, logic op, multisample, sample shading, sample alpha to coverage and to one
 * - sample coverage and mask, primitive restart (both), clip distances 0-7, clip control, dither
 * - GL_FRAMEBUFFER_SRGB, read color clamp
 *
 * and in a context of the compatibility profile:
 *
 * - alpha test, polygon stipple, fragment color clamp
 * - on units 0-15 the level-of-detail bias (glTexEnv, GL_TEXTURE_LOD_BIAS)
 * - pixel transfer: color and stencil maps (their enables), index shift and offset, all scales and biases
 * - with GL_ARB_imaging: the enables of color tables, convolutions, histogram and minmax, the color matrix, the matrix
 *   mode
 *
 * and the contents of the frame's own target. It never changes queries, transform feedback, the debug callback and its
 * filters, sync objects of the host, or any other object. The one sync object that it uses is the one in
 * cumulet_gl_volume_desc, for which the device waits. Do not call the library inside transform feedback, conditional
 * rendering or a query of the host.
 *
 * With CUMULET_GL_STATE_HOST_RESETS nothing is saved or restored: after a call the state listed above is undefined.
 * Objects get labels, and passes are debug groups (KHR_debug), at most two on top of the host's own; there are none if
 * the host's groups fill the driver's stack. glGetError is clean after every call; errors that were pending before are
 * dropped. The host must disable state of extensions, such as a depth bounds test or window rectangles.
 *
 * @section cumulet_compatibility Compatibility profile
 *
 * Other legacy state neither changes images nor is changed: fog, lighting, shade model, texture enables, client arrays,
 * pixel maps, matrix and attribute stacks. Calls may come between glPushAttrib and glPopAttrib. A [GL] call returns
 * CUMULET_ERROR_GL, names the cause and changes nothing
 *
 * - while a display list is open (glNewList), because the list would record it
 * - while the render mode is GL_SELECT or GL_FEEDBACK
 * - between glBegin and glEnd. GL itself then records an error, which glGetError returns after glEnd.
 *
 * The next call outside of these works again. cumulet_detach and cumulet_destroy work in display lists and render
 * modes, because GL deletes objects at once. Between glBegin and glEnd, cumulet_destroy leaves GL objects behind.
 *
 * get_proc must return glPixelTransferf, glTexEnvf and glGetTexEnvfv, and with GL_ARB_imaging also glMatrixMode and
 * glLoadMatrixf. If one of them is missing, attaching returns CUMULET_ERROR_UNSUPPORTED. get_proc is also called for
 * eglGetCurrentContext, OSMesaGetCurrentContext, wglGetCurrentContext and glXGetCurrentContext, and may return NULL for
 * each. The library uses them to distinguish a call between glBegin and glEnd from a call without a context. If all are
 * NULL, the error line names both causes. Object names must come from glGen or glCreate calls, because names that a
 * host makes up may be the library's.
 *
 * @section cumulet_ownership Ownership
 *
 * Handles are reference-counted or have a single owner; the comment of each type names the function that ends it. An
 * object that a viewer uses lives on after the caller has released its handle. The host's textures and framebuffers
 * belong to the host. A texture in a cumulet_frame_result belongs to the viewer. Strings and arrays that are passed in
 * are copied, unless a comment says otherwise.
 *
 * @section cumulet_errors Errors
 *
 * - Every function that can fail returns a cumulet_status. cumulet_last_error then returns, on the same thread, one
 *   line that names the cause, and the file if there is one. After a function without a viewer it takes NULL. Such
 *   functions also write the line into the caller's error buffer, if they have one.
 * - A call that fails leaves the viewer as it was, and the viewer still draws what it drew before. No C++ exception
 *   leaves the library.
 * - Every function returns CUMULET_ERROR_INVALID_ARGUMENT for a NULL handle, a NULL pointer that is not documented as
 *   optional, a wrong struct_size, an unknown enum value, a flag (int32_t) that is neither 0 nor 1, and a number that
 *   is not finite or outside its documented range. A comment that names this status lists only the other causes.
 * - "A [GL] error" in a comment is one of: CUMULET_ERROR_GL (the attached context is not current, or another GL error),
 *   CUMULET_ERROR_DETACHED, CUMULET_ERROR_CONTEXT_LOST or CUMULET_ERROR_OUT_OF_MEMORY.
 * - Any function may also return CUMULET_ERROR_OUT_OF_MEMORY, CUMULET_ERROR_INTERNAL, or CUMULET_ERROR_CANCELLED while
 *   the process ends.
 * - Numbers in messages are written as in the classic locale, and files are read the same way, in every locale of the
 *   process.
 *
 * Failures of worker threads:
 *
 * - cumulet_wait, cumulet_progress.status and CUMULET_RENDER_FAILED report work that fails on a worker thread.
 *   CUMULET_RENDER_FAILED leaves out CUMULET_ERROR_CANCELLED.
 * - There are five kinds of content, in this order: the volume (from a file, a cumulet_volume, a sequence or a
 *   dynamic volume), the volumes of instances, the surfaces, the models, and the environment or physical sky.
 * - Each kind keeps the failure of its last work until the next call that loads or sets this kind, including with NULL.
 *   Work that such a call ends counts as cancelled. For instances and models, the failure is kept as long as a failed
 *   one is shown.
 * - Each report returns the failure of the first kind that has one. It is repeated until a call begins other work: a
 *   load, a call that sets content of any kind, or a setting that requires a rebuild. A failure that was reported
 *   before such a call is not reported again.
 * - volume_status, surfaces_status and environment_status of cumulet_progress keep it.
 *
 * @section cumulet_files Files
 *
 * Paths are UTF-8, in every function and struct. A relative path is relative to the current folder of the process at
 * the time of the call; so are files that the file itself refers to. The folder may change while a worker reads.
 * Messages contain the path as it was given.
 *
 * @section cumulet_descriptors Descriptors
 *
 * Set struct_size to sizeof the struct, and zero the rest: zero means the default. Unknown enum values are errors. A
 * struct from an older header is shorter, and its missing fields count as zero. Any other size returns
 * CUMULET_ERROR_INVALID_ARGUMENT. That includes a size that cuts a field, and the size of a struct in a newer header.
 *
 * @section cumulet_units Units and conventions
 *
 * - World space is that of the VDB (meters, +Y up, right-handed). Extinction is density_scale x grid value, in
 *   1 / world unit.
 * - Radiance and irradiance are linear Rec. 709 RGB in any consistent unit.
 * - Matrices are 16 doubles, column-major, for column vectors, as in OpenGL.
 * - Sizes and positions on screen are physical pixels. Pixel (0, 0) is the top left one, and a pixel's position is that
 *   of its top left corner.
 * - Positions are doubles and may be anywhere within 1e12 of the origin: a scene in map or earth-centered coordinates
 *   looks as it does at the origin. The viewer subtracts a scene origin, in double precision, before it converts to
 *   float. If a scene is much wider than the distance to the object nearest to the camera, that origin follows the
 *   camera.
 * - Floats that a host or a file stores far from 0 have already lost precision. Keep such offsets in matrices and in
 *   the translations of nodes. The log has a warning if vertices are rounded by 1/4096 of their mesh's size or more.
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

typedef struct cumulet_viewer cumulet_viewer;     /**< Renders a scene. Ended by cumulet_destroy. */
typedef struct cumulet_volume cumulet_volume;     /**< Immutable voxels. Ended by cumulet_volume_release. */
typedef struct cumulet_surfaces cumulet_surfaces; /**< Immutable meshes. Ended by cumulet_surfaces_release. */
typedef struct cumulet_camera cumulet_camera;     /**< Ended by cumulet_camera_release. */
/** Shader programs. Ended by cumulet_shader_cache_release. */
typedef struct cumulet_shader_cache cumulet_shader_cache;
typedef struct cumulet_environment cumulet_environment; /**< Environment map. Ended by cumulet_environment_release. */
typedef struct cumulet_sequence cumulet_sequence;       /**< One volume per frame. Ended by cumulet_sequence_release. */
/** A volume whose content the host replaces. Ended by cumulet_dynamic_volume_release. */
typedef struct cumulet_dynamic_volume cumulet_dynamic_volume;

/** The result of a call. Zero is success; errors are negative. */
typedef enum cumulet_status {
  CUMULET_OK = 0,
  CUMULET_ERROR_INVALID_ARGUMENT = -1, /**< A null handle, a bad size, an unknown enum value, a bad number. */
  CUMULET_ERROR_UNSUPPORTED = -2,      /**< The context lacks a version, a function or a limit. */
  CUMULET_ERROR_FILE = -3,             /**< An unreadable, malformed or unsuitable file, or such voxels in memory. */
  CUMULET_ERROR_OUT_OF_MEMORY = -4,    /**< Main memory or GL memory. */
  CUMULET_ERROR_GL = -5,               /**< Any other GL error, such as a [GL] call without the attached context. */
  CUMULET_ERROR_INTERNAL = -6,         /**< A bug in Cumulet: please report it. */
  CUMULET_ERROR_CANCELLED = -7,        /**< By cumulet_cancel, or because the process ends. */
  CUMULET_ERROR_CONTEXT_LOST = -8,     /**< The driver reset the context: the viewer is detached now. */
  CUMULET_ERROR_DETACHED = -9,         /**< A [GL] call for a viewer without a context. */
  CUMULET_ERROR_TIMEOUT = -10          /**< cumulet_wait: not ready in time. */
} cumulet_status;

/**
 * Returns a few English words for a status, for example "out of memory".
 *
 * Threads: any thread. No GL.
 *
 * @param status Any value; an unknown one gives "unknown status".
 * @return A static string, never NULL.
 */
CUMULET_API const char* cumulet_status_text(cumulet_status status);
/**
 * Returns the library's version, which may differ from that of the header.
 *
 * Threads: any thread. No GL.
 *
 * @return major x 10000 + minor x 100 + patch.
 */
CUMULET_API uint32_t cumulet_version(void);

/* ---- Viewer ------------------------------------------------------------------------------------------------------ */

/**
 * @defgroup cumulet_viewers Viewers and callbacks
 *
 * Functions that create, attach, detach and destroy viewers, and the callbacks that a host gives them.
 * @{
 */

/** Severity of a log line. */
typedef enum cumulet_log_level {
  CUMULET_LOG_DEBUG = 0,
  CUMULET_LOG_INFO = 1,
  CUMULET_LOG_WARNING = 2,
  CUMULET_LOG_ERROR = 3
} cumulet_log_level;

/**
 * Returns the address of a GL function, or NULL. It is called only during cumulet_create and cumulet_attach. The
 * library calls the returned functions as long as this viewer is attached, or any viewer that shares its shader cache.
 *
 * @param user cumulet_create_desc.get_proc_user, or the argument of cumulet_attach.
 * @param name The function's name, for example "glDispatchCompute".
 */
typedef void* (*cumulet_get_proc_fn)(void* user, const char* name);
/**
 * Receives a log line. Called on the calling thread or on a worker thread; must not call the library (see
 * @ref cumulet_threads).
 *
 * @param user    cumulet_create_desc.log_user.
 * @param level   The severity.
 * @param message One line, valid until the callback returns.
 */
typedef void (*cumulet_log_fn)(void* user, cumulet_log_level level, const char* message);
/**
 * Notifies the host that there is something new to render: a volume was loaded, a grid is ready, a setting or the
 * camera changed. Called on any thread. Schedule a frame and return; do not call the library. Notifications are
 * coalesced: after one, the callback is not called again before the next cumulet_render.
 *
 * @param user cumulet_create_desc.update_user.
 */
typedef void (*cumulet_update_fn)(void* user);

/**
 * Receives one finished interval of work, for a timeline. Intervals are "frame" (cumulet_render), its passes
 * ("cumulet: trace"), "cumulet: warm-up", and jobs of workers ("building the grid", a file). Called on the thread that
 * did the work; must not call the library. Intervals reported for one thread are either nested or disjoint.
 *
 * @param user  cumulet_create_desc.trace_user.
 * @param name  The name of the work, valid until the callback returns.
 * @param begin Start in seconds of the steady clock (CLOCK_MONOTONIC).
 * @param end   End in seconds of the same clock.
 */
typedef void (*cumulet_trace_fn)(void* user, const char* name, double begin, double end);

/** Whether [GL] calls save and restore the host's GL state; see @ref cumulet_gl. */
typedef enum cumulet_gl_state_policy {
  CUMULET_GL_STATE_RESTORE = 0,    /**< [GL] calls leave the state as they found it. */
  CUMULET_GL_STATE_HOST_RESETS = 1 /**< They do not: the host sets all that it needs afterwards, as Qt and GTK do. */
} cumulet_gl_state_policy;

/** How shader programs are cached; see cumulet_shader_cache_create. */
typedef struct cumulet_shader_cache_desc {
  size_t struct_size;
  /**
   * UTF-8 path of the folder that keeps program binaries between runs, so that the driver need not compile again. NULL
   * or "": no folder.
   *
   * - The files take at most 256 MiB together; the least recently used are deleted first. The folder is created with
   *   the first file.
   * - A binary is valid for one driver and one version of the library. Damaged or other binaries are ignored and
   *   written again. Any number of processes may use one folder.
   * - The driver runs these binaries: do not let other users write into the folder.
   * - If the folder cannot be written, the log has one warning.
   */
  const char* folder;
  /**
   * For developers of the library: UTF-8 path of a folder with shaders (a copy of glsl/) that replace the library's
   * own. The log has one line per shader that is read, and says whether it differs from the library's own. They are
   * read again when they change. If one does not build, the log has one warning and the previous one stays in use.
   * NULL or "": the library's own shaders.
   */
  const char* shaders;
} cumulet_shader_cache_desc;

/**
 * Creates a cache of shader programs that viewers share (cumulet_create_desc.shader_cache). Viewers that are attached
 * to one context, or to contexts that share objects, compile each program only once among them, and have one copy of
 * each grid in GL memory. The library finds out which contexts share objects.
 *
 * - The programs are deleted with the last viewer that is attached to them; the files in the folder stay.
 * - Viewers share cells in GL memory if they show the same grids (@ref cumulet_volumes) in the same order. One viewer
 *   uploads them, within its frames. Meanwhile the others show their last image. If that viewer renders no more frames,
 *   another one uploads them. The copy is deleted with the last viewer that shows it, whichever viewer uploaded it.
 *   cumulet_detach, cumulet_context_lost and cumulet_destroy of one viewer do not affect the others.
 * - A shared copy counts in full for each viewer, in cumulet_limits_desc.gl_bytes and in cumulet_stats. So the grids
 *   and images of a viewer do not depend on the others. cumulet_stats.cell_viewers is the number of viewers that share.
 * - These viewers also share the voxels of dynamic volumes in GL memory (gpu_resident). Each viewer has its own grids
 *   of those voxels, and of the frames of sequences.
 * - [GL] calls of viewers that share programs wait for each other if they come from several threads. Callbacks may be
 *   called meanwhile: take no lock in them that is held around a [GL] call.
 * - The functions that get_proc returned for one of these viewers must stay callable until none of them is attached.
 *
 * Threads: any thread. No GL.
 *
 * @param desc       Folders for binaries and shaders.
 * @param out        Receives the handle, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_shader_cache_create(const cumulet_shader_cache_desc* desc,
                                                       cumulet_shader_cache** out, char* error, size_t error_size);
/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param cache May be NULL.
 * @return cache.
 */
CUMULET_API cumulet_shader_cache* cumulet_shader_cache_retain(cumulet_shader_cache* cache);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param cache May be NULL.
 */
CUMULET_API void cumulet_shader_cache_release(cumulet_shader_cache* cache);

/** How a viewer is created; all callbacks are optional. */
typedef struct cumulet_create_desc {
  size_t struct_size;
  cumulet_get_proc_fn get_proc; /**< Loads GL functions. NULL: the viewer is created detached. */
  void* get_proc_user;
  cumulet_log_fn log; /**< Receives log lines. NULL: none. */
  void* log_user;
  cumulet_update_fn update; /**< Is called when there is something to render. NULL: none. */
  void* update_user;
  cumulet_gl_state_policy gl_state;
  cumulet_trace_fn trace; /**< Receives timeline intervals. NULL: none. */
  void* trace_user;
  cumulet_shader_cache* shader_cache; /**< Shared programs and GL memory, retained. NULL: its own, without a folder. */
} cumulet_create_desc;

/**
 * [GL] if get_proc is given. Creates a viewer, and attaches it to the current context if get_proc is given. It checks
 * the context (version 4.5, compute limits), but compiles and allocates nothing yet.
 *
 * Threads: any thread.
 *
 * @param desc       Callbacks and GL policy.
 * @param out        Receives the viewer, which the caller destroys; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, CUMULET_ERROR_UNSUPPORTED if the context lacks something, or
 *         CUMULET_ERROR_GL.
 */
CUMULET_API cumulet_status cumulet_create(const cumulet_create_desc* desc, cumulet_viewer** out, char* error,
                                          size_t error_size);
/**
 * [GL] if attached. Cancels the workers, waits for them and frees everything. Without the context current, the GL
 * objects remain until the context is destroyed, except for those that other viewers share (cumulet_shader_cache).
 *
 * Workers check for cancellation every few milliseconds: a destroy takes some 20 ms on an idle machine. Work that
 * cannot be interrupted is not waited for: a running decoder of another library (an image, a compressed mesh, JSON), or
 * the freeing of gigabytes. It ends on threads of the library that may outlive the viewer by about a second. These
 * threads call no callback and use no GL, handle or file. dlclose and exit() wait for them.
 *
 * Threads: any thread, after all other calls for the viewer; not inside a callback, where it does nothing.
 *
 * @param viewer May be NULL.
 */
CUMULET_API void cumulet_destroy(cumulet_viewer* viewer);
/**
 * Returns why the last call of this thread for this viewer failed, in one line. cumulet_get_progress and cumulet_cancel
 * do not change it.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer. NULL: for the last call of this thread without a viewer, for example with an instance.
 * @return The line; "" if that call succeeded, or if there was none. Valid until the next call of this thread for this
 *         viewer, or without one. It is "viewer is NULL" with NULL, after a call that needs a viewer and got NULL.
 */
CUMULET_API const char* cumulet_last_error(const cumulet_viewer* viewer);

/**
 * [GL] Attaches a detached viewer to the current context, with the checks of cumulet_create. The next frames create its
 * GL objects.
 *
 * Threads: any thread with the context.
 *
 * @param viewer        A detached viewer.
 * @param get_proc      Loads GL functions; called only during this call.
 * @param get_proc_user Its first argument.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT if the viewer is attached already, CUMULET_ERROR_UNSUPPORTED if
 *         the context lacks something, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_attach(cumulet_viewer* viewer, cumulet_get_proc_fn get_proc, void* get_proc_user);
/**
 * [GL] Deletes the viewer's GL objects and detaches it. Does nothing if it is detached already.
 *
 * Threads: any thread with the context.
 *
 * @param viewer The viewer.
 * @return CUMULET_OK, or CUMULET_ERROR_GL if the attached context is not current; the viewer then stays attached.
 */
CUMULET_API cumulet_status cumulet_detach(cumulet_viewer* viewer);
/**
 * Detaches a viewer without any GL call, because its context and all objects in it are gone. Does nothing if it is
 * detached already.
 *
 * Threads: any thread; waits for running [GL] calls, also those of viewers that share GL memory. No GL.
 *
 * @param viewer The viewer.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_context_lost(cumulet_viewer* viewer);

/** @} */

/* ---- Volumes ----------------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_volumes Volumes
 *
 * A cumulet_volume holds scalar fog grids in main memory. It is immutable, reference-counted and independent of GL, and
 * any number of viewers may show it. The functions of this group that create a volume do so before they return;
 * cumulet_load_volume does it on a worker.
 *
 * - Viewers that need the same grid of a volume share it: it is built once, and it is in main memory once. The grids
 *   are the same if the grid settings are equal, and also those settings of media and limits on which a grid depends. A
 *   camera-adaptive grid depends on the camera, too. While one viewer builds the grid, the others wait. cumulet_cancel
 *   for one viewer does not affect the others. In GL memory, viewers with one cumulet_shader_cache have one copy;
 *   viewers without one have their own.
 * - The medium is zero outside the bounds of the active voxels.
 * - Negative and non-finite voxels of a density count as zero. So do voxels beyond 1e30 or -1e30 of every field,
 *   because fill values are as large.
 * - A grid without active voxels is an empty volume, which shows nothing. cumulet_volume_get_info reports it, and
 *   cumulet_load_volume logs a warning.
 * @{
 */

/**
 * Reads the density of a .vdb or .nvdb file, and the other fields that are found by name (docs/grids.md). All functions
 * that read volumes also read dense arrays: .nrrd, .vti, .tif, folders of .tif slices, .raw with a JSON description.
 *
 * Without a name, the density is the grid called "density", or else "smoke" or "soot". A file that has none of these,
 * but a temperature or a flame, has no density: it shows only fire. In a file without any of them, the first scalar fog
 * grid is the density. A name in exactly this case is preferred to the same name in another case. cumulet_load_volume
 * logs a warning that names the grids that were not read.
 *
 * Threads: any thread; returns when the file is read. No GL.
 *
 * @param path       UTF-8 path of the file.
 * @param grid_name  The density grid. "name[1]" is the second grid of that name. NULL or "": by name.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_volume_open(const char* path, const char* grid_name, cumulet_volume** out,
                                               char* error, size_t error_size);

/** Which grids of a file are read, and the transform of the volume. */
typedef struct cumulet_volume_file_desc {
  size_t struct_size;
  const char* path;      /**< UTF-8 path of the volume, of a format that cumulet_volume_open reads. */
  const char* grid_name; /**< The density grid, chosen as by cumulet_volume_open. */
  /**
   * Affine transform from the file's world space to the scene's, in which +Y is up. All zero: identity. For a file
   * whose up axis is Z, as in Blender and Mantaflow, it maps (x, y, z) to (x, z, -y). Its columns are then 1,0,0,0,
   * 0,0,-1,0, 0,1,0,0 and 0,0,0,1.
   */
  double to_world[16];
  /**
   * The temperature grid. NULL or "": found by its name, see docs/grids.md. "none": not read. Any other value names a
   * grid, and it is an error if the file does not have it. A grid with other voxels than density's is resampled to
   * them.
   */
  const char* temperature_grid;
  const char* flame_grid; /**< The flame grid, with the rules of temperature_grid. */
  const char* color_grid; /**< The albedo color, a grid of vectors, with the rules of temperature_grid. */
  /**
   * Henyey-Greenstein g per voxel, -1 to 1, with the rules of temperature_grid. If the file has it, it replaces
   * cumulet_medium_desc.anisotropy (of two lobes, that of the first one). The Mie phase function ignores it. A cell has
   * the mean weighted by scattering, clamped to 0.999 in magnitude. Where the grid has no values, g is 0.
   */
  const char* anisotropy_grid;
  /**
   * 1: cumulet_load_volume_file and sequences set density_scale of the medium to the value of
   * cumulet_volume_suggest_density_scale, when the volume is first shown, and build the grid for it. Cells are built
   * for a density scale (cumulet_grid_desc), so this avoids the second build that a later cumulet_set_medium may cause.
   * Until then, a density_scale set by cumulet_set_medium has no effect.
   *
   * 0: density_scale is not changed. It is also not changed for a volume that shows nothing, and by
   * cumulet_volume_open_file.
   */
  int32_t suggested_density_scale;
  /**
   * Velocity in world units per second: a grid of vectors, or three scalar grids whose names end in x, y and z after
   * this name. to_world rotates and scales it. It is used for CUMULET_AOV_VELOCITY, motion vectors, motion blur and
   * CUMULET_FRAME_INTERPOLATION_ADVECT. "none" saves the reading, up to 36 bytes per voxel of main memory, and 8 bytes
   * per cell of main memory and of GL memory.
   *
   * A grid that is named here must be valid. One that is found by its name is left out, with a warning, if it cannot be
   * read.
   */
  const char* velocity_grid;
  /**
   * Receives the notes and warnings of cumulet_volume_open_file, on the calling thread, before it returns. NULL: they
   * are dropped. Functions that load through a viewer log to the viewer's callback and ignore this one.
   */
  cumulet_log_fn log;
  void* log_user;
} cumulet_volume_file_desc;

/**
 * Reads the grids that a descriptor names from a .vdb or .nvdb file.
 *
 * Threads: any thread; returns when the file is read. No GL.
 *
 * @param desc       The file, its grids and its transform.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or for a transform that is not affine, is
 *         singular or has entries (or inverse entries) above 1e15; or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_volume_open_file(const cumulet_volume_file_desc* desc, cumulet_volume** out,
                                                    char* error, size_t error_size);

/**
 * Reads a part of a host's stream.
 *
 * Threads: called on any thread, one call at a time, until the function that received the stream returns. Must not call
 * the library.
 *
 * @param user     cumulet_stream_desc.read_user.
 * @param position Position of the first byte, less than cumulet_stream_desc.size. Positions do not only increase.
 * @param bytes    Receives the bytes.
 * @param size     Bytes to read; position + size is at most cumulet_stream_desc.size.
 * @return Bytes read. A number other than size is an error, and ends the load.
 */
typedef uint64_t (*cumulet_read_fn)(void* user, uint64_t position, void* bytes, uint64_t size);

/** The content of a file that only the host can read, for example an entry of a pak file. */
typedef struct cumulet_stream_desc {
  size_t struct_size;
  uint64_t size; /**< Bytes of the content. */
  cumulet_read_fn read;
  void* read_user; /**< First argument of read. */
} cumulet_stream_desc;

/**
 * Reads the bytes of a .vdb or .nvdb file, which are recognized by their content.
 *
 * Threads: any thread; returns when all is read. No GL.
 *
 * @param bytes      The file's content; not used after the call returns.
 * @param size       Bytes at bytes.
 * @param desc       The grids and the transform. The file at path is not read: messages use path as the name of the
 *                   bytes. Without a path they use "memory". NULL: all fields have their defaults.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for a transform as in cumulet_volume_open_file; or
 *         CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_volume_from_memory(const void* bytes, size_t size,
                                                      const cumulet_volume_file_desc* desc, cumulet_volume** out,
                                                      char* error, size_t error_size);

/**
 * Reads a .vdb or .nvdb file through a callback. Only the parts with the chosen grids are read.
 *
 * Threads: any thread; returns when all is read. No GL.
 *
 * @param stream     The file's content.
 * @param desc       The grids and the transform, as in cumulet_volume_from_memory. Without a path, messages use
 *                   "stream". NULL: all fields have their defaults.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for a transform as in cumulet_volume_open_file; or
 *         CUMULET_ERROR_FILE, also if the stream fails.
 */
CUMULET_API cumulet_status cumulet_volume_from_stream(const cumulet_stream_desc* stream,
                                                      const cumulet_volume_file_desc* desc, cumulet_volume** out,
                                                      char* error, size_t error_size);

/** Voxels in a dense box. Active voxels are those that are not zero. */
typedef struct cumulet_dense_desc {
  size_t struct_size;
  const float* values;       /**< x fastest, then y, then z. */
  uint64_t value_count;      /**< size[0] x size[1] x size[2]. */
  int32_t size[3];           /**< Voxels along x, y and z. */
  double index_to_world[16]; /**< Affine. Voxel (i, j, k) is the unit cube centered on (i, j, k). All zero: identity. */
  const char* name;          /**< Name in messages. NULL: "dense". */
} cumulet_dense_desc;

/**
 * Creates a volume from a dense box of densities, which is copied.
 *
 * Threads: any thread; returns when the voxels are copied. No GL.
 *
 * @param desc       The voxels.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for a size that is not positive or does not agree with
 *         value_count; or CUMULET_ERROR_FILE for an unsuitable matrix or too large a box.
 */
CUMULET_API cumulet_status cumulet_volume_from_dense(const cumulet_dense_desc* desc, cumulet_volume** out, char* error,
                                                     size_t error_size);

/** A box of voxels that have one value. */
typedef struct cumulet_tile {
  int32_t min[3]; /**< Lowest voxel. */
  int32_t max[3]; /**< Highest voxel, inclusive. */
  float value;
  int32_t active; /**< 0 or 1. */
} cumulet_tile;

/** A sparse grid as in OpenVDB: bricks of 8^3 voxels, and tiles. cumulet_openvdb.hpp makes it from an OpenVDB grid. */
typedef struct cumulet_sparse_desc {
  size_t struct_size;
  const int32_t* brick_origins; /**< 3 per brick: its lowest voxel, in multiples of 8. No two bricks are equal. */
  const float* brick_values;    /**< 512 per brick: z fastest, then y, then x. */
  const uint64_t* brick_active; /**< 8 words per brick: word x, bit y x 8 + z. NULL: all voxels are active. */
  uint64_t brick_count;
  const cumulet_tile* tiles; /**< Tiles must not overlap each other or bricks. */
  uint64_t tile_count;
  float background;          /**< The value of voxels in no brick and no tile. */
  double index_to_world[16]; /**< Affine. Voxel (i, j, k) is the unit cube centered on (i, j, k). All zero: identity. */
  const char* name;          /**< Name in messages. NULL: "sparse". */
} cumulet_sparse_desc;

/**
 * Creates a volume from a sparse grid of densities, which is copied.
 *
 * Threads: any thread; returns when the voxels are copied. No GL.
 *
 * @param desc       The bricks and tiles.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_FILE for an unsuitable matrix and for bricks or
 *         tiles that are misplaced or overlap.
 */
CUMULET_API cumulet_status cumulet_volume_from_sparse(const cumulet_sparse_desc* desc, cumulet_volume** out,
                                                      char* error, size_t error_size);

/**
 * The quantity in the voxels of a field. Red, green and blue must be given together or not at all, and so must the
 * three components of a velocity.
 */
typedef enum cumulet_channel {
  CUMULET_CHANNEL_DENSITY = 0,
  CUMULET_CHANNEL_TEMPERATURE = 1, /**< In the unit that cumulet_medium_desc.temperature_scale converts to kelvin. */
  CUMULET_CHANNEL_FLAME = 2,       /**< Emission, see cumulet_medium_desc.flame_strength. */
  CUMULET_CHANNEL_RED = 3,         /**< Albedo color, linear Rec. 709. */
  CUMULET_CHANNEL_GREEN = 4,
  CUMULET_CHANNEL_BLUE = 5,
  CUMULET_CHANNEL_ANISOTROPY = 6, /**< Henyey-Greenstein g, -1 to 1; see cumulet_volume_file_desc.anisotropy_grid. */
  CUMULET_CHANNEL_VELOCITY_X = 7, /**< World units per second along the world's axes. */
  CUMULET_CHANNEL_VELOCITY_Y = 8,
  CUMULET_CHANNEL_VELOCITY_Z = 9
} cumulet_channel;

/** The voxels of one channel. Exactly one of dense and sparse is set; its desc's name is not used. */
typedef struct cumulet_field {
  size_t struct_size; /**< Equal for all fields of an array: the distance between them in bytes. */
  cumulet_channel channel;
  const cumulet_dense_desc* dense;   /**< NULL if sparse is set. */
  const cumulet_sparse_desc* sparse; /**< NULL if dense is set. cumulet_openvdb.hpp makes it from an OpenVDB grid. */
} cumulet_field;

/**
 * Gives memory back to the host. Called on any thread; must not call the library, except to retain and release handles.
 *
 * @param user cumulet_volume_fields_desc.release_user.
 */
typedef void (*cumulet_release_fn)(void* user);

/**
 * All fields of a simulation at one time: any of the channels, each at most once, in any order, with at least one of
 * density, temperature and flame. A field with other voxels than density's is resampled to them, as described in
 * docs/grids.md. Hosts that submit many states should give all fields the same size and index_to_world.
 */
typedef struct cumulet_volume_fields_desc {
  size_t struct_size;
  const cumulet_field* fields;
  uint64_t field_count;
  const char* name; /**< Name in messages. NULL: "state". */
  /**
   * NULL: the call copies the voxels. Otherwise they are read later, in place, and must not change until the library
   * calls this function with release_user. It is called once, possibly within the call, when the voxels were read or
   * are no longer needed. It is not called if the call fails. Only cumulet_dynamic_volume_set accepts it, and
   * cumulet_dynamic_volume_update cannot follow.
   */
  cumulet_release_fn release;
  void* release_user;
} cumulet_volume_fields_desc;

/**
 * Creates a volume with several channels, which are copied.
 *
 * Threads: any thread; returns when the voxels are copied. No GL.
 *
 * @param desc       The fields; release must be NULL.
 * @param out        Receives the volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for channels that occur twice or are incomplete, for counts that
 *         do not agree, and for a release; or CUMULET_ERROR_FILE for unsuitable matrices, bricks or tiles.
 */
CUMULET_API cumulet_status cumulet_volume_from_fields(const cumulet_volume_fields_desc* desc, cumulet_volume** out,
                                                      char* error, size_t error_size);

/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param volume May be NULL.
 * @return volume.
 */
CUMULET_API cumulet_volume* cumulet_volume_retain(cumulet_volume* volume);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param volume May be NULL.
 */
CUMULET_API void cumulet_volume_release(cumulet_volume* volume);

/** Properties of a volume: of its density, or of its main field if it has no density. */
typedef struct cumulet_volume_info {
  size_t struct_size;
  char name[128];
  uint64_t active_voxels; /**< 0: the volume is empty and shows nothing. */
  double bounds_min[3];   /**< World-space bounding box. */
  double bounds_max[3];
  float max_value;
  uint64_t negative_voxels;   /**< Voxels that count as 0 because they are negative. */
  uint64_t non_finite_voxels; /**< Voxels that count as 0 because they are not finite. */
  uint64_t huge_voxels;       /**< Finite voxels beyond 1e30 or -1e30, which count as 0. */
  double temperature_scale;   /**< Kelvin per unit of its temperature, used by a medium whose temperature_scale is 0.
                                   0: the volume has no temperature. */
} cumulet_volume_info;

/**
 * Returns properties of a volume.
 *
 * Threads: any thread. No GL.
 *
 * @param volume The volume.
 * @param info   Receives the properties; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_volume_get_info(const cumulet_volume* volume, cumulet_volume_info* info);

/**
 * Suggests a density scale (cumulet_medium_desc) with which the volume looks solid, neither faint nor opaque. Its mean
 * optical depth is then 8, over rays from all directions through the visibly occupied part. Haze and a few extreme
 * voxels have little influence. The value depends only on the volume, not on the camera. For a sequence, call it once,
 * for a frame that is not empty. Takes some milliseconds.
 *
 * Threads: any thread. No GL.
 *
 * @param volume The volume.
 * @param scale  Receives the density scale, per world unit of the volume's own space; unchanged on failure.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for a volume without visible density.
 */
CUMULET_API cumulet_status cumulet_volume_suggest_density_scale(const cumulet_volume* volume, double* scale);

/**
 * Receives one grid of a file.
 *
 * @param user    The argument of cumulet_list_grids.
 * @param name    The grid's name, "name[1]" if the file repeats one.
 * @param type    Its value type as in the file.
 * @param unsupported_reason "" if the grid can be shown, otherwise the reason why not.
 */
typedef void (*cumulet_grid_fn)(void* user, const char* name, const char* type, const char* unsupported_reason);
/**
 * Calls fn for each grid of a .vdb or .nvdb file, on the calling thread, without reading voxels.
 *
 * Threads: any thread. No GL.
 *
 * @param path       UTF-8 path of the file.
 * @param fn         Receives the grids; their texts are valid until it returns.
 * @param user       First argument of fn.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_list_grids(const char* path, cumulet_grid_fn fn, void* user, char* error,
                                              size_t error_size);

/**
 * The contents of a volume file, for a dialog in which a person chooses a grid. Texts in its structs are valid until it
 * is released. Ended by cumulet_inspection_release.
 */
typedef struct cumulet_inspection cumulet_inspection;

/**
 * Reads the directory of a .vdb or .nvdb file.
 *
 * Threads: any thread. No GL.
 *
 * @param path       UTF-8 path of the file.
 * @param out        Receives the inspection, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_inspect_volume_file(const char* path, cumulet_inspection** out, char* error,
                                                       size_t error_size);
/**
 * Frees an inspection and its texts. Threads: any thread, also inside callbacks.
 *
 * @param inspection May be NULL.
 */
CUMULET_API void cumulet_inspection_release(cumulet_inspection* inspection);

/** Properties of a volume file. */
typedef struct cumulet_volume_file_info {
  size_t struct_size;
  const char* format; /**< For example "OpenVDB 225" or "NanoVDB 32.9". */
  uint64_t bytes;     /**< Size of the file. */
  uint32_t grid_count;
  uint32_t metadata_count; /**< Metadata entries of the whole file. */
  int32_t default_grid;    /**< The grid that is read if none is named. -1: no grid can be shown. */
} cumulet_volume_file_info;

/**
 * Returns properties of the file.
 *
 * Threads: any thread. No GL.
 *
 * @param inspection The inspection.
 * @param info       Receives the properties; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_inspection_get_file(const cumulet_inspection* inspection,
                                                       cumulet_volume_file_info* info);

/** Number of bins in a histogram. */
enum { CUMULET_HISTOGRAM_BINS = 64 };

/** The values that the statistics of a cumulet_grid_info are about. */
typedef enum cumulet_grid_values {
  CUMULET_GRID_VALUES_NONE = 0,      /**< Voxels of a type that is not read, or damaged: the statistics are 0. */
  CUMULET_GRID_VALUES_SCALARS = 1,   /**< Scalars. */
  CUMULET_GRID_VALUES_MAGNITUDES = 2 /**< Magnitudes of vectors. */
} cumulet_grid_values;

/** Properties of one grid of a file. The fields after `values`, except `channel`, need the grid's voxels. */
typedef struct cumulet_grid_info {
  size_t struct_size;
  const char* name;               /**< "name[1]" if the file repeats one. */
  const char* type;               /**< As in the file: "float", "half", "vec3s", ... */
  const char* grid_class;         /**< "fog volume", "level set", "unknown", ... */
  const char* unsupported_reason; /**< "" if the grid can be shown, otherwise the reason why not. */
  uint32_t metadata_count;
  cumulet_grid_values values;
  double index_to_world[16]; /**< To the file's own world space. */
  uint64_t active_voxels;
  int32_t voxel_min[3]; /**< Bounding box of the active voxels, inclusive. */
  int32_t voxel_max[3];
  double bounds_min[3]; /**< The same bounding box in the file's own world space. */
  double bounds_max[3];
  float min_value; /**< Minimum of the finite active voxels. */
  float max_value;
  double mean_value;
  uint64_t negative_voxels;
  uint64_t non_finite_voxels;
  uint64_t memory_bytes; /**< Maximum main memory of a volume of this grid. */
  /** Counts of the finite active voxels, in equal steps from min_value to max_value. */
  uint64_t histogram[CUMULET_HISTOGRAM_BINS];
  /**
   * The field that the grid is read as because of its name: "density", "temperature", "flame", "color", "anisotropy",
   * "velocity", or "" for none.
   */
  const char* channel;
} cumulet_grid_info;

/**
 * Returns properties of one grid. The first call for a grid reads its voxels, which takes seconds for a large one.
 *
 * Threads: any thread. No GL.
 *
 * @param inspection The inspection.
 * @param grid       The grid, from 0.
 * @param info       Receives the properties; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no such grid.
 */
CUMULET_API cumulet_status cumulet_inspection_get_grid(cumulet_inspection* inspection, uint32_t grid,
                                                       cumulet_grid_info* info);

/** A metadata entry, as text of at most 4096 bytes in the encoding of the file. */
typedef struct cumulet_metadata {
  size_t struct_size;
  const char* name;
  const char* type; /**< "string", "bool", "vec3i", ... */
  const char* value;
} cumulet_metadata;

/**
 * Returns one metadata entry.
 *
 * Threads: any thread. No GL.
 *
 * @param inspection The inspection.
 * @param grid       The grid, from 0; -1: the whole file.
 * @param index      The entry, from 0.
 * @param out        Receives the entry; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no such grid or entry.
 */
CUMULET_API cumulet_status cumulet_inspection_get_metadata(const cumulet_inspection* inspection, int32_t grid,
                                                           uint32_t index, cumulet_metadata* out);

/** @} */

/* ---- Sequences --------------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_sequences Sequences
 *
 * A cumulet_sequence is a list of volume files, one per frame, with a playback position. It is reference-counted and
 * independent of GL. Any number of viewers may show it (cumulet_set_sequence), all at the same position. The host sets
 * the position, by time or by frame. A viewer calls its update callback if that changes the frame that it shows. Frames
 * count from 0. docs/howto/sequences.md has the steps.
 * @{
 */

/** The files of a sequence. */
typedef struct cumulet_sequence_desc {
  size_t struct_size;
  const char* const* paths; /**< One UTF-8 path of a volume per frame. Files need not exist or be valid. */
  uint64_t count;           /**< Frames, 1 to 1,000,000. */
  /**
   * The grids that are read from each file, and the transform; its path is not used. With suggested_density_scale, one
   * density scale is suggested for all frames. NULL: grids are found by name, and the transform is the identity.
   */
  const cumulet_volume_file_desc* file;
  /**
   * Main memory for ready frames, in each viewer that shows the sequence. It holds cells and, as long as there is room,
   * voxels, so that a change of settings need not read files again. The frames that are needed last are freed first.
   * The displayed frame, and frames that are being read and built, are not counted. 0: 2 GiB.
   */
  uint64_t memory_bytes;
} cumulet_sequence_desc;

/**
 * Creates a sequence, which is at frame 0. It reads no files.
 *
 * Threads: any thread. No GL.
 *
 * @param desc       The files.
 * @param out        Receives the sequence, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an empty path or an unsuitable transform.
 */
CUMULET_API cumulet_status cumulet_sequence_create(const cumulet_sequence_desc* desc, cumulet_sequence** out,
                                                   char* error, size_t error_size);
/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param sequence May be NULL.
 * @return sequence.
 */
CUMULET_API cumulet_sequence* cumulet_sequence_retain(cumulet_sequence* sequence);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param sequence May be NULL.
 */
CUMULET_API void cumulet_sequence_release(cumulet_sequence* sequence);

/** The frames before the first played frame and after the last one. */
typedef enum cumulet_repeat {
  CUMULET_REPEAT_HOLD = 0,     /**< The first or last frame stays. */
  CUMULET_REPEAT_LOOP = 1,     /**< Playback starts again at the first frame. */
  CUMULET_REPEAT_PING_PONG = 2 /**< Playback reverses at each end; neither end frame is repeated. */
} cumulet_repeat;

/**
 * Frame interpolation: the volume at positions between two frames. Interpolated volumes are built like frames, on the
 * same worker and within the same memory. If one cannot be made because one of the two files cannot be read, the frame
 * before it is shown.
 */
typedef enum cumulet_frame_interpolation {
  CUMULET_FRAME_INTERPOLATION_NONE = 0, /**< No interpolation: the frame before the position is shown. */
  /** Weighted mean of both frames, field by field. Color, anisotropy and velocity are weighted by density, too. */
  CUMULET_FRAME_INTERPOLATION_BLEND = 1,
  /**
   * Both frames are advected to the position along their own velocities (semi-Lagrangian, midpoint rule), one forward
   * and one backward, and then blended. Smoke then moves, where blending would fade it from one place to another. The
   * velocities are the files' own (docs/grids.md), in world units per second. If one of the frames has none, the frames
   * are only blended.
   */
  CUMULET_FRAME_INTERPOLATION_ADVECT = 2
} cumulet_frame_interpolation;

/** How time maps to frames. */
typedef struct cumulet_playback_desc {
  size_t struct_size;
  double frames_per_second; /**< Up to 1e6; 0: 24. */
  double offset_seconds;    /**< Time of first_frame in seconds, -1e9 to 1e9. */
  cumulet_repeat repeat;
  uint32_t first_frame; /**< First frame that is played. */
  uint32_t frame_count; /**< Number of frames that are played; 0: all from first_frame on. */
  cumulet_frame_interpolation interpolation;
  /**
   * Positions per frame at which an interpolated volume is made, including the frame itself. Each is shown until the
   * next one, so that built volumes can be reused. 1 to 1000, and at most 1,000,000 in the whole sequence; 0: 4. Not
   * used with CUMULET_FRAME_INTERPOLATION_NONE.
   */
  uint32_t subframes;
  /**
   * Factor for velocities, -1e6 to 1e6; 0: 1. The time between two frames is 1 / frames_per_second. A simulation of 24
   * frames per second with velocities in units per second, played at 12, needs 0.5. Velocities in units per frame need
   * frames_per_second.
   */
  double velocity_scale;
} cumulet_playback_desc;

/**
 * Sets how time maps to frames, from the next cumulet_sequence_set_time on. The position does not change.
 *
 * Threads: any thread. No GL.
 *
 * @param sequence The sequence.
 * @param desc     The playback settings.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for frames that the sequence does not have; nothing changes
 *         then.
 */
CUMULET_API cumulet_status cumulet_sequence_set_playback(cumulet_sequence* sequence, const cumulet_playback_desc* desc);
/**
 * Moves the sequence to a time. The direction of time between the last two of these calls decides which frames are read
 * ahead.
 *
 * Threads: any thread; runs update callbacks of viewers that show the sequence. No GL.
 *
 * @param sequence The sequence.
 * @param seconds  The time, -1e9 to 1e9.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_sequence_set_time(cumulet_sequence* sequence, double seconds);
/**
 * Moves the sequence to a frame, whether the playback settings play it or not. At 2.25, frame 2 is shown, or with
 * interpolation the volume a quarter of the way to frame 3. Between the last frame of a loop and its first one, the
 * last frame is shown.
 *
 * Threads: any thread; runs update callbacks of viewers that show the sequence. No GL.
 *
 * @param sequence The sequence.
 * @param frame    The position, 0 to count - 1.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_sequence_set_frame(cumulet_sequence* sequence, double frame);
/**
 * Returns the frame to which cumulet_sequence_set_time would move, without moving.
 *
 * Threads: any thread. No GL.
 *
 * @param sequence The sequence.
 * @param seconds  The time, -1e9 to 1e9.
 * @param frame    Receives the frame.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_sequence_get_frame_at(const cumulet_sequence* sequence, double seconds,
                                                         uint32_t* frame);
/**
 * Inverse of cumulet_sequence_get_frame_at. Returns the first time at or after offset_seconds at which a frame is
 * played. If the playback settings do not play the frame, it returns the time that it would have if they did.
 *
 * Threads: any thread. No GL.
 *
 * @param sequence The sequence.
 * @param frame    The frame, 0 to count - 1.
 * @param seconds  Receives the time.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_sequence_get_time_of(const cumulet_sequence* sequence, uint32_t frame,
                                                        double* seconds);

/** @} */

/* ---- Dynamic volumes --------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_dynamic_volumes Dynamic volumes
 *
 * A cumulet_dynamic_volume is a volume of changing content: the host submits one state after another as its simulation
 * steps, and viewers that show it (cumulet_set_dynamic_volume, cumulet_instance_desc.dynamic_volume) display the newest
 * one. It is reference-counted and independent of GL, and any number of viewers may show it. Because cumulet_volume
 * objects are immutable, each state becomes a new one behind this handle.
 *
 * - No call of this group waits for a build. A call copies the voxels and returns, or does not copy them (see
 *   cumulet_volume_fields_desc.release).
 * - A state whose build has not begun is dropped when the next one is submitted: at every rate, at most one is being
 *   built and one is queued.
 * - States are numbered from 1, and each call of cumulet_dynamic_volume_set, cumulet_dynamic_volume_update or
 *   cumulet_dynamic_volume_set_gl makes one.
 * - cumulet_dynamic_volume_set_gl takes voxels from OpenGL textures or buffers.
 *
 * docs/howto/dynamic_volumes.md has the steps.
 * @{
 */

/** How a dynamic volume is created. */
typedef struct cumulet_dynamic_volume_desc {
  size_t struct_size;
  /**
   * World-space bounding box of everything that the simulation will ever fill, each number within 1e15. Camera fitting,
   * a ground below and cumulet_get_bounds use it, so that they do not jump between states. Both zero: the bounds of the
   * displayed state are used.
   */
  double bounds_min[3];
  double bounds_max[3];
  /**
   * 1: voxels of cumulet_dynamic_volume_set_gl stay in GL memory, and the grid is built there. Main memory gets only
   * half a kilobyte of statistics per brick of 8^3 voxels and field. 0: the voxels are copied to main memory.
   * docs/howto/dynamic_volumes.md lists the features that end this.
   */
  int32_t gpu_resident;
} cumulet_dynamic_volume_desc;

/**
 * Creates a dynamic volume without a state.
 *
 * Threads: any thread. No GL.
 *
 * @param desc       Bounds and residency.
 * @param out        Receives the dynamic volume, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if bounds_min is not below bounds_max on each axis.
 */
CUMULET_API cumulet_status cumulet_dynamic_volume_create(const cumulet_dynamic_volume_desc* desc,
                                                         cumulet_dynamic_volume** out, char* error, size_t error_size);
/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param volume May be NULL.
 * @return volume.
 */
CUMULET_API cumulet_dynamic_volume* cumulet_dynamic_volume_retain(cumulet_dynamic_volume* volume);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param volume May be NULL.
 */
CUMULET_API void cumulet_dynamic_volume_release(cumulet_dynamic_volume* volume);

/**
 * Submits a complete state, with any channels and sizes. Fields that it does not have are gone. The result is the same
 * grid, bit for bit, and with the same samples the same image, as of a cumulet_volume with the same fields.
 *
 * Negative values count as 0, except in anisotropy and velocity. If the state is refused, the previous one stays and
 * another may be submitted. With cumulet_volume_fields_desc.release the values are checked later, when they are read.
 * Then a warning in the log, cumulet_get_progress and CUMULET_RENDER_FAILED report a refused state.
 *
 * Threads: any thread; runs update callbacks of viewers that show the dynamic volume. No GL.
 *
 * @param volume     The dynamic volume.
 * @param desc       The fields.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for channels that occur twice or are incomplete, and for counts
 *         that do not agree; or CUMULET_ERROR_FILE for a value that is not finite (the line names state, channel and
 *         voxel), and for unsuitable matrices, bricks or tiles.
 */
CUMULET_API cumulet_status cumulet_dynamic_volume_set(cumulet_dynamic_volume* volume,
                                                      const cumulet_volume_fields_desc* desc, char* error,
                                                      size_t error_size);
/**
 * Submits a state that is the last submitted one with some bricks replaced. The result is the same, bit for bit, as if
 * the complete state had been submitted.
 *
 * - Fields must be sparse. Only brick_origins, brick_values and brick_active are used.
 * - A brick replaces the existing one or is added. To empty a brick, give zeros and no active voxels; it still takes
 *   2 KiB.
 * - The bricks of a dense field begin at voxel 0. Fields and bricks that are not given stay.
 * - A channel without changes may be left out, or be given with no bricks.
 *
 * Threads: any thread; runs update callbacks of viewers that show the dynamic volume. No GL.
 *
 * @param volume     The dynamic volume.
 * @param desc       The changed bricks; release must be NULL.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_FILE for a value that is not finite or a misplaced brick; or
 *         CUMULET_ERROR_INVALID_ARGUMENT
 *         - before the first cumulet_dynamic_volume_set, and after a state that was refused when it was read
 *         - for a dense field, and for a channel that the state does not have, or has with tiles
 *         - after a state that was submitted with release (the library keeps no voxels of it) or stays in GL
 *         - if another call submits a state at the same time
 */
CUMULET_API cumulet_status cumulet_dynamic_volume_update(cumulet_dynamic_volume* volume,
                                                         const cumulet_volume_fields_desc* desc, char* error,
                                                         size_t error_size);
/**
 * Returns the newest state as a volume, for its properties and for instances. If no worker has read the state yet, this
 * call does, which takes as long as cumulet_volume_from_fields.
 *
 * Threads: any thread. No GL.
 *
 * @param volume     The dynamic volume.
 * @param out        Receives the volume, which the caller releases; NULL before the first state and on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT or CUMULET_ERROR_FILE for a state that is refused when it is read;
 *         or CUMULET_ERROR_UNSUPPORTED if its voxels are only in GL memory. In the last case the call requests a copy
 *         to main memory, and a later call returns it.
 */
CUMULET_API cumulet_status cumulet_dynamic_volume_get_volume(cumulet_dynamic_volume* volume, cumulet_volume** out,
                                                             char* error, size_t error_size);

/** @} */

/* ---- Surfaces ---------------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_surfaces_group Surfaces
 *
 * A cumulet_surfaces holds triangles with their materials, lights, cameras and animations in main memory. It is
 * immutable, reference-counted and independent of GL. Any number of viewers may show it, each at its own time of an
 * animation. World space and units are the volume's. The functions of this group that create surfaces do so before they
 * return; cumulet_load_surfaces does it on a worker.
 *
 * The library reads all of glTF 2.0's triangles, materials, skins, morph targets, animations and cameras, and these
 * extensions:
 *
 * - KHR_lights_punctual. Its candela and lux are read as watts per steradian and per square meter.
 * - KHR_materials_unlit, KHR_materials_emissive_strength, KHR_materials_ior, KHR_materials_specular,
 *   KHR_materials_clearcoat, KHR_materials_transmission, KHR_materials_dispersion, KHR_materials_sheen,
 *   KHR_materials_anisotropy, KHR_materials_iridescence, KHR_materials_variants
 * - KHR_materials_volume, which refracts and absorbs inside closed meshes, nested at most two deep. A thickness of 0 is
 *   a thin wall; light passes straight through it if it is smooth.
 * - KHR_materials_pbrSpecularGlossiness, converted to the metallic-roughness material that looks like it; textures are
 *   converted when they are read.
 * - KHR_texture_transform, KHR_mesh_quantization, KHR_draco_mesh_compression, EXT_meshopt_compression,
 *   EXT_texture_webp
 * - KHR_node_visibility. Hidden nodes are neither rendered nor counted.
 * - KHR_animation_pointer for transforms, weights and visibility of nodes, factors and texture transforms of materials,
 *   and lights. A warning names other animated properties.
 * - EXT_mesh_gpu_instancing. Each mesh is in memory once, with any number of instances; flat ones are not
 *   drawn.
 *
 * Emissive triangles are lights, only on their front if the material is single-sided. Surfaces of alphaMode BLEND cover
 * with a probability, ray by ray, so that no sorting is needed. In previews, before the first samples, and where
 * surfaces are rasterized, volumes are walls of their thickness, without refraction and with one color; anisotropic
 * lobes are round, and sheen and iridescent films are left out.
 * @{
 */

/**
 * Reads a .gltf or .glb file, and the files that it refers to.
 *
 * Threads: any thread; returns when the files are read. No GL.
 *
 * @param path       UTF-8 path of the file.
 * @param out        Receives the surfaces, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_surfaces_open(const char* path, cumulet_surfaces** out, char* error,
                                                 size_t error_size);

/**
 * Reads the bytes of a .gltf or .glb file, which are recognized by their content.
 *
 * Threads: any thread; returns when all is read. No GL.
 *
 * @param bytes          The file's content; not used after the call returns.
 * @param size           Bytes at bytes.
 * @param base_directory UTF-8 path of the folder with the files that it refers to. NULL: such references are errors.
 * @param name           Used in messages in place of the path. NULL: "memory".
 * @param out            Receives the surfaces, which the caller releases; NULL on failure.
 * @param error          Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size     Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_surfaces_from_memory(const void* bytes, size_t size, const char* base_directory,
                                                        const char* name, cumulet_surfaces** out, char* error,
                                                        size_t error_size);

/** Triangles of one material (glTF's metallic-roughness model). */
typedef struct cumulet_mesh_desc {
  size_t struct_size;     /**< Equal for all meshes of an array: the distance between them in bytes. */
  const float* positions; /**< 3 per vertex. Keep them near 0: an offset that is much larger than the mesh belongs in
                               to_world. */
  const float* normals;   /**< 3 per vertex, of any length. NULL: flat, each triangle's own. */
  const float* colors;    /**< 4 per vertex, each in [0, 1], linear, times base_color. NULL: white. */
  uint64_t vertex_count;
  const uint32_t* indices; /**< 3 per triangle, counterclockwise as seen from its front. */
  uint64_t index_count;    /**< 0: every three vertices are a triangle. */
  double to_world[16];     /**< Affine. All zero: identity. */
  float base_color[4];     /**< Each in [0, 1], linear. Alpha is the coverage. All zero: opaque white. */
  float metallic;          /**< 0 to 1. */
  float smoothness;        /**< 1 - roughness, 0 to 1. */
  float emission[3];       /**< Radiance of the front, 0 to 1e30. */
  int32_t double_sided;    /**< 0: the camera sees through it from behind. 1: both sides are fronts. */
  /**
   * 3 per vertex, in units of the mesh's own space per second, for motion blur (cumulet_sampling_desc.shutter_seconds).
   * While the shutter is open, each vertex moves straight with this velocity, and is at its position at the frame time.
   * Given normals do not change. NULL: the mesh does not move.
   */
  const float* velocities;
} cumulet_mesh_desc;

/** The host's own meshes. */
typedef struct cumulet_triangles_desc {
  size_t struct_size;
  const cumulet_mesh_desc* meshes;
  uint64_t mesh_count;
  const char* name; /**< Name in messages. NULL: "triangles". */
} cumulet_triangles_desc;

/**
 * Creates surfaces from the host's own meshes, which are copied. To animate, create new surfaces for every frame;
 * cumulet_mesh_desc.velocities adds motion blur.
 *
 * Threads: any thread; returns when the meshes are copied. No GL.
 *
 * @param desc       The meshes.
 * @param out        Receives the surfaces, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for unsuitable meshes; the line names the mesh.
 */
CUMULET_API cumulet_status cumulet_surfaces_from_triangles(const cumulet_triangles_desc* desc, cumulet_surfaces** out,
                                                           char* error, size_t error_size);

/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param surfaces May be NULL.
 * @return surfaces.
 */
CUMULET_API cumulet_surfaces* cumulet_surfaces_retain(cumulet_surfaces* surfaces);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param surfaces May be NULL.
 */
CUMULET_API void cumulet_surfaces_release(cumulet_surfaces* surfaces);

/** Properties of surfaces. */
typedef struct cumulet_surfaces_info {
  size_t struct_size;
  char name[128];     /**< The path, or the host's name. */
  uint64_t triangles; /**< Rendered triangles: a mesh of two nodes or instances counts twice. */
  uint32_t materials; /**< In the file, used or not; so are meshes, primitives and textures. */
  uint32_t lights;    /**< Lights of visible nodes. */
  uint32_t cameras;   /**< Cameras of visible nodes. */
  uint32_t animations;
  double bounds_min[3]; /**< World-space bounding box without animation. Zero without triangles. */
  double bounds_max[3];
  uint32_t meshes;
  uint32_t primitives; /**< Parts of meshes, each of one material. */
  uint32_t textures;
  uint32_t variants; /**< Material variants; see cumulet_surface_settings_desc.variant. */
  /**
   * Warnings of cumulet_surfaces_open and cumulet_surfaces_from_memory, such as missing textures: one per line, as many
   * as fit. Surfaces that a viewer loads log their warnings instead.
   */
  char warnings[512];
} cumulet_surfaces_info;

/**
 * Returns properties of surfaces. The first call poses them, which takes as long as posing on a worker does.
 *
 * Threads: any thread. No GL.
 *
 * @param surfaces The surfaces.
 * @param info     Receives the properties; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_surfaces_get_info(const cumulet_surfaces* surfaces, cumulet_surfaces_info* info);

/** An animation of a file. */
typedef struct cumulet_animation_info {
  size_t struct_size;
  char name[128];  /**< "" if it has none. */
  double duration; /**< Seconds. */
} cumulet_animation_info;

/**
 * Returns one animation.
 *
 * Threads: any thread. No GL.
 *
 * @param surfaces The surfaces.
 * @param index    The animation, from 0.
 * @param info     Receives it; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no such animation.
 */
CUMULET_API cumulet_status cumulet_surfaces_get_animation(const cumulet_surfaces* surfaces, uint32_t index,
                                                          cumulet_animation_info* info);

/** A material variant of a file (KHR_materials_variants). */
typedef struct cumulet_variant_info {
  size_t struct_size;
  char name[128]; /**< "" if it has none. */
} cumulet_variant_info;

/**
 * Returns one material variant (KHR_materials_variants).
 *
 * Threads: any thread. No GL.
 *
 * @param surfaces The surfaces.
 * @param index    The variant, from 0.
 * @param info     Receives it; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no such variant.
 */
CUMULET_API cumulet_status cumulet_surfaces_get_variant(const cumulet_surfaces* surfaces, uint32_t index,
                                                        cumulet_variant_info* info);

/** @} */

/* ---- Environments ------------------------------------------------------------------------------------------------ */

/**
 * @defgroup cumulet_environments Environments
 *
 * A cumulet_environment is an environment map (HDRI): an equirectangular image of everything far away, used as a light
 * and as the background. It is immutable, reference-counted and independent of GL, and any number of viewers may use
 * it.
 *
 * - Rows go from +Y, at the upper edge, down to -Y. The middle column is at +Z, and +X is a quarter of the width left
 *   of it.
 * - Values are linear Rec. 709 radiance, interpolated bilinearly between pixel centers.
 * - Pixel values that are not finite, negative or above 1e30 count as 0. cumulet_environment_get_info counts them, and
 *   cumulet_set_environment logs a warning.
 * - It takes 16 bytes per pixel of main memory, and as many of GL memory.
 * - The functions of this group that create an environment do so before they return, in some 0.2 s for 2048 x 1024
 *   pixels. cumulet_load_environment does it on a worker.
 * @{
 */

/**
 * Reads a Radiance (.hdr) or OpenEXR (.exr) file, of up to 16384 pixels per side, which is recognized by its content.
 *
 * - OpenEXR: one flat part is read, with channels R, G and B, or Y with or without RY and BY, or X, Y and Z. Channels
 *   without a layer are preferred. The data window is placed in the display window. Cube maps (envmap) of up to 4096
 *   pixels per face are resampled. Chromaticities are converted to Rec. 709.
 * - Radiance: orientation, EXPOSURE, COLORCORR and PRIMARIES are applied.
 * - cumulet_set_environment logs a warning about parts that were chosen, converted, ignored or assumed.
 *
 * Threads: any thread; returns when the file is read. No GL.
 *
 * @param path       UTF-8 path of the file.
 * @param out        Receives the environment, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT for an empty path, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_environment_open(const char* path, cumulet_environment** out, char* error,
                                                    size_t error_size);

/**
 * Reads the bytes of a Radiance or OpenEXR file, as cumulet_environment_open reads a file.
 *
 * Threads: any thread; returns when it is ready. No GL.
 *
 * @param bytes      The file's content; not used after the call returns.
 * @param size       Bytes at bytes.
 * @param name       Used in messages in place of the path. NULL: "memory".
 * @param out        Receives the environment, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_FILE.
 */
CUMULET_API cumulet_status cumulet_environment_from_memory(const void* bytes, size_t size, const char* name,
                                                           cumulet_environment** out, char* error, size_t error_size);

/**
 * Reads a Radiance or OpenEXR file through a callback, in one call.
 *
 * Threads: any thread; returns when it is ready. No GL.
 *
 * @param stream     The file's content.
 * @param name       Used in messages in place of the path. NULL: "stream".
 * @param out        Receives the environment, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_FILE, also if the stream fails.
 */
CUMULET_API cumulet_status cumulet_environment_from_stream(const cumulet_stream_desc* stream, const char* name,
                                                           cumulet_environment** out, char* error, size_t error_size);

/** The host's own pixels. */
typedef struct cumulet_environment_desc {
  size_t struct_size;
  const float* values;  /**< 3 per pixel, first pixel top left. */
  uint64_t value_count; /**< 3 x width x height. */
  uint32_t width;       /**< 1 to 16384. */
  uint32_t height;      /**< 1 to 16384. */
  const char* name;     /**< Name in messages. NULL: "environment". */
} cumulet_environment_desc;

/**
 * Creates an environment from the host's own pixels, which are copied.
 *
 * Threads: any thread; returns when it is ready. No GL.
 *
 * @param desc       The pixels.
 * @param out        Receives the environment, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT if value_count is not 3 x width x height; or CUMULET_ERROR_FILE
 *         for a width or height out of range.
 */
CUMULET_API cumulet_status cumulet_environment_from_pixels(const cumulet_environment_desc* desc,
                                                           cumulet_environment** out, char* error, size_t error_size);

/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param environment May be NULL.
 * @return environment.
 */
CUMULET_API cumulet_environment* cumulet_environment_retain(cumulet_environment* environment);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param environment May be NULL.
 */
CUMULET_API void cumulet_environment_release(cumulet_environment* environment);

/** Properties of an environment. */
typedef struct cumulet_environment_info {
  size_t struct_size;
  char name[128]; /**< The path, or the host's name. */
  uint32_t width;
  uint32_t height;
  uint64_t replaced_pixels; /**< Pixels with values that count as 0. */
  double mean_radiance[3];  /**< Mean over all directions. */
} cumulet_environment_info;

/**
 * Returns properties of an environment.
 *
 * Threads: any thread. No GL.
 *
 * @param environment The environment.
 * @param info        Receives the properties; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_environment_get_info(const cumulet_environment* environment,
                                                        cumulet_environment_info* info);
/**
 * Returns the environment at another size, for a thumbnail. Each pixel is the mean of the environment's pixels in its
 * area. The call reads each pixel of the environment once: some 0.1 s for 8192 x 4096.
 *
 * Threads: any thread. No GL.
 *
 * @param environment The environment.
 * @param width       Pixels, 1 to 16384.
 * @param height      Pixels, 1 to 16384.
 * @param rgb         Receives 3 floats of radiance per pixel, first pixel top left.
 * @param count       Floats at rgb, at least 3 x width x height.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_environment_get_pixels(const cumulet_environment* environment, uint32_t width,
                                                          uint32_t height, float* rgb, uint64_t count);

/** @} */

/* ---- The content of a viewer, and the work behind it ------------------------------------------------------------- */

/**
 * @defgroup cumulet_content Content of a viewer
 *
 * Functions that load or set a volume, surfaces or an environment, and functions that report, limit and cancel the work
 * of the viewer's worker threads.
 * @{
 */

/**
 * Loads a volume file on the viewer's worker and builds its grid there. Returns at once. The previous volume stays
 * until the new one is ready, and for good if the load fails.
 *
 * A load cancels the running load or build, but not twice in a row: of a stream of files at least every second one is
 * displayed. While previews are on, a low-resolution proxy of a large .vdb file (50,000 bricks of 8^3 and more) is
 * displayed first. docs/howto/loading.md has the rules of loading and of the proxy.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer    The viewer.
 * @param path      UTF-8 path of a .vdb or .nvdb file.
 * @param grid_name The density grid, chosen as by cumulet_volume_open; NULL or "": by name.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an empty path. Failures of the load itself are reported
 *         later, see @ref cumulet_errors.
 */
CUMULET_API cumulet_status cumulet_load_volume(cumulet_viewer* viewer, const char* path, const char* grid_name);
/**
 * Loads the grids that a descriptor names from a volume file, on the viewer's worker, with the rules of
 * cumulet_load_volume.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The file, its grids and its transform.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an empty path or an unsuitable transform. Failures of the
 *         load itself are reported later, see @ref cumulet_errors.
 */
CUMULET_API cumulet_status cumulet_load_volume_file(cumulet_viewer* viewer, const cumulet_volume_file_desc* desc);
/**
 * Shows a volume: builds its grid on the worker, and displays it when it is ready. A running build is finished and
 * displayed first. A running load is cancelled. A sequence or dynamic volume is no longer shown.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param volume The volume, which is retained. NULL: no volume, at once.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT. Failures of the build are reported later, see
 *         @ref cumulet_errors.
 */
CUMULET_API cumulet_status cumulet_set_volume(cumulet_viewer* viewer, cumulet_volume* volume);
/**
 * Sets the instance transforms of the viewer's own volume, for the present and all later volumes. The volume is shown
 * once per transform. All share its grid and memory, and may overlap; extinctions add up.
 *
 * - Any invertible affine transform is allowed, including shear and reflection. Extinction and emission stay per world
 *   unit of the scene.
 * - Cost: a table of some 600 bytes per transform is uploaded (nothing for one transform), as cheap as moving the
 *   camera. If the scale changes the optical thickness by more than a factor of 2, the grid is rebuilt, as by
 *   cumulet_set_medium. A camera-adaptive grid is rebuilt when the transforms stop changing.
 * - If more than four volumes overlap at one point, images are correct, but results without samples (AOVs, picks, debug
 *   views, a denoiser's guides) may leave some of them out.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param to_world count matrices from the volume's own world space to the scene's. A matrix of zeros is the identity.
 * @param count    Number of matrices. 0, the default: one identity.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for a matrix that is not affine, is singular, or has entries
 *         (or inverse entries) above 1e15. cumulet_render returns CUMULET_ERROR_UNSUPPORTED for more transforms than
 *         the driver supports (at least 200,000), and for one that is 1e12 away from the others; then the previous
 *         transforms stay.
 */
CUMULET_API cumulet_status cumulet_set_volume_transforms(cumulet_viewer* viewer, const double* to_world,
                                                         uint32_t count);
/**
 * Sets the instance transforms at shutter open and shutter close, for motion blur
 * (cumulet_sampling_desc.shutter_seconds). Each point moves straight between them. They hold until
 * cumulet_set_volume_transforms is called.
 *
 * While an instance transform, an instance or a model moves, the tables of all of them take three times the memory, and
 * drivers support a third as many.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param open   count matrices at shutter open. NULL, or a matrix of zeros: the transform at the frame time.
 * @param close  count matrices at shutter close, with the same meaning of NULL and zeros.
 * @param count  Number of transforms of the volume. Not used if open and close are NULL.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for another count, for a matrix that
 *         cumulet_set_volume_transforms refuses, and for a motion that flattens the volume in between, such as a
 *         rotation by 180 degrees.
 */
CUMULET_API cumulet_status cumulet_set_volume_shutter_transforms(cumulet_viewer* viewer, const double* open,
                                                                 const double* close, uint32_t count);
/**
 * Shows a sequence in place of a volume, and follows its position. The previous content stays until a frame is ready.
 *
 * - Frames are read and built on a worker, ahead in the direction of playback, as many as fit memory_bytes.
 *   cumulet_render never waits for a frame; it shows the nearest frame that is ready.
 * - A file that cannot be read is skipped: the log has one warning, and a neighboring frame is shown instead.
 * - Camera fitting, a ground below, bounds and the suggested density scale are shared by all frames, so that they do
 *   not jump.
 * - cumulet_set_volume, cumulet_set_dynamic_volume and a successful cumulet_load_volume end the sequence.
 *
 * docs/howto/sequences.md has the rules of reading ahead, waiting, cancelling and failures.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param sequence The sequence, which is retained. NULL: no sequence; if one was shown, nothing is shown.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_sequence(cumulet_viewer* viewer, cumulet_sequence* sequence);

/** State of a sequence in one viewer. */
typedef struct cumulet_sequence_info {
  size_t struct_size;
  uint32_t frames;                /**< Frames of the sequence. */
  uint32_t ready_frames;          /**< Frames in main memory that are built for the present settings. */
  uint32_t failed_frames;         /**< Frames that are replaced by others, as far as known. */
  uint32_t requested_frame;       /**< Frame at the sequence's position. */
  uint32_t displayed_frame;       /**< Frame in the image that the last cumulet_render drew, if is_displayed. */
  int32_t is_displayed;           /**< 0: that image shows no frame of the sequence. */
  uint64_t bytes;                 /**< Main memory of the ready frames. */
  double suggested_density_scale; /**< cumulet_volume_suggest_density_scale of the largest file that can be read.
                                       0: not known yet, or none. */
  double requested_position;      /**< The position in frames: 2.25 is a quarter of the way from frame 2 to 3. */
  /** Position in frames of the image that the last cumulet_render drew, if is_displayed. */
  double displayed_position;
} cumulet_sequence_info;

/**
 * Returns the state of the viewer's sequence, and of each of its frames.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param info   Receives the state; its struct_size must be set.
 * @param states Receives a cumulet_frame_state per frame, for a timeline. May be NULL.
 * @param count  Elements at states, at least info->frames.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows no sequence.
 */
CUMULET_API cumulet_status cumulet_get_sequence_info(cumulet_viewer* viewer, cumulet_sequence_info* info,
                                                     uint8_t* states, size_t count);
/** State of one frame of a sequence. */
typedef enum cumulet_frame_state {
  CUMULET_FRAME_WAITING = 0, /**< Not read yet, or not built for the present settings. */
  CUMULET_FRAME_READY = 1,
  CUMULET_FRAME_FAILED = 2 /**< Cannot be shown; another frame replaces it. */
} cumulet_frame_state;
/**
 * Returns why a frame of the viewer's sequence failed.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param frame  The frame, from 0.
 * @param cause  Receives one line that names the file, zero-terminated and cut to fit; "" if the frame did not fail.
 * @param size   Bytes at cause, at least 1.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows no sequence or it has no such frame.
 */
CUMULET_API cumulet_status cumulet_get_sequence_frame(cumulet_viewer* viewer, uint32_t frame, char* cause, size_t size);
/**
 * Shows a dynamic volume in place of a volume, and follows its newest state. The previous content stays until a state
 * is ready.
 *
 * - States are read and built on a worker, which begins with the newest as soon as it is submitted, or as soon as
 *   cumulet_render has taken the previous one. A build that has begun is finished and displayed. So a host that submits
 *   faster than that sees motion at the rate of building and rendering, and the newest state last.
 * - While previews are on, a state stays displayed until there is an image of it. A state that cannot be shown leaves
 *   the last good one.
 * - cumulet_wait waits for the newest state. cumulet_cancel stops building until another state is submitted or a
 *   setting changes.
 * - The first state with other channels than before compiles the programs that it needs (cumulet_warm_up).
 * - cumulet_stats has the build times of the last state; build_seconds_load is its reading.
 * - cumulet_set_volume, cumulet_set_sequence and a successful cumulet_load_volume end the dynamic volume.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param volume The dynamic volume, which is retained. NULL: none; if one was shown, nothing is shown.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_dynamic_volume(cumulet_viewer* viewer, cumulet_dynamic_volume* volume);

/** Update numbers of a dynamic volume in one viewer. */
typedef struct cumulet_dynamic_volume_info {
  size_t struct_size;
  uint64_t submitted_update; /**< Update number of the newest submitted state. 0: none yet. */
  uint64_t ready_update;     /**< Update number of the last state that was taken from the worker, to be uploaded and
                                rendered. */
  uint64_t displayed_update; /**< Update number of the state in the image that the last cumulet_render drew. 0: none. */
  uint64_t ready_count;      /**< Number of states taken since the dynamic volume was set. */
  uint64_t displayed_count;  /**< Number of those that have been drawn. */
} cumulet_dynamic_volume_info;

/** Format of the numbers in a buffer, named as in GL and packed one after another. R16 and R8 are 0 to 1. */
typedef enum cumulet_voxel_format {
  CUMULET_VOXEL_FORMAT_R32F = 0,
  CUMULET_VOXEL_FORMAT_R16F = 1,
  CUMULET_VOXEL_FORMAT_R16 = 2,
  CUMULET_VOXEL_FORMAT_R8 = 3
} cumulet_voxel_format;

/** The voxels of one channel in a GL object of the host: exactly one of texture and buffer is not 0. */
typedef struct cumulet_gl_field {
  size_t struct_size; /**< Equal for all fields of an array: the distance between them in bytes. */
  cumulet_channel channel;
  /**
   * GL name of a GL_TEXTURE_3D with a float or normalized format (no integers), base level 0. Level 0 is read with
   * texel fetches: texel (x, y, z) is the voxel.
   */
  uint32_t texture;
  uint32_t component; /**< Component of the texture, 0 to 3 for r to a. Fields may share a texture. */
  uint32_t buffer;    /**< GL name of a buffer. The fields below up to size describe it. */
  cumulet_voxel_format format;
  uint64_t offset; /**< Bytes to voxel 0, a multiple of the number's size. */
  /**
   * Bytes from voxel to voxel along x, y and z, multiples of the number's size. All 0: x fastest, then y, then z,
   * without gaps. With R16F, R16 and R8, the words of four bytes that contain the voxels must lie in the buffer.
   */
  uint64_t strides[3];
  int32_t size[3];           /**< Voxels along x, y and z in the buffer. */
  double index_to_world[16]; /**< Affine. Voxel (i, j, k) is the unit cube centered on (i, j, k). All zero: identity. */
} cumulet_gl_field;

/** A box of changed voxels. */
typedef struct cumulet_voxel_box {
  int32_t min[3]; /**< Lowest voxel. */
  int32_t max[3]; /**< Highest voxel, inclusive. */
} cumulet_voxel_box;

/** The fields of a simulation state in GL; see cumulet_dynamic_volume_set_gl. */
typedef struct cumulet_gl_volume_desc {
  size_t struct_size;
  const cumulet_gl_field* fields; /**< At least one of density, temperature and flame; each channel at most once. */
  uint64_t field_count;
  /**
   * NULL: a complete state. Otherwise the new state is the last submitted one, with the given boxes read again. All
   * bricks of 8^3 voxels (the first begins at voxel 0) that a box touches are read, from each given field, whose
   * texture or buffer has the size of the complete one. Parts of a box outside of a field are ignored.
   */
  const cumulet_voxel_box* changed;
  uint64_t changed_count;
  void* wait;       /**< A GLsync that the device waits for before it reads; belongs to the host. NULL: none. */
  const char* name; /**< Name in messages. NULL: "state". */
} cumulet_gl_volume_desc;

/**
 * [GL] Submits a state of a dynamic volume from OpenGL textures or buffers: a complete state, or changed boxes of the
 * last one. Voxels do not pass through the host's memory. The viewer need not show the dynamic volume; its context does
 * the work for all viewers that show it.
 *
 * - The call queues a copy on the device and returns. Later GL commands may overwrite or delete the host's objects.
 *   Shader writes in the same context need no glMemoryBarrier; for writes of another context there is `wait`.
 * - A later cumulet_render or cumulet_warm_up of this viewer takes the finished copy, without waiting. Only then does
 *   the state get its number and is built. Until then cumulet_render sets CUMULET_RENDER_INCOMPLETE. cumulet_wait does
 *   not wait for it.
 * - The result equals, bit for bit, that of cumulet_dynamic_volume_set with the same numbers in a dense array.
 * - A value that is not finite is found when the copy is taken: that cumulet_render returns CUMULET_ERROR_FILE once,
 *   and draws the previous state.
 * - The first call of a kind (texture or buffer, complete or boxes) compiles a small program, unless cumulet_warm_up
 *   did.
 * - Two complete states in transfer take twice the GL memory of their voxels, which cumulet_limits_desc.gl_bytes does
 *   not limit. Cells get the rest.
 *
 * docs/howto/dynamic_volumes.md has the order of states, the cases in which they are dropped, and GPU residency
 * (cumulet_dynamic_volume_desc.gpu_resident).
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param volume The dynamic volume.
 * @param desc   The fields.
 * @return CUMULET_OK or a [GL] error; CUMULET_ERROR_FILE for an unsuitable matrix; CUMULET_ERROR_UNSUPPORTED for more
 *         than 2^36 voxels, and if a layer of bricks is larger than the driver's storage blocks; or
 *         CUMULET_ERROR_INVALID_ARGUMENT
 *         - for channels that occur twice or are incomplete
 *         - for a name that is not such a texture or buffer of the context's share group, has no size or lacks the
 *           component, for a buffer that is mapped (unless persistently) or too small, and for a wait that is no
 *           GLsync
 *         - with changed: before the first state, for a channel that the state does not have, after a refused complete
 *           state, or if the state is in another viewer's context
 */
CUMULET_API cumulet_status cumulet_dynamic_volume_set_gl(cumulet_viewer* viewer, cumulet_dynamic_volume* volume,
                                                         const cumulet_gl_volume_desc* desc);

/**
 * Returns the update numbers of the viewer's dynamic volume.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param info   Receives the numbers; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows no dynamic volume.
 */
CUMULET_API cumulet_status cumulet_get_dynamic_volume_info(cumulet_viewer* viewer, cumulet_dynamic_volume_info* info);

/**
 * Returns the volume that was last loaded or set. For a sequence it is the frame taken last, or NULL if its voxels are
 * not kept. For a dynamic volume it is the state taken last, or NULL if its voxels are only in GL memory.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param out    Receives the volume, which the caller releases; NULL if there is none.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_volume(cumulet_viewer* viewer, cumulet_volume** out);
/**
 * Stops loading, building and posing, within some 20 ms (see cumulet_destroy). The displayed content stays, with the
 * settings that it was built with. Physical skies are not cancelled.
 *
 * Threads: any thread, at any time, also inside callbacks. No GL.
 *
 * @param viewer The viewer; NULL does nothing.
 */
CUMULET_API void cumulet_cancel(cumulet_viewer* viewer);

/**
 * Loads a glTF file on a worker, and poses it there. Returns at once. The previous surfaces stay until the new ones are
 * ready, and for good if the load fails. A load cancels the running load or pose, but not twice in a row. Surfaces and
 * volume share one world space and one image: rays end at triangles, and light travels both ways.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param path   UTF-8 path of a .gltf or .glb file.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an empty path. Failures of the load itself are reported
 *         later, see @ref cumulet_errors.
 */
CUMULET_API cumulet_status cumulet_load_surfaces(cumulet_viewer* viewer, const char* path);
/**
 * Shows surfaces: poses them on a worker, and displays them when they are ready. A running pose is finished and
 * displayed first. A running load is cancelled.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param surfaces The surfaces, which are retained. NULL: none, at once.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_surfaces(cumulet_viewer* viewer, cumulet_surfaces* surfaces);
/**
 * Returns the surfaces that were last loaded or set.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param out    Receives the surfaces, which the caller releases; NULL if there are none.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_surfaces(cumulet_viewer* viewer, cumulet_surfaces** out);

/**
 * Loads an environment file on a worker. Returns at once. The previous environment or sky stays until the new one is
 * ready, and for good if the load fails. A load cancels the running load, but not twice in a row.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param path   UTF-8 path of a .hdr or .exr file, with the rules of cumulet_environment_open.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an empty path. Failures of the load itself are reported
 *         later, see @ref cumulet_errors.
 */
CUMULET_API cumulet_status cumulet_load_environment(cumulet_viewer* viewer, const char* path);
/**
 * Uses an environment in place of the sky of cumulet_sun_sky_desc: it lights volume and surfaces, and is the
 * background. The next frames upload it. The sun of cumulet_sun_sky_desc stays. A running load is cancelled.
 *
 * Rasterized surfaces (of previews, and with CUMULET_SURFACE_LIGHTING_RASTERIZED) are lit by the environment, and by a
 * physical sky, without shadows and from a prefiltered map. Diffuse surfaces are accurate to a few per cent; mirrors
 * look blurred.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer      The viewer.
 * @param environment The environment, which is retained. NULL: the sky again.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_environment(cumulet_viewer* viewer, cumulet_environment* environment);
/**
 * Returns the environment that was last loaded or set.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param out    Receives the environment, which the caller releases; NULL if there is none.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_environment(cumulet_viewer* viewer, cumulet_environment** out);

/** How surfaces are lit, and how light travels between them and the volume. */
typedef enum cumulet_surface_lighting {
  CUMULET_SURFACE_LIGHTING_GLOBAL = 0, /**< Global illumination: light travels between surfaces, and between them and
                                       the volume. */
  CUMULET_SURFACE_LIGHTING_DIRECT = 1, /**< Direct light: surfaces are lit only by sun, sky, analytic lights and
                                          emissive triangles, with shadows of surfaces and volume. */
  /**
   * Rasterized: surfaces are lit by sun, sky and analytic lights without shadows, and occlude the content behind them.
   * The volume is lit only by sun and sky. This is the fastest mode, and previews use it in every mode if there is sun
   * or sky.
   * Surfaces of alphaMode BLEND are sorted among each other. In front of the volume, inside and behind it they count as
   * one layer, at the nearest depth of a pixel.
   */
  CUMULET_SURFACE_LIGHTING_RASTERIZED = 2
} cumulet_surface_lighting;

/** How a viewer shows its own surfaces. */
typedef struct cumulet_surface_settings_desc {
  size_t struct_size;
  double time;        /**< Seconds into the animation; past its end it starts again. */
  uint32_t animation; /**< Number of the animation in the file. One that does not exist: no animation. */
  cumulet_surface_lighting lighting;
  /**
   * Path-space regularization (Kaplanyan, Dachsbacher 2013; "Filter Glossy" in Cycles): minimum roughness of surfaces,
   * 0 to 1, once a path was scattered more widely than such a surface reflects. It softens caustics on walls and
   * clouds, and removes fireflies. Surfaces that the camera sees directly or in mirrors do not change. 0, the default:
   * off, without bias.
   */
  float indirect_roughness;
  int32_t double_sided; /**< 1: all materials show both sides and emit from both, whatever the file says. Use it for
                             files that are wound inside out; a warning reports those. 0: as the file says. */
  uint32_t variant;     /**< Material variant with index variant - 1 (cumulet_surfaces_get_variant). 0, or one that does
                             not exist: the materials without a variant. */
  uint32_t group;       /**< Light group of their emissive triangles and analytic lights, below CUMULET_LIGHT_GROUPS. */
  int32_t holdout;      /**< 1: camera rays see a holdout, see cumulet_medium_desc.holdout. Rasterization leaves them
                             out. */
} cumulet_surface_settings_desc;

/**
 * Sets how the viewer shows its own surfaces. If time, animation, double_sided or variant changed, they are posed again
 * on a worker, and the last pose is shown until then.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_surface_settings(cumulet_viewer* viewer,
                                                        const cumulet_surface_settings_desc* desc);
/**
 * Moves the viewer's camera to a camera of the viewer's own surfaces, as it was posed last. Call cumulet_wait first if
 * the surfaces may still be loading.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param index  The camera, from 0.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no such camera (yet).
 */
CUMULET_API cumulet_status cumulet_use_surface_camera(cumulet_viewer* viewer, uint32_t index);

/** The stage of the present work. */
typedef enum cumulet_stage {
  CUMULET_STAGE_IDLE = 0,
  CUMULET_STAGE_LOADING = 1,    /**< Reading the file. */
  CUMULET_STAGE_STATISTICS = 2, /**< Computing exact statistics of the voxels. */
  CUMULET_STAGE_REFINING = 3,   /**< Evaluating the refinement criterion, and bisecting cells. */
  CUMULET_STAGE_PACKING = 4,    /**< Packing the cell data. */
  CUMULET_STAGE_UPLOADING = 5   /**< Uploading to GL, within cumulet_render. */
} cumulet_stage;

/** Progress and result of the work on a viewer's content. */
typedef struct cumulet_progress {
  size_t struct_size;
  cumulet_stage stage;
  double fraction;              /**< Part of the stage that is done, 0 to 1. */
  cumulet_status status;        /**< CUMULET_OK, or the failure that @ref cumulet_errors selects. */
  char message[512];            /**< Its cause in one line; "" for CUMULET_OK. */
  cumulet_status volume_status; /**< Result of the last work on the volume or on one of an instance. */
  char volume_message[512];
  cumulet_status surfaces_status; /**< Result of the last work on the surfaces or a model. */
  char surfaces_message[512];
  cumulet_status environment_status; /**< Result of the last work on the environment or a physical sky. */
  char environment_message[512];
} cumulet_progress;

/**
 * Returns the stage and the results of the work on the viewer's content. It does not change cumulet_last_error.
 *
 * Threads: any thread, at any time, also inside callbacks. No GL.
 *
 * @param viewer   The viewer.
 * @param progress Receives the progress; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_progress(cumulet_viewer* viewer, cumulet_progress* progress);
/**
 * Waits until all workers of the viewer are idle, and returns how loads and builds ended: the same as
 * cumulet_progress.status, with its message as the last error. The next cumulet_render uploads the results.
 *
 * Threads: any thread; other threads may make calls meanwhile. No GL.
 *
 * @param viewer     The viewer.
 * @param timeout_ms Maximum time in milliseconds; negative: no maximum.
 * @return CUMULET_OK, CUMULET_ERROR_TIMEOUT, CUMULET_ERROR_INVALID_ARGUMENT for NaN, or the failure of a worker (see
 *         @ref cumulet_errors), also CUMULET_ERROR_CANCELLED.
 */
CUMULET_API cumulet_status cumulet_wait(cumulet_viewer* viewer, double timeout_ms);
/**
 * Builds all grids again even if no setting changed, reads all files of sequences again, and retries failed work.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_rebuild(cumulet_viewer* viewer);

/** Limits on the threads and the memory that a viewer uses. Zero, the default: no limit. */
typedef struct cumulet_limits_desc {
  size_t struct_size;
  /**
   * Maximum number of threads that work for the viewer at a time (reading, building, posing), 1 to 1024. It applies
   * from the next job on. Not counted: physical skies, the calling thread, threads that sleep, free memory or finish
   * work that cannot be interrupted (cumulet_destroy), and the driver's. Calls on handles use all processors.
   */
  uint32_t threads;
  /**
   * Maximum main memory in bytes for volumes and grids: the voxels of the displayed volume, the data that is computed
   * from them once, and the cells (cumulet_stats.memory_bytes). Each viewer counts all that it shares. For a
   * sequence it limits all ready frames, if it is less than the sequence's memory_bytes.
   *
   * Cells are coarsened to fit (cumulet_stats.limited). If even the coarsest do not fit, the load or build fails with
   * CUMULET_ERROR_OUT_OF_MEMORY and one line, and the displayed content stays. Not counted: temporary memory of builds,
   * surfaces, environments, instances, copies of a dynamic volume for updates, and handles that the host retains.
   */
  uint64_t memory_bytes;
  /**
   * Maximum GL memory in bytes. Cells are coarsened to fit into two fifths of the memory that the other GL objects of
   * the last frame leave (cumulet_stats.limited); several grids get equal parts. If new cells do not fit beside the old
   * ones, the old ones are deleted first, and additional grids are shown once the others have shrunk. Cells that other
   * viewers share (cumulet_shader_cache_create) count in full.
   *
   * Voxel grid types cannot be coarsened: a volume that would exceed gl_bytes, together with the previous one, is not
   * uploaded. The previous one stays, and cumulet_render returns CUMULET_ERROR_OUT_OF_MEMORY once. Surfaces and images
   * count, but are never refused.
   */
  uint64_t gl_bytes;
} cumulet_limits_desc;

/**
 * Sets the limits of a viewer. They apply to work started after this call. Exception: the grid of a static volume (not
 * of a sequence or dynamic volume) is rebuilt for new memory limits.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The limits.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_limits(cumulet_viewer* viewer, const cumulet_limits_desc* desc);

/** @} */

/* ---- Settings ---------------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_settings Settings
 *
 * Each cumulet_set_... function takes a complete descriptor: fields that are zero have their defaults.
 * @{
 */

/**
 * Number of light groups. Each light is in one group, 0 to CUMULET_LIGHT_GROUPS - 1, by default in group 0. An image
 * may keep the radiance of each group separately (cumulet_sampling_desc.light_groups), so that a compositor can dim or
 * color it later.
 */
enum { CUMULET_LIGHT_GROUPS = 8 };

/** The grid type: the acceleration structure that rays traverse. All are traversed exactly, without a step size. */
typedef enum cumulet_grid_type {
  CUMULET_GRID_TETRAHEDRAL = 0, /**< The adaptive tetrahedral grid. */
  CUMULET_GRID_DENSE = 1,       /**< 3D DDA over every voxel of the bounds (the paper's reference). */
  CUMULET_GRID_BRICKS = 2       /**< Two-level 3D DDA that skips empty bricks of 8^3 voxels. */
} cumulet_grid_type;

/** The density inside a tetrahedral cell. */
typedef enum cumulet_cell_density {
  CUMULET_CELLS_LINEAR = 0,   /**< Linear least-squares fit, non-negative, with the exact mean. */
  CUMULET_CELLS_CONSTANT = 1, /**< The mean. */
  /**
   * For close views with CUMULET_INTERPOLATION_LINEAR: as CUMULET_CELLS_LINEAR, but the finest cells, which are sixths
   * of the cells between eight voxels, have the interpolated field itself. So there are no edges between them. Their
   * emission stays a linear fit. A cell takes 16 bytes more. Without interpolation the same as CUMULET_CELLS_LINEAR.
   */
  CUMULET_CELLS_TRILINEAR = 2
} cumulet_cell_density;

/** The field that voxels stand for. All fields of a volume are interpolated alike. */
typedef enum cumulet_interpolation {
  /**
   * The library's default: linear. There is one exception: nearest for dynamic volumes with
   * cumulet_dynamic_volume_desc.gpu_resident, if the GPU builds tetrahedra whose cells are not trilinear: linear would
   * need their voxels in main memory. Then the log says so once. cumulet_get_interpolation returns which is in use.
   */
  CUMULET_INTERPOLATION_AUTO = 0,
  CUMULET_INTERPOLATION_NEAREST = 1, /**< A voxel is a cube of constant value. */
  /**
   * A voxel is a sample at its center, with trilinear interpolation between centers. The field ends half a voxel
   * outside the voxels' box. Ramps and the emission of temperatures apply to voxels. Voxels of GPU-resident dynamic
   * volumes are read back.
   */
  CUMULET_INTERPOLATION_LINEAR = 2
} cumulet_interpolation;

/** The refinement criterion: the error indicator that decides which cells are split. */
typedef enum cumulet_refinement_criterion {
  /** Standard deviation x edge length > threshold x mean optical depth. With a threshold of 0, the default,
      CUMULET_CRITERION_TRANSMITTANCE is used instead. */
  CUMULET_CRITERION_DEVIATION = 0,
  CUMULET_CRITERION_RANGE_MEAN = 1, /**< (max - min) / mean > threshold (the paper's). */
  /**
   * Density error weighted by visibility, about the relative error of the image:
   * T^2 x deviation x edge / (1 + extinction x edge) / (1 - exp(-mean optical depth)) > threshold.
   *
   * Extinctions include the density scale, and are reduced for forward scattering. T is the transmittance from outside
   * to the cell, and T^2 the two-way transmittance. Cells are rebuilt in the background when density_scale, or
   * density_scale x (1 - anisotropy), is more than twice or less than half of the value that they were built for. Until
   * then they stay, and cumulet_rebuild builds them for the present value.
   */
  CUMULET_CRITERION_TRANSMITTANCE = 2
} cumulet_refinement_criterion;

/** The device that builds the tetrahedral grid. */
typedef enum cumulet_build_device {
  CUMULET_BUILD_CPU = 0, /**< A worker builds it; supports all features. */
  /**
   * Compute shaders build it, within the budgets of frames, while the old cells are shown. The cells are the same, and
   * their data (density, emission, color, anisotropy, velocity) differs only by rounding. A worker computes the
   * view-independent part once per volume and medium; a camera that moves then needs only the GPU passes.
   *
   * The CPU builds the grid instead, and the log has the reason, in these cases: the grid is larger than the driver's
   * storage blocks; its build takes more GL memory than there is or than cumulet_limits_desc.gl_bytes allows; or it
   * moves while the shutter is open.
   */
  CUMULET_BUILD_GPU = 1
} cumulet_build_device;

/** How the grid is built. A change rebuilds it on the worker; the old one is shown meanwhile. */
typedef struct cumulet_grid_desc {
  size_t struct_size;
  cumulet_grid_type type; /**< The grid type. */
  cumulet_cell_density cells;
  cumulet_refinement_criterion criterion;
  /**
   * Cells above it are split. 0: 0.15 by transmittance, 1 for range-mean. Negative: cells are split down to the voxel.
   */
  double threshold;
  uint64_t max_cells; /**< Maximum number of cells, spent where the criterion is largest. 0: 5,400,000. */
  /**
   * 1: cells outside the frustum or smaller than pixel_size pixels are not split. This needs the size of a frame. The
   * grid is rebuilt when the camera rests at another view. 0: off.
   */
  int32_t camera_adaptive;
  double pixel_size;                 /**< Pixels that a cell's longest edge must cover to be split, up to 1e6. 0: 1. */
  cumulet_build_device build_device; /**< The device that builds CUMULET_GRID_TETRAHEDRAL. */
  cumulet_interpolation interpolation; /**< Interpolation between voxels, for all grid types. 0: linear. */
} cumulet_grid_desc;

/** The phase function: the distribution of scattered directions. */
typedef enum cumulet_phase_function {
  CUMULET_PHASE_HG = 0,       /**< One Henyey-Greenstein lobe. */
  CUMULET_PHASE_TWO_LOBE = 1, /**< Two Henyey-Greenstein lobes. */
  CUMULET_PHASE_MIE = 2       /**< Water droplets: a fit of Mie theory (Jendersie and d'Eon 2023). */
} cumulet_phase_function;

/**
 * The participating medium. A change restarts accumulation. The cells stay, unless they were built for another
 * transmittance or emission.
 */
typedef struct cumulet_medium_desc {
  size_t struct_size;
  /**
   * Extinction = density_scale x grid value, in 1 / world unit. Up to 1e60; 0: 1. Paths see at most 2^23 optical depths
   * over the extent of all volumes, because floats resolve no shorter distance: a denser medium looks the same.
   */
  double density_scale;
  float coalbedo[3]; /**< 1 - single-scattering albedo, each in [0, 1], so that zero is the default: nothing is
                          absorbed. */
  /**
   * Henyey-Greenstein g in (-1, 1), for two lobes that of the first one. 0: isotropic. Not used by Mie, nor where the
   * volume has an anisotropy_grid.
   */
  float anisotropy;
  /**
   * Maximum scattering events of a path. 0: no limit; but from 16384 on, each doubling halves the survival probability
   * of the path (Russian roulette), which keeps the mean.
   */
  uint32_t max_bounces;
  /**
   * Source radiance, up to 1e30: each point emits extinction x emission per world unit of length. So a body of the
   * medium that is opaque and does not scatter has this radiance. The emission lights the medium and the surfaces
   * (CUMULET_SURFACE_LIGHTING_GLOBAL). 0: none.
   */
  float emission[3];
  cumulet_phase_function phase;
  float second_anisotropy; /**< Two lobes: g of the second one, in (-1, 1). 0: isotropic. */
  float second_weight;     /**< Two lobes: weight of the second one, in [0, 1]. 0: 0.5. */
  float droplet_diameter;  /**< Mie: droplet diameter in micrometers, in [5, 50]. 0: 20, as in a cloud. */
  /**
   * Emission of flame and temperature grids: radiance per world unit of length, independent of the density,
   *
   *     flame_strength x flame_color x flame
   *     + 1e-6 sigma / pi x mix(1, T^4, blackbody) x blackbody_tint x black-body color of T kelvin, of luminance 1
   *
   * with T = temperature_offset + temperature_scale x temperature, where the temperature is not 0. It is dark below 100
   * K. The formula is that of Blender's Principled Volume except for the scale: files hold 0 to 3 or so. A change of
   * these fields rebuilds the grid.
   *
   * flame_strength: up to 1e30; 0: 1. To render without flames, set flame_grid to "none".
   */
  float flame_strength;
  float flame_color[3];     /**< Linear Rec. 709, up to 1e30. All 0: white. */
  float temperature_scale;  /**< Kelvin per unit. 0: 1 if the grid exceeds 20, as kelvin do, else 1500 (see
                                 cumulet_volume_info). All frames of a sequence use the scale for its largest file. A
                                 dynamic volume keeps 1 once a state had it. */
  float temperature_offset; /**< Kelvin, -1e6 to 1e6. */
  /** Intensity, up to 1e30. 0: none, except 1 for a volume that has a temperature and neither density nor flame. */
  float blackbody;
  float blackbody_tint[3]; /**< Up to 1e30. All 0: white. */
  uint32_t group;          /**< Light group of its emission, below CUMULET_LIGHT_GROUPS. */
  /**
   * 1: holdout. Where a camera ray would first be scattered by this medium, the image is black with alpha 0, and no
   * background shows; objects in front of it stay. Other rays are not affected. So an image leaves room for the element
   * that it is composited with. AOVs contain the medium as usual. Previews show the holdout once they are path-traced.
   */
  int32_t holdout;
} cumulet_medium_desc;

/** The grid whose values a ramp or a color ramp maps. */
typedef enum cumulet_ramp {
  CUMULET_RAMP_DENSITY = 0,
  CUMULET_RAMP_TEMPERATURE = 1,
  CUMULET_RAMP_FLAME = 2
} cumulet_ramp;

/** The model of sun and sky. */
typedef enum cumulet_sky_model {
  CUMULET_SKY_CONSTANT = 0, /**< The sun has sun_irradiance, and the sky has sky_radiance in all directions. */
  /**
   * The sky of a clear day with the sun at its position (Hillaire 2020), seen from the ground at sea level.
   * sun_irradiance and sky_radiance are not used.
   *
   * - Below the horizon it shows the lit ground, or black if cumulet_set_ground has a ground.
   * - Unit: the sun's light outside of the atmosphere is white, with irradiance 5 (1 is some 27 klx). On the ground it
   *   is about 4 at noon, and almost 0 after sunset.
   * - A worker computes it, in some 0.1 s when turbidity or ground_albedo change, and 0.03 s when the elevation changes
   *   or a ground appears or disappears. Until then sun and sky stay as they were, cumulet_render sets
   *   CUMULET_RENDER_LOADING, and cumulet_wait waits. While the sun is dragged, each sky that was begun is shown, and
   *   the newest last. cumulet_cancel does not cancel it.
   */
  CUMULET_SKY_PHYSICAL = 1
} cumulet_sky_model;

/** A distant sun and a sky. A change restarts accumulation. */
typedef struct cumulet_sun_sky_desc {
  size_t struct_size;
  float sun_azimuth_degrees;   /**< Direction towards the sun, from +Z towards +X. */
  float sun_elevation_degrees; /**< Angle above the horizon, -90 to 90. */
  float sun_irradiance[3];     /**< On a surface that faces the sun, up to 1e30. 0: no sun. */
  float sky_radiance[3];       /**< Up to 1e30. 0: black. */
  cumulet_sky_model sky;
  /** Physical: Linke turbidity, in [1, 10]: 1 no aerosols, 2 very clear, 3 clear, 6 hazy. 0: 3. */
  float turbidity;
  float ground_albedo; /**< Physical: albedo of the ground below the atmosphere, in [0, 1]. 0: black. */
  /**
   * Angular diameter of the sun, -180 to 180 degrees: above 0 it gives soft shadows and a visible disk. The irradiance
   * does not depend on it. 0: a direction without a visible disk, but 0.53 for a physical sky. Negative: a direction.
   */
  float sun_angle_degrees;
  uint32_t sun_group; /**< Light group of the sun, below CUMULET_LIGHT_GROUPS. */
  uint32_t sky_group; /**< Light group of the sky, or of the environment that replaces it. */
} cumulet_sun_sky_desc;

/** How the viewer uses its environment (cumulet_set_environment). A change restarts accumulation. */
typedef struct cumulet_environment_settings_desc {
  size_t struct_size;
  float rotation_degrees; /**< Rotation from +Z towards +X, -360 to 360. */
  float strength;         /**< Factor for its radiance, up to 1e6. 0: 1. */
} cumulet_environment_settings_desc;

/** Whether there is a ground plane, and its height. */
typedef enum cumulet_ground_mode {
  CUMULET_GROUND_NONE = 0,
  CUMULET_GROUND_BELOW = 1,                   /**< At the lowest point of volume and surfaces. */
  CUMULET_GROUND_AT_HEIGHT = 2,               /**< At cumulet_ground_desc.height. */
  CUMULET_GROUND_SHADOW_CATCHER_BELOW = 3,    /**< A shadow catcher at the lowest point of volume and surfaces. */
  CUMULET_GROUND_SHADOW_CATCHER_AT_HEIGHT = 4 /**< A shadow catcher at cumulet_ground_desc.height. */
} cumulet_ground_mode;

/**
 * An infinite horizontal plane that receives shadows. It is invisible from below. A change restarts accumulation.
 *
 * - A diffuse ground has an albedo and lights the objects above it. The image and its alpha contain it; AOVs of depth,
 *   normal and albedo, and rasterized surfaces of previews, do not. With it, a physical sky is black below the horizon.
 * - A shadow catcher shows the ground of an environment map, or the lit ground of a physical sky, with the shadows of
 *   volume and surfaces. Only camera rays hit it, so it does not light the objects. Its radiance is B x R, where B is
 *   the radiance of the background behind it. R is the irradiance that arrives on it, divided by the irradiance of sun
 *   and sky without objects. Light of fire and of lights makes it brighter. Where nothing shades or lights it, it is
 *   the background, without noise. It is there only with CUMULET_BACKGROUND_SKY, and its alpha is 1. Cryptomatte does
 *   not contain it.
 */
typedef struct cumulet_ground_desc {
  size_t struct_size;
  cumulet_ground_mode mode;
  double height;   /**< World y, for the modes at a height; within 1e30. */
  float albedo[3]; /**< Each in [0, 1]. All 0: 0.3. A shadow catcher ignores it. */
} cumulet_ground_desc;

/** The rendered view: the path-traced image, or a debug view of the grid. */
typedef enum cumulet_view_mode {
  CUMULET_VIEW_SHADED = 0,   /**< The path-traced image. */
  CUMULET_VIEW_CELLS = 1,    /**< The cells on a slice through the middle, colored by level, with their edges. */
  CUMULET_VIEW_STEPS = 2,    /**< Number of cells or voxels that the camera ray crosses, as a heat map. */
  CUMULET_VIEW_DENSITY = 3,  /**< Opacity along the camera ray, 1 - exp(-optical depth), in gray. */
  CUMULET_VIEW_WIREFRAME = 4 /**< The edges of the cells that hold density, over the density. */
} cumulet_view_mode;

/** Whether frames may be coarser than the target. */
typedef enum cumulet_preview {
  CUMULET_PREVIEW_AUTO = 0, /**< After a change images are as coarse as the budget needs, and then refined. */
  CUMULET_PREVIEW_OFF = 1   /**< Always full resolution: values that are read back depend only on the settings. */
} cumulet_preview;

/** How images are sampled. A change restarts accumulation; a larger number of samples only continues it. */
typedef struct cumulet_sampling_desc {
  size_t struct_size;
  uint32_t samples; /**< Samples per pixel. 0: 256. */
  uint32_t seed;    /**< The same seed, samples, size and driver give the same image, bit for bit. */
  cumulet_view_mode view;
  cumulet_preview preview;
  int32_t separate_volume_aov; /**< 1: at full resolution, also accumulate CUMULET_AOV_VOLUME. */
  /**
   * Noise target in per cent, 0 to 100: an image at full resolution is converged when its noise (cumulet_measure_noise)
   * is at most this, and `samples` is then the maximum. 0: no target.
   *
   * The noise is evaluated at 16 samples per pixel and at each 1.41 times as many, over all pixels, so that the same
   * settings end with the same image, independent of time. Because the stop depends on the samples, the mean of many
   * such images is slightly lower than with fixed counts, by much less than the noise (docs/aovs.md).
   */
  float noise_target_percent;
  /**
   * Number of the first sample: a pixel gets samples first_sample to first_sample + samples - 1. A sample depends only
   * on its number, the seed and the scene. Any 2^k samples from a multiple of 2^k on are a low-discrepancy set
   * (Owen-scrambled). So several processes can render parts of the samples; the mean of their images, weighted by
   * samples, is the whole image except for rounding. Numbers beyond 2^32 - 1 continue at 0.
   */
  uint32_t first_sample;
  /**
   * Render region (crop window): x, y, width and height as fractions of the image, each in [0, 1], from its upper left
   * corner. A width or height of 0 extends to the end; all zero, the default, is the whole image.
   *
   * Pixels whose centers are inside are rendered (cumulet_region_pixels), with the same bits as in the whole image.
   * Frames leave the rest of their target unchanged. Values that are read back are 0 outside (transparent, also for
   * depths); errors are infinite there. Denoising uses no pixels outside. Progress, noise and sample counts are of the
   * region.
   */
  float region[4];
  /**
   * At full resolution, also accumulate the contribution of each of this many light groups (0 to 8), for
   * cumulet_read_light_group. 0: none. Lights of other groups count in group 0, so that the groups add up to the image.
   * The image does not change. It takes 16 bytes per pixel and group of GL memory, and 32 bytes per pixel more.
   */
  uint32_t light_groups;
  /**
   * Motion blur: time in seconds for which the shutter is open, up to 1e6, centered on the frame time as in Blender's
   * default. 0: none. Each path has one uniformly distributed time (Cook, Porter and Carpenter, "Distributed Ray
   * Tracing", 1984).
   *
   * Moving objects are: cameras (cumulet_camera_set_shutter); instance transforms
   * (cumulet_set_volume_shutter_transforms, cumulet_instance_desc, cumulet_model_desc); surfaces with an animation;
   * host meshes with velocities; and volumes with velocities (docs/motion_blur.md). These are not motion-blurred and
   * use the frame time: AOVs, picks, debug views, transmittance maps, rasterized surfaces
   * (CUMULET_SURFACE_LIGHTING_RASTERIZED), analytic lights of models, and the host's depth.
   */
  float shutter_seconds;
  /**
   * 1: adaptive sampling. With a noise target, more samples go to noisier parts of the image. A block is half of 8 x 8
   * pixels (its even or its odd rows). It stops when it has its share of the smallest total number of samples that
   * reaches the target, n ~ sigma (Neyman, "On the Two Different Aspects of the Representative Method", 1934).
   *
   * Blocks are evaluated when the noise is. The samples of one half decide about the other (docs/aovs.md). The same
   * settings end with the same image, independent of time. Pixels then have different sample counts. 0: all pixels have
   * the same count.
   */
  int32_t adaptive;
} cumulet_sampling_desc;

/** The tone map. */
typedef enum cumulet_tone_map {
  CUMULET_TONE_MAP_NEUTRAL = 0, /**< Khronos PBR Neutral. */
  CUMULET_TONE_MAP_FILMIC = 1,  /**< Narkowicz's fit of the ACES curve, 2015. */
  CUMULET_TONE_MAP_CLIP = 2     /**< Clamped to [0, 1]. */
} cumulet_tone_map;

/** The background behind volume, surfaces and ground. Lighting and mirrors always use the sky or environment. */
typedef enum cumulet_background {
  CUMULET_BACKGROUND_SKY = 0,         /**< The sky's radiance or the environment; opaque. */
  CUMULET_BACKGROUND_TRANSPARENT = 1, /**< Premultiplied color and alpha: the framebuffer's content shows through, and
                                           light without alpha, as of flames, is added to it; see cumulet_blend_mode. */
  CUMULET_BACKGROUND_COLOR = 2        /**< background_color; opaque. */
} cumulet_background;

/** The filter for displayed frames. */
typedef enum cumulet_denoise {
  CUMULET_DENOISE_OFF = 0,
  CUMULET_DENOISE_FAST = 1 /**< A wavelet filter; see cumulet_display_desc.denoise. */
} cumulet_denoise;

/** How an image is displayed. A change does not restart accumulation. */
typedef struct cumulet_display_desc {
  size_t struct_size;
  float exposure_stops; /**< Radiance is multiplied by 2^stops; -64 to 64. */
  cumulet_tone_map tone_map;
  cumulet_background background;
  /** Linear Rec. 709 radiance, up to 1e30; exposed and tone-mapped. Debug views use black. */
  float background_color[3];
  /**
   * The filter for frames that are drawn: an edge-avoiding a-trous wavelet (Dammertz et al. 2010), guided by variance
   * as in SVGF (Schied et al. 2017). While previews are on, it also uses the history of earlier views, reprojected by
   * depth, as up to 32 samples that fade out until the pixel has 64 samples. Images converge to the unfiltered result.
   *
   * - Each view then has its own random numbers, in addition to the seed. Values that are read back are as accurate,
   *   but not the same. cumulet_read_linear and cumulet_read_aov are not filtered; cumulet_read_denoised uses no
   *   history.
   * - Time: at most four tenths of a frame's budget, in the long run a fifth. GL memory: 270 bytes per pixel.
   * - It needs unlit feature rays: four per pixel at first, two more per sample, and beyond sixteen up to 64 where they
   *   differ.
   * - Until the filter is done, frames draw the last image of the same scene and camera, or else the unfiltered image.
   *   Frames with CUMULET_TARGET_NONE continue the filter, and set CUMULET_RENDER_NEW_IMAGE when there is a new image.
   * - Without memory for the filter or its history, frames are drawn without it, and cumulet_render returns
   *   CUMULET_ERROR_OUT_OF_MEMORY once.
   * - Debug views are not filtered.
   */
  cumulet_denoise denoise;
} cumulet_display_desc;

/**
 * Sets how grids are built. A change rebuilds them in the background.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_grid(cumulet_viewer* viewer, const cumulet_grid_desc* desc);
/**
 * Sets the medium of the viewer's own volume.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The medium.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_medium(cumulet_viewer* viewer, const cumulet_medium_desc* desc);
/**
 * Sets a ramp (a transfer function) over the values of a grid, for every volume that the viewer shows as its own. It is
 * like Blender's Map Range and Float Curve, and Houdini's ramps. A change rebuilds the grid in the background.
 *
 * A ramp maps values to values in the grid's own unit, linearly between its points. Below the first point it has y of
 * the first one, above the last point y of the last one. For x_i <= v <= x_(i+1) it is
 *
 *     y_i + (y_(i+1) - y_i) (v - x_i) / (x_(i+1) - x_i)
 *
 * 0 always stays 0, so that no ramp fills the space where a grid has no values. A background that is not 0 is mapped
 * like other values, within the grid's bounds. Ramps are applied per voxel, after resampling to the density's voxels
 * and before all else:
 *
 *     extinction = density_scale x ramp(density), T = temperature_offset + temperature_scale x ramp(temperature),
 *     flame_strength x flame_color x ramp(flame)
 *
 * Properties of a volume ignore ramps: cumulet_volume_info, the suggested density scale, and camera fitting.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param ramp   The grid.
 * @param points count pairs x, y: x strictly ascending and within 1e30, y from 0 to 1e30. Copied.
 * @param count  2 to 32 pairs. 0, the default: no ramp, values stay as they are.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_ramp(cumulet_viewer* viewer, cumulet_ramp ramp, const float* points,
                                            uint64_t count);
/**
 * Sets a color ramp over the values of a grid, for every volume that the viewer shows as its own: the color at each
 * value, as Blender's Color Ramp. cumulet_set_ramp changes how strongly values scatter and emit, and a color ramp
 * changes the color. A change rebuilds the grid in the background.
 *
 * A color ramp is linear between its stops and constant beyond the first and the last. Its input is the value of the
 * grid, before cumulet_set_ramp, so that each value keeps its color when that ramp changes. Colors are linear Rec. 709.
 *
 * - density: the color multiplies the albedo and the color grid of the file, (1 - coalbedo) x color_ramp(density) x
 *   color grid. The extinction does not depend on it.
 * - temperature: the color replaces that of the black body,
 *
 *       1e-6 sigma / pi x mix(1, T^4, blackbody) x blackbody_tint x color_ramp(temperature)
 *
 *   A color of luminance 1 is as bright as the black body. Nothing is emitted below 100 K, where ramp(temperature) is
 *   0, or with a blackbody of 0.
 * - flame: the color replaces flame_color, flame_strength x ramp(flame) x color_ramp(flame).
 *
 * Color ramps are applied per voxel, after resampling to the density's voxels, and are exact for every grid type. A
 * GPU-resident dynamic volume that has one moves to main memory, as with a ramp of density.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param ramp   The grid.
 * @param stops  count groups x, r, g, b: x strictly ascending and within 1e30; r, g and b from 0 to 1 for the density,
 *               and from 0 to 1e30 for the others. Copied.
 * @param count  2 to 32 groups. 0, the default: no color ramp.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_color_ramp(cumulet_viewer* viewer, cumulet_ramp ramp, const float* stops,
                                                  uint64_t count);
/** Maximum number of planes of a cumulet_clip_desc. */
enum { CUMULET_CLIP_PLANES = 6 };

/**
 * The part of a volume that is shown: the intersection of a box and of half-spaces. It is in the volume's own world
 * space, which is that of the bounds in cumulet_volume_info, so it moves with cumulet_set_volume_transforms and
 * cumulet_instance_desc.to_world. Six planes make a box in any orientation. Zeros show the whole volume.
 */
typedef struct cumulet_clip_desc {
  size_t struct_size;
  int32_t box;          /**< 1: the volume is clipped to box_min and box_max. */
  double box_min[3];    /**< Lowest corner, each number within 1e30. */
  double box_max[3];    /**< Highest corner, above box_min. */
  const double* planes; /**< 4 per plane: a, b, c and d. The part with a x + b y + c z + d >= 0 is shown. */
  uint64_t plane_count; /**< 0 to CUMULET_CLIP_PLANES. */
} cumulet_clip_desc;

/**
 * Clips every volume that the viewer shows as its own. Outside the clip it has no extinction and no emission: for the
 * camera, for shadows and scattered light, and in feature buffers, picks and transmittance maps. The cut is exact for
 * all grid types: rays enter and leave cells at its planes. A change starts a new image and rebuilds no grid.
 *
 * Properties of a volume ignore clips: cumulet_volume_info, the suggested density scale, bounds, a ground plane below
 * the volume, and camera fitting. A clipped volume is traced as instances are, in a table that grows by some 200 bytes.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The clip; copied. NULL: none, the default.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for a box that is empty, for more planes than
 *         CUMULET_CLIP_PLANES, for a plane without direction, and for numbers that are not within 1e30.
 */
CUMULET_API cumulet_status cumulet_set_clip(cumulet_viewer* viewer, const cumulet_clip_desc* desc);
/** Histogram of a volume's grid, before its ramp: for a panel that draws the ramp over it. */
typedef struct cumulet_histogram_info {
  size_t struct_size;
  float max_value; /**< 0: the volume has no such grid. */
  /** Counts of the voxels above 0, in equal steps from 0 to max_value. */
  uint64_t histogram[CUMULET_HISTOGRAM_BINS];
} cumulet_histogram_info;

/**
 * Returns the histogram of a volume's grid. Takes some milliseconds per million voxels.
 *
 * Threads: any thread. No GL.
 *
 * @param volume The volume.
 * @param ramp   The grid.
 * @param info   Receives the histogram; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_volume_get_histogram(const cumulet_volume* volume, cumulet_ramp ramp,
                                                        cumulet_histogram_info* info);

/** @} */

/* ---- Instances: volumes beside the viewer's own ------------------------------------------------------------------ */

/**
 * @defgroup cumulet_instances Instances and models
 *
 * Volumes and surfaces in addition to the viewer's own. Both kinds of handles are reference-counted and independent of
 * GL. Any number of viewers may show them, and follow their changes from the next frame on.
 * @{
 */

/**
 * An instance: a volume with a transform and a medium. Instances may overlap each other and the viewer's own volume
 * (cumulet_set_volume). Extinctions add up, and each scattering event uses the medium of one of them, chosen by
 * extinction. Ended by cumulet_instance_release.
 *
 * - Instances of one cumulet_volume whose media need the same grid share one, refined for the most demanding of them,
 *   also with the viewer's own volume. Grids are built as cumulet_set_grid says, one after another in the background,
 *   and each is shown as soon as it is ready.
 * - To move an instance uploads a table of some 600 bytes per instance, and no grid. A camera-adaptive grid is rebuilt.
 * - The rules of cumulet_set_volume_transforms on units, on the number of overlapping volumes and on limits apply.
 * - With CUMULET_GRID_DENSE and CUMULET_GRID_BRICKS all displayed volumes must share one grid. Otherwise
 *   cumulet_render returns CUMULET_ERROR_UNSUPPORTED, and the previous content stays.
 */
typedef struct cumulet_instance cumulet_instance;

/** Content, transform and medium of an instance. At most one of volume, sequence and dynamic_volume is set. */
typedef struct cumulet_instance_desc {
  size_t struct_size;
  cumulet_volume* volume; /**< Retained. NULL: none. */
  double to_world[16];    /**< Affine and invertible, from the volume's own world space to the scene's. All zero:
                               identity. */
  const cumulet_medium_desc* medium; /**< Copied. NULL: the default medium. Its max_bounces is not used; that of the
                                          viewer's own medium applies. */
  int32_t hidden;                    /**< 1: the instance is not rendered. */
  uint64_t tag;                      /**< The host's own number, which cumulet_pick returns. */
  /**
   * Shows a sequence and follows its position, with the rules of cumulet_set_sequence on reading ahead, failed frames
   * and bounds. Retained. NULL: none. Instances of one sequence whose media need the same grids share frames and grids;
   * others have their own. The medium's density_scale is used as given: suggested_density_scale of the sequence's file
   * has no effect.
   */
  cumulet_sequence* sequence;
  /**
   * Shows a dynamic volume and follows its newest state, with the rules of cumulet_set_dynamic_volume. Retained. NULL:
   * none. Instances of one dynamic volume whose media need the same grids share them; others have their own.
   */
  cumulet_dynamic_volume* dynamic_volume;
  double open_to_world[16];  /**< Transform at shutter open, see cumulet_set_volume_shutter_transforms. All zero:
                                to_world. */
  double close_to_world[16]; /**< Transform at shutter close. All zero: to_world. */
} cumulet_instance_desc;

/**
 * Creates an instance. Add it to viewers with cumulet_add_instance.
 *
 * Threads: any thread. No GL.
 *
 * @param desc       Content, transform and medium.
 * @param out        Receives the instance, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for more than one content, an unsuitable transform or medium,
 *         and a motion that flattens the volume in between.
 */
CUMULET_API cumulet_status cumulet_instance_create(const cumulet_instance_desc* desc, cumulet_instance** out,
                                                   char* error, size_t error_size);
/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param instance May be NULL.
 * @return instance.
 */
CUMULET_API cumulet_instance* cumulet_instance_retain(cumulet_instance* instance);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param instance May be NULL.
 */
CUMULET_API void cumulet_instance_release(cumulet_instance* instance);
/**
 * Replaces all properties of an instance except its ramps and its clip. A previous transform
 * (cumulet_instance_set_previous) ends.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param desc     The new properties.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for the causes of cumulet_instance_create; nothing changes
 *         then.
 */
CUMULET_API cumulet_status cumulet_instance_set(cumulet_instance* instance, const cumulet_instance_desc* desc);
/**
 * Sets the transform of an instance, and ends its motion while the shutter is open.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param to_world Affine and invertible. All zero: identity.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable matrix.
 */
CUMULET_API cumulet_status cumulet_instance_set_to_world(cumulet_instance* instance, const double to_world[16]);
/**
 * Sets a ramp for this instance only, with the rules of cumulet_set_ramp.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param ramp     The grid.
 * @param points   count pairs x, y: x strictly ascending and within 1e30, y from 0 to 1e30. Copied.
 * @param count    2 to 32 pairs. 0, the default: no ramp.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_instance_set_ramp(cumulet_instance* instance, cumulet_ramp ramp, const float* points,
                                                     uint64_t count);
/**
 * Sets a color ramp for this instance only, with the rules of cumulet_set_color_ramp.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param ramp     The grid.
 * @param stops    count groups x, r, g, b as for cumulet_set_color_ramp. Copied.
 * @param count    2 to 32 groups. 0, the default: no color ramp.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_instance_set_color_ramp(cumulet_instance* instance, cumulet_ramp ramp,
                                                           const float* stops, uint64_t count);
/**
 * Clips this instance only, with the rules of cumulet_set_clip.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param desc     The clip; copied. NULL: none, the default.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for the causes of cumulet_set_clip; nothing changes then.
 */
CUMULET_API cumulet_status cumulet_instance_set_clip(cumulet_instance* instance, const cumulet_clip_desc* desc);
/**
 * Shows an instance in a viewer, and follows its changes.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param instance The instance, which is retained.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows it already.
 */
CUMULET_API cumulet_status cumulet_add_instance(cumulet_viewer* viewer, cumulet_instance* instance);
/**
 * Stops showing an instance in a viewer.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param instance The instance.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer does not show it.
 */
CUMULET_API cumulet_status cumulet_remove_instance(cumulet_viewer* viewer, cumulet_instance* instance);
/**
 * Returns the state of an instance's sequence in a viewer. Ready frames are those of all instances that share it.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param instance The instance.
 * @param info     Receives the state; its struct_size must be set.
 * @param states   Receives a cumulet_frame_state per frame. May be NULL.
 * @param count    Elements at states, at least info->frames.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer does not show the instance, or it is hidden or
 *         has no sequence.
 */
CUMULET_API cumulet_status cumulet_get_instance_sequence_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                              cumulet_sequence_info* info, uint8_t* states,
                                                              size_t count);
/**
 * Returns why a frame of an instance's sequence failed.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param instance The instance.
 * @param frame    The frame, from 0.
 * @param cause    Receives one line that names the file, zero-terminated and cut to fit; "" if the frame did not fail.
 * @param size     Bytes at cause, at least 1.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer does not show the instance, it is hidden or has
 *         no sequence, or the sequence has no such frame.
 */
CUMULET_API cumulet_status cumulet_get_instance_sequence_frame(cumulet_viewer* viewer, cumulet_instance* instance,
                                                               uint32_t frame, char* cause, size_t size);
/**
 * Returns the update numbers of an instance's dynamic volume in a viewer.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param instance The instance.
 * @param info     Receives the numbers; its struct_size must be set.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer does not show the instance, or it is hidden or
 *         has no dynamic volume.
 */
CUMULET_API cumulet_status cumulet_get_instance_dynamic_volume_info(cumulet_viewer* viewer, cumulet_instance* instance,
                                                                    cumulet_dynamic_volume_info* info);

/* ---- Models: surfaces beside the viewer's own -------------------------------------------------------------------- */

/**
 * A model: surfaces with a transform, at a time of an animation and with a material variant. Ended by
 * cumulet_model_release.
 *
 * - Models may share surfaces, which are in memory once per time and variant.
 * - A viewer follows changes in its next call. A new transform uploads a matrix and no triangle. A new time poses the
 *   surfaces on a worker, and the last pose is shown until then.
 * - Models take part in light transport like the viewer's own surfaces, previews draw them, and their emissive
 *   triangles and analytic lights move with them. Intensities of analytic lights do not depend on the scale of the
 *   transform.
 */
typedef struct cumulet_model cumulet_model;

/** Content, transform and pose of a model. */
typedef struct cumulet_model_desc {
  size_t struct_size;
  cumulet_surfaces* surfaces; /**< Retained. NULL: none. */
  double to_world[16];        /**< Affine and invertible, from the surfaces' own world space to the scene's. All zero:
                                   identity. */
  double time;                /**< Seconds into the animation; past its end it starts again. */
  uint32_t animation;         /**< Number of the animation in the file. One that does not exist: no animation. */
  uint32_t variant;           /**< Material variant with index variant - 1. 0, or one that does not exist: none. */
  int32_t double_sided;       /**< 1: all materials show both sides and emit from both. 0: as the file says. */
  int32_t hidden;             /**< 1: the model is not rendered. */
  /** 1: invisible to cameras, picks and AOVs. It still casts shadows, reflects light and emits. */
  int32_t shadow_only;
  uint64_t tag;   /**< The host's own number, which cumulet_pick returns. */
  uint32_t group; /**< Light group of its emissive triangles and analytic lights, below CUMULET_LIGHT_GROUPS. */
  /** 1: camera rays see a holdout, see cumulet_medium_desc.holdout. Rasterization leaves it out. */
  int32_t holdout;
  double open_to_world[16];  /**< Transform at shutter open, see cumulet_set_volume_shutter_transforms. All zero:
                                to_world. The animation continues meanwhile. */
  double close_to_world[16]; /**< Transform at shutter close. All zero: to_world. */
} cumulet_model_desc;

/**
 * Creates a model. Add it to viewers with cumulet_add_model.
 *
 * Threads: any thread. No GL.
 *
 * @param desc       Content, transform and pose.
 * @param out        Receives the model, which the caller releases; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable transform, and a motion that flattens the
 *         model in between.
 */
CUMULET_API cumulet_status cumulet_model_create(const cumulet_model_desc* desc, cumulet_model** out, char* error,
                                                size_t error_size);
/**
 * Adds a reference. Threads: any thread, also inside callbacks.
 *
 * @param model May be NULL.
 * @return model.
 */
CUMULET_API cumulet_model* cumulet_model_retain(cumulet_model* model);
/**
 * Removes a reference; the last one ends the handle. Threads: any thread, also inside callbacks.
 *
 * @param model May be NULL.
 */
CUMULET_API void cumulet_model_release(cumulet_model* model);
/**
 * Replaces all properties of a model. A previous transform and time (cumulet_model_set_previous) end.
 *
 * Threads: any thread; runs update callbacks of viewers that show the model. No GL.
 *
 * @param model The model.
 * @param desc  The new properties.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for the causes of cumulet_model_create; nothing changes then.
 */
CUMULET_API cumulet_status cumulet_model_set(cumulet_model* model, const cumulet_model_desc* desc);
/**
 * Sets the transform of a model, and ends its motion while the shutter is open.
 *
 * Threads: any thread; runs update callbacks of viewers that show the model. No GL.
 *
 * @param model    The model.
 * @param to_world Affine and invertible. All zero: identity.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable matrix.
 */
CUMULET_API cumulet_status cumulet_model_set_to_world(cumulet_model* model, const double to_world[16]);
/**
 * Sets the time of a model's animation.
 *
 * Threads: any thread; runs update callbacks of viewers that show the model. No GL.
 *
 * @param model The model.
 * @param time  Seconds into the animation.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_model_set_time(cumulet_model* model, double time);
/**
 * Shows a model in a viewer, and follows its changes.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param model  The model, which is retained.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer shows it already.
 */
CUMULET_API cumulet_status cumulet_add_model(cumulet_viewer* viewer, cumulet_model* model);
/**
 * Stops showing a model in a viewer.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param model  The model.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the viewer does not show it.
 */
CUMULET_API cumulet_status cumulet_remove_model(cumulet_viewer* viewer, cumulet_model* model);

/** @} */

/**
 * @addtogroup cumulet_settings
 * @{
 */

/**
 * Sets the sun and the sky.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The light.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_sun_sky(cumulet_viewer* viewer, const cumulet_sun_sky_desc* desc);
/**
 * Sets the rotation and strength of the viewer's environment.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_environment_settings(cumulet_viewer* viewer,
                                                            const cumulet_environment_settings_desc* desc);
/**
 * Sets the ground plane.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The ground.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_ground(cumulet_viewer* viewer, const cumulet_ground_desc* desc);

/* ---- Analytic lights --------------------------------------------------------------------------------------------- */

/** The shape of an analytic light. */
typedef enum cumulet_light_kind {
  CUMULET_LIGHT_POINT = 0,  /**< Point light: the same in all directions. */
  CUMULET_LIGHT_SPOT = 1,   /**< Spot light: a point light limited to a cone. */
  CUMULET_LIGHT_DISK = 2,   /**< Disk-shaped area light: uniform radiance on one side. */
  CUMULET_LIGHT_RECT = 3,   /**< Rectangular area light: uniform radiance on one side. */
  CUMULET_LIGHT_DISTANT = 4 /**< Distant (directional) light. */
} cumulet_light_kind;

/**
 * An analytic light. It lights volume and surfaces, casts shadows, and is invisible to the camera and in mirrors.
 *
 * Its power is radiant, as in Blender. A point light of 4 pi I watts equals a glTF point light of I candela, which
 * Cumulet reads as I W/sr. A spot light has the power of the point light that it is cut out of. A disk or rectangle has
 * radiance power / (4 x area), and so emits pi / 4 of its power.
 */
typedef struct cumulet_light_desc {
  size_t struct_size; /**< Equal for all lights of an array: the distance between them in bytes. */
  cumulet_light_kind kind;
  double position[3];   /**< World position of its center, within 1e30. Not used by a sun. */
  double direction[3];  /**< World direction in which it shines, of any length. Not used by a point. Zero: down, -Y. */
  double tangent[3];    /**< Tangent of a rectangle: the direction of its width, projected perpendicular to direction.
                            Zero or parallel to direction: horizontal, or +X if it shines up or down. */
  float color[3];       /**< Linear Rec. 709, multiplied by power; the product is at most 1e30. All 0: white. */
  float power;          /**< Watts; for a sun W/m^2 on a surface that faces it. 0: dark. */
  double width;         /**< World units: width of a rectangle, diameter of a disk; up to 1e30. 0: 1. */
  double height;        /**< World units: height of a rectangle; up to 1e30. 0: 1. */
  double angle_degrees; /**< Spot: full cone angle, up to 180; 0: 45. Sun: angular diameter, up to 90. */
  double blend;         /**< Spot: fraction of the cone, from its edge inward, over which it fades; 0 to 1. */
  uint32_t group;       /**< Light group, below CUMULET_LIGHT_GROUPS. */
} cumulet_light_desc;

/**
 * Replaces the viewer's analytic lights. Those of its surfaces' file stay beside them. Rasterized surfaces (of
 * previews, and with CUMULET_SURFACE_LIGHTING_RASTERIZED) are lit without shadows, and from the centers of disks and
 * rectangles. Restarts accumulation.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param lights The lights, which are copied. May be NULL if count is 0.
 * @param count  Number of lights, up to 4096. 0: none.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT; the line names the light.
 */
CUMULET_API cumulet_status cumulet_set_lights(cumulet_viewer* viewer, const cumulet_light_desc* lights, uint64_t count);

/**
 * Sets how images are sampled.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_sampling(cumulet_viewer* viewer, const cumulet_sampling_desc* desc);
/**
 * Returns the pixels of a region (cumulet_sampling_desc.region). It has at least one pixel. Regions that share an edge
 * share no pixel and leave none out.
 *
 * Threads: any thread. No GL.
 *
 * @param region x, y, width and height as fractions of the image, each in [0, 1].
 * @param width  Width of the image in pixels, 1 to 16384.
 * @param height Height of the image in pixels, 1 to 16384.
 * @param pixels Receives x, y, width and height in pixels.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_region_pixels(const float region[4], uint32_t width, uint32_t height,
                                                 uint32_t pixels[4]);
/**
 * Sets how images are displayed.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_display(cumulet_viewer* viewer, const cumulet_display_desc* desc);

/** The curve before the lattice of a display LUT. It maps exposed linear Rec. 709 radiance. */
typedef enum cumulet_lut_shaper {
  CUMULET_LUT_SHAPER_LINEAR = 0, /**< Radiance itself. */
  CUMULET_LUT_SHAPER_LOG2 = 1,   /**< log2 of radiance, as of OpenColorIO's allocation lg2. 0 is below each domain. */
  CUMULET_LUT_SHAPER_SRGB = 2    /**< The sRGB curve. */
} cumulet_lut_shaper;

/** A display transform of the host: a shaper per channel, and a lattice of colors, for example by OpenColorIO. */
typedef struct cumulet_display_lut_desc {
  size_t struct_size;
  /**
   * Color of each lattice point, 3 floats, red fastest, then green, then blue. Encoded as for an sRGB display;
   * interpolated (tetrahedral), then clamped to [0, 1].
   */
  const float* values;
  uint64_t value_count; /**< 3 x size^3. */
  uint32_t size;        /**< Points per axis, 2 to 65; mostly 17, 33 or 65. */
  cumulet_lut_shaper shaper;
  /**
   * Shaped values at the first and at the last point of an axis, -1e6 to 1e6; values beyond are clamped to them. Both
   * 0: 0 and 1.
   */
  float domain_min;
  float domain_max;
} cumulet_display_lut_desc;

/**
 * Sets or removes a display LUT, which replaces tone_map of cumulet_display_desc and the sRGB encoding in all displayed
 * images: frames, cumulet_read_display and cumulet_encode_display. exposure_stops is applied before. A change does not
 * restart accumulation.
 *
 * - CUMULET_COLOR_LINEAR and CUMULET_COLOR_SRGB_FRAMEBUFFER get its colors decoded by the sRGB curve.
 * - CUMULET_COLOR_HDR and debug views do not use it.
 * - With a transparent background, a pixel's color is that of its radiance over black. Black must stay black, or
 *   transparent pixels get color.
 * - It takes 16 bytes per lattice point of GL memory.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The LUT, which is copied. NULL: none.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_display_lut(cumulet_viewer* viewer, const cumulet_display_lut_desc* desc);

/** @} */

/* ---- Camera and input -------------------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_cameras Cameras and input
 *
 * Cameras may be shared by viewers; each viewer is created with one of its own. A viewer follows changes of its camera.
 * An operation on a camera that still waits to be fitted to the scene (cumulet_camera_desc) does nothing, except
 * cumulet_camera_frame, which places it.
 * @{
 */

/** The meaning of depth buffers. */
typedef enum cumulet_depth_convention {
  CUMULET_DEPTH_STANDARD = 0, /**< 0 at the near plane, 1 at the far plane. */
  CUMULET_DEPTH_REVERSED = 1  /**< 1 at the near plane, 0 at the far plane. */
} cumulet_depth_convention;

/** The range of clip-space z. */
typedef enum cumulet_clip_space {
  CUMULET_CLIP_NEGATIVE_ONE_TO_ONE = 0, /**< OpenGL's default. */
  CUMULET_CLIP_ZERO_TO_ONE = 1          /**< As with glClipControl(..., GL_ZERO_TO_ONE). */
} cumulet_clip_space;

/**
 * A perspective or orthographic camera, with a pinhole or a thin lens.
 *
 * If eye equals target, the first viewer that renders through the camera with content places it once, so that it fits
 * the visible scene from +Z and a little above. Visible are triangles, and the volume where, with the medium of that
 * time, its opacity is at least 5 % or its emission 1 % of the brightest. If it is nowhere, its bounding box is used.
 * At least 6 % of the image's shorter side stay free on each side.
 *
 * Near and far plane do not clip the volume. They define depth buffers, d = f (z - n) / (z (f - n)), reversed 1 - d;
 * and an orthographic ray starts at the near plane.
 *
 * With a lens, a point at depth z is blurred to a disk of radius lens_radius x |z - focus| / z in the focal plane.
 * Path-traced images and AOVs have depth of field. Rasterized surfaces (of previews, and with
 * CUMULET_SURFACE_LIGHTING_RASTERIZED), debug views, picks and depths use the center of the lens. The host's depth ends
 * rays as if they came from there.
 */
typedef struct cumulet_camera_desc {
  size_t struct_size;
  double eye[3];              /**< World position, each number within 1e30. */
  double target[3];           /**< World position of the center of orbiting, each number within 1e30. */
  double up[3];               /**< World direction. All 0: +Y. */
  double fovy_degrees;        /**< Vertical field of view, 0.01 to 175. 0: 40. */
  double orthographic_height; /**< World units from bottom to top of the image, 1e-30 to 1e30. 0: perspective. */
  double near_plane;          /**< Distance from the eye, up to 1e30; may be negative if orthographic. 0: 0.1 for
                                   perspective, 0 for orthographic. */
  double far_plane;           /**< Beyond the near plane. 0: infinite for perspective, 1000 x orthographic_height for
                                   orthographic. */
  cumulet_depth_convention depth;
  double lens_radius;    /**< World units, 0 to 1e30: a round thin lens. 0: a pinhole, everything is sharp. */
  double focus_distance; /**< From the eye along the axis to the focal plane, 0 to 1e30. 0: the target's distance. */
} cumulet_camera_desc;

/**
 * Creates a camera.
 *
 * Threads: any thread. No GL.
 *
 * @param desc The camera.
 * @param out  Receives the camera, which the caller releases; NULL on failure.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT, also for an eye and target closer than 1e-30 but not equal.
 */
CUMULET_API cumulet_status cumulet_camera_create(const cumulet_camera_desc* desc, cumulet_camera** out);
/**
 * Ends a camera handle. Viewers that use the camera keep it alive. Threads: any thread, also inside callbacks.
 *
 * @param camera May be NULL.
 */
CUMULET_API void cumulet_camera_release(cumulet_camera* camera);
/**
 * Sets the camera of a viewer.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param camera The camera, which the viewer keeps alive.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_camera(cumulet_viewer* viewer, cumulet_camera* camera);
/**
 * Returns the camera of a viewer.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param out    Receives a new handle of the camera, which the caller releases.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_camera(cumulet_viewer* viewer, cumulet_camera** out);

/**
 * Sets the camera of the previous frame, for motion vectors (CUMULET_AOV_MOTION and CUMULET_AOV_VOLUME_MOTION) only.
 *
 * Each frame, the host sets here the camera that it used as the present one in the frame before; it does the same with
 * the other ..._previous functions. An object without previous state has not moved. A change restarts accumulation.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer  The viewer.
 * @param camera  The previous camera, kept alive; its changes are followed. NULL: the camera has not moved.
 * @param seconds Time from the previous frame to this one, -1e9 to 1e9. Volumes move with their velocity for this time.
 *                Negative: the other frame is in the future.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_previous_camera(cumulet_viewer* viewer, cumulet_camera* camera, double seconds);
/**
 * Sets the instance transforms of the viewer's volume (cumulet_set_volume_transforms) in the previous frame, for motion
 * vectors.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer   The viewer.
 * @param to_world count matrices, for the first count transforms; the others have not moved.
 * @param count    Number of matrices. 0: none has moved.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for a matrix that cumulet_set_volume_transforms refuses.
 */
CUMULET_API cumulet_status cumulet_set_previous_volume_transforms(cumulet_viewer* viewer, const double* to_world,
                                                                  uint32_t count);
/**
 * Sets the transform of an instance in the previous frame, for motion vectors. It holds until cumulet_instance_set.
 *
 * Threads: any thread; runs update callbacks of viewers that show the instance. No GL.
 *
 * @param instance The instance.
 * @param to_world Affine and invertible. NULL: it has not moved.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable matrix.
 */
CUMULET_API cumulet_status cumulet_instance_set_previous(cumulet_instance* instance, const double* to_world);
/**
 * Sets the transform and the animation time of a model in the previous frame, for motion vectors. Both hold until
 * cumulet_model_set. The model is posed at that time, too.
 *
 * Threads: any thread; runs update callbacks of viewers that show the model. No GL.
 *
 * @param model    The model.
 * @param to_world Affine and invertible. NULL: its transform has not changed.
 * @param time     Seconds into the animation. NULL: its pose has not changed.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable matrix or time.
 */
CUMULET_API cumulet_status cumulet_model_set_previous(cumulet_model* model, const double* to_world, const double* time);

/**
 * Replaces a camera's description.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param desc   The new description.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT for the causes of cumulet_camera_create.
 */
CUMULET_API cumulet_status cumulet_camera_set(cumulet_camera* camera, const cumulet_camera_desc* desc);
/**
 * Returns a camera's description. For a camera that a viewer has fitted to its scene, it is the resulting one; after
 * cumulet_camera_set_matrices, the nearest one.
 *
 * Threads: any thread. No GL.
 *
 * @param camera The camera.
 * @param desc   Receives the description; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_camera_get(const cumulet_camera* camera, cumulet_camera_desc* desc);
/**
 * Sets a camera from the host's own matrices. The depth convention is taken from the projection; a lens is kept. Camera
 * operations continue from the nearest cumulet_camera_desc.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera     The camera.
 * @param view       World to eye space: a rotation and a translation.
 * @param projection Any perspective (also off-axis, infinite or reversed) or orthographic projection.
 * @param clip       The clip-space range that the projection was made for.
 * @return CUMULET_OK; or CUMULET_ERROR_INVALID_ARGUMENT for a view that scales, shears or mirrors, for a projection
 *         that is singular, rotates the image or has an oblique near plane, and for entries beyond 1e30.
 */
CUMULET_API cumulet_status cumulet_camera_set_matrices(cumulet_camera* camera, const double view[16],
                                                       const double projection[16], cumulet_clip_space clip);
/**
 * Sets a camera at shutter open and shutter close, for motion blur (cumulet_sampling_desc.shutter_seconds). Both hold
 * until another call moves the camera. In between the eye moves straight, the axes rotate evenly about one axis
 * (quaternion slerp), and the image's extent (at unit distance, or the orthographic height) changes evenly. Depth
 * planes, lens and focus distance are those of the camera itself.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param open   The camera at shutter open. NULL: as at the frame time.
 * @param close  The camera at shutter close. NULL: as at the frame time.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if one is perspective and the other orthographic, or if its eye
 *         equals its target.
 */
CUMULET_API cumulet_status cumulet_camera_set_shutter(cumulet_camera* camera, const cumulet_camera_desc* open,
                                                      const cumulet_camera_desc* close);
/**
 * Returns the matrices of a camera, for the host's own drawing and gizmos. After cumulet_camera_set_matrices they are
 * the host's own for any aspect ratio, except for the clip-space range.
 *
 * Threads: any thread. No GL.
 *
 * @param camera     The camera.
 * @param aspect     Aspect ratio of the image (width / height), 1e-6 to 1e6.
 * @param clip       The clip-space range of the projection.
 * @param view       Receives world to eye space.
 * @param projection Receives eye to clip space.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_camera_get_matrices(const cumulet_camera* camera, double aspect,
                                                       cumulet_clip_space clip, double view[16], double projection[16]);

/**
 * Rotates the eye about the target.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param yaw    Angle in radians about the up axis, counterclockwise as seen from above.
 * @param pitch  Angle in radians by which the eye rises; it ends just short of the up axis.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the camera would leave its range.
 */
CUMULET_API cumulet_status cumulet_camera_orbit(cumulet_camera* camera, double yaw, double pitch);
/**
 * Rotates the view direction about the eye.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param yaw    Angle in radians about the up axis, counterclockwise as seen from above.
 * @param pitch  Angle in radians by which the view direction rises; it ends just short of the up axis.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the camera would leave its range.
 */
CUMULET_API cumulet_status cumulet_camera_look(cumulet_camera* camera, double yaw, double pitch);
/**
 * Rotates the camera about its view direction.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param angle  Angle in radians, clockwise as seen from behind the camera.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the camera would leave its range.
 */
CUMULET_API cumulet_status cumulet_camera_roll(cumulet_camera* camera, double angle);
/**
 * Moves eye and target parallel to the image, so that the scene moves by these amounts in the image.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param right  Motion of the scene to the right, as a fraction of the image's height at the target.
 * @param up     Motion of the scene upwards, as a fraction of the image's height at the target.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the camera would leave its range.
 */
CUMULET_API cumulet_status cumulet_camera_pan(cumulet_camera* camera, double right, double up);
/**
 * Multiplies the distance from the eye to the target; an orthographic height changes with it. The distance stays within
 * 1e-12 and 1e12.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera The camera.
 * @param factor The factor, above 0.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_camera_dolly(cumulet_camera* camera, double factor);
/**
 * Moves eye and target along the camera's own axes.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera  The camera.
 * @param right   World units to the right.
 * @param up      World units upwards.
 * @param forward World units along the view direction.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if the camera would leave its range.
 */
CUMULET_API cumulet_status cumulet_camera_fly(cumulet_camera* camera, double right, double up, double forward);
/**
 * Moves the camera so that a box just fills the image. The view direction does not change.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param camera  The camera.
 * @param box_min Lowest world corner, each number within 1e30.
 * @param box_max Highest world corner, not below box_min.
 * @param aspect  Aspect ratio of the image (width / height), 1e-6 to 1e6.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_camera_frame(cumulet_camera* camera, const double box_min[3],
                                                const double box_max[3], double aspect);
/**
 * Moves the viewer's camera so that it fits the visible volume and triangles, with the margin that cumulet_camera_desc
 * describes. The view direction does not change. Takes some milliseconds.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_frame_all(cumulet_viewer* viewer);

/**
 * Mouse and keyboard preset. In all presets: wheel, + and - dolly; arrow keys orbit by 15 degrees (with shift: pan); F,
 * Home and keypad period frame all.
 */
typedef enum cumulet_navigation_style {
  CUMULET_NAVIGATION_SIMPLE = 0,  /**< Left: orbit; middle, or shift + left: pan; right: dolly. */
  CUMULET_NAVIGATION_BLENDER = 1, /**< Middle: orbit; shift + middle: pan; ctrl + middle: dolly; keypad 1, 3, 7: front,
                                       right, top (ctrl: the opposite); keypad 5: perspective or orthographic; keypad 2,
                                       4, 6, 8: orbit. */
  CUMULET_NAVIGATION_MAYA = 2     /**< Alt + left: orbit; alt + middle: pan; alt + right: dolly. */
} cumulet_navigation_style;

/** How input moves the viewer's camera. */
typedef struct cumulet_navigation_desc {
  size_t struct_size;
  cumulet_navigation_style style;
  int32_t fly;                         /**< 1: any button looks around, W A S D E Q move, shift is faster. */
  double speed;                        /**< Factor for all motion, 0 to 1e6. 0: 1. */
  double turntable_degrees_per_second; /**< The camera orbits the target while frames are rendered, -3600 to 3600. 0:
                                            off. */
} cumulet_navigation_desc;

/**
 * Sets how cumulet_input moves the viewer's camera.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer.
 * @param desc   The settings.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_set_navigation(cumulet_viewer* viewer, const cumulet_navigation_desc* desc);

/** The kind of an input event. */
typedef enum cumulet_event_type {
  CUMULET_EVENT_POINTER_MOVE = 0,
  CUMULET_EVENT_BUTTON_DOWN = 1,
  CUMULET_EVENT_BUTTON_UP = 2,
  CUMULET_EVENT_WHEEL = 3,
  CUMULET_EVENT_KEY_DOWN = 4,
  CUMULET_EVENT_KEY_UP = 5,
  CUMULET_EVENT_FOCUS_LOST = 6 /**< Releases all buttons and keys. */
} cumulet_event_type;

/** A mouse button. */
typedef enum cumulet_button {
  CUMULET_BUTTON_LEFT = 0,
  CUMULET_BUTTON_MIDDLE = 1,
  CUMULET_BUTTON_RIGHT = 2
} cumulet_button;

/** A key. Letters and digits are their upper-case ASCII codes ('A', '7'). */
typedef enum cumulet_key {
  CUMULET_KEY_NONE = 0,
  CUMULET_KEY_HOME = 256,
  CUMULET_KEY_KEYPAD_0 = 260, /**< Up to CUMULET_KEY_KEYPAD_0 + 9 for keypad 9. */
  CUMULET_KEY_KEYPAD_PERIOD = 270,
  CUMULET_KEY_LEFT = 280,
  CUMULET_KEY_RIGHT = 281,
  CUMULET_KEY_UP = 282,
  CUMULET_KEY_DOWN = 283
} cumulet_key;

/** Bits of cumulet_event.modifiers. */
enum { CUMULET_MODIFIER_SHIFT = 1, CUMULET_MODIFIER_CTRL = 2, CUMULET_MODIFIER_ALT = 4 };

/** An input event. Fields that its type does not use are ignored. */
typedef struct cumulet_event {
  size_t struct_size;
  cumulet_event_type type;
  double x; /**< Pointer position in physical pixels from the image's top left, within 1e9: pointer, button and wheel
                 events. */
  double y;
  double wheel; /**< Steps, within 1e4; positive: towards the scene. */
  cumulet_button button;
  int32_t key;        /**< A cumulet_key or an ASCII code; others are not handled. */
  uint32_t modifiers; /**< CUMULET_MODIFIER_* bits at the time of this event. */
} cumulet_event;

/**
 * Passes one input event to the viewer, which may move its camera.
 *
 * Threads: any thread; runs update callbacks of viewers that use the camera. No GL.
 *
 * @param viewer  The viewer.
 * @param event   The event.
 * @param handled Receives 1 if the event was used, otherwise 0. May be NULL.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_input(cumulet_viewer* viewer, const cumulet_event* event, int32_t* handled);

/** @} */

/* ---- Frames ------------------------------------------------------------------------------------------------------ */

/**
 * @defgroup cumulet_frames Frames
 *
 * A host calls cumulet_render once per frame, with a time budget and a target. cumulet_warm_up compiles shader programs
 * before the first frame.
 * @{
 */

/** The target of a frame. */
typedef enum cumulet_frame_target {
  CUMULET_TARGET_FRAMEBUFFER = 0, /**< The host's framebuffer cumulet_frame_desc.framebuffer. */
  CUMULET_TARGET_TEXTURE = 1,     /**< Textures of the viewer, returned in cumulet_frame_result. */
  CUMULET_TARGET_NONE = 2         /**< Nothing is drawn: for readback. */
} cumulet_frame_target;

/**
 * The encoding of the target's colors. The first three take tone-mapped colors. A format that cannot hold the encoding
 * gives CUMULET_ERROR_INVALID_ARGUMENT. For windows (framebuffer 0) this is not checked, because drivers other than
 * Mesa do not report reliably whether they are sRGB.
 */
typedef enum cumulet_color_encoding {
  CUMULET_COLOR_SRGB = 0,             /**< sRGB, encoded by the library, for formats that store values unchanged
                                            (GL_RGBA8). */
  CUMULET_COLOR_SRGB_FRAMEBUFFER = 1, /**< sRGB, encoded by GL (GL_FRAMEBUFFER_SRGB), for sRGB formats
                                            (GL_SRGB8_ALPHA8). */
  CUMULET_COLOR_LINEAR = 2,           /**< Tone-mapped but not encoded: the host encodes later. */
  CUMULET_COLOR_HDR = 3               /**< Radiance x exposure, neither tone-mapped nor encoded, for float formats. */
} cumulet_color_encoding;

/**
 * How the image is combined with the target's content. Color and alpha are premultiplied: exposure, tone map and
 * encoding are applied to the premultiplied radiance, so that over black a transparent image has the colors of the
 * opaque one.
 *
 * - With CUMULET_COLOR_LINEAR, CUMULET_COLOR_HDR and CUMULET_COLOR_SRGB_FRAMEBUFFER, blending adds light. Alpha is
 *   the coverage of the pixel, 0 where it only emits, and color + (1 - alpha) x target is correct over any target.
 * - With CUMULET_COLOR_SRGB, blending adds encoded values. Alpha is then the weight with which the blend is correct
 *   over black and over white. In between it is correct within 0.1 for gray pixels; colored flames are up to 0.3 too
 *   bright in a channel over middle gray.
 */
typedef enum cumulet_blend_mode {
  CUMULET_BLEND_OVER = 0,   /**< Premultiplied over the target's content. */
  CUMULET_BLEND_REPLACE = 1 /**< Color and alpha replace it, for a host that composites by itself. */
} cumulet_blend_mode;

/** The GL object that holds the depth of the host's scene. */
typedef enum cumulet_depth_source {
  CUMULET_DEPTH_SOURCE_NONE = 0,
  CUMULET_DEPTH_SOURCE_TEXTURE = 1,             /**< A GL_TEXTURE_2D of a depth format, or of GL_R32F. */
  CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE = 2, /**< A GL_TEXTURE_2D_MULTISAMPLE of a depth format. */
  CUMULET_DEPTH_SOURCE_FRAMEBUFFER = 3          /**< The depth attachment of a framebuffer, which is copied. */
} cumulet_depth_source;

/** A frame: its time budget, its target, and the depth of the host's scene. */
typedef struct cumulet_frame_desc {
  size_t struct_size;
  double budget_ms; /**< Milliseconds for uploads, tracing and drawing, up to 1e9. 0: 10. Negative: draw the present
                         image, trace nothing. */

  cumulet_frame_target target;
  /**
   * GL name of a framebuffer; 0 is the context's default framebuffer. Its draw buffer 0 is drawn to. These give
   * CUMULET_ERROR_INVALID_ARGUMENT:
   *
   * - a framebuffer that is incomplete or smaller than width x height
   * - no color attachment, or one with integers or without green or blue
   * - layered attachments
   * - no depth attachment if write_depth is 1
   */
  uint32_t framebuffer;
  uint32_t width; /**< Width of the whole target in pixels, 0 to 16384. With 0 nothing is drawn. */
  uint32_t height;
  int32_t viewport[4]; /**< x, y, width and height in the target, as in glViewport. All zero: the whole target. */
  int32_t flip_y;      /**< 0: the image's top row is at the largest y, as in OpenGL. 1: at y = 0. */
  double scale;        /**< Physical pixels per logical pixel, 0.1 to 16, for widths of lines and clicks. 0: 1. */
  /**
   * Internal format of the viewer's own textures: GL_RGBA8, GL_SRGB8_ALPHA8, GL_RGBA16F or GL_RGBA32F, which must suit
   * color. 0: GL_RGBA16F for CUMULET_COLOR_HDR, GL_SRGB8_ALPHA8 for CUMULET_COLOR_SRGB_FRAMEBUFFER, else GL_RGBA8.
   */
  uint32_t format;
  cumulet_color_encoding color;
  cumulet_blend_mode blend;
  int32_t write_depth; /**< 1: where the volume is at least half opaque, its depth is written to the target's depth, in
                            the camera's convention and with a depth test. */

  cumulet_depth_source depth_source; /**< Depth of the host's scene, in the camera's convention, which occludes the
                                          volume behind it. */
  /**
   * GL name of the texture or framebuffer. It has the size of the viewport; or it is larger, with the size of the
   * target, and the viewport's rectangle is used.
   */
  uint32_t depth_name;
  int32_t depth_flip_y;    /**< As flip_y, for the host's depth. */
  int32_t depth_unchanged; /**< 1: the depth is that of the last frame, and accumulation continues. 0: it is
                                compared, and pixels are traced again where it differs. */
} cumulet_frame_desc;

/** Bits of cumulet_frame_result.flags. */
enum {
  CUMULET_RENDER_INCOMPLETE = 1, /**< Work is left, on the image or in transfer: render again soon. */
  CUMULET_RENDER_CONVERGED = 2,  /**< Every pixel has its samples, at full resolution, for the newest settings. */
  CUMULET_RENDER_LOADING = 4,    /**< Workers are busy, see cumulet_get_progress. */
  CUMULET_RENDER_FAILED = 8,     /**< A load or build failed, see @ref cumulet_errors and cumulet_get_progress. */
  CUMULET_RENDER_PREVIEW = 16,   /**< The displayed image is coarser than the frame. */
  /**
   * After a frame with CUMULET_TARGET_NONE: there is a newer image than the one drawn last. If it is not set, drawing
   * again gives the same image unless display settings changed.
   */
  CUMULET_RENDER_NEW_IMAGE = 32,
  /**
   * The image that was drawn last is denoised, see cumulet_display_desc.denoise. Not set while the first samples of an
   * image are shown before the filter is done.
   */
  CUMULET_RENDER_DENOISED = 64
};

/** The result of a frame. */
typedef struct cumulet_frame_result {
  size_t struct_size;
  uint32_t flags;   /**< CUMULET_RENDER_* bits. */
  double progress;  /**< Part of the work for the newest settings that is done, including previews, 0 to 1. */
  uint32_t width;   /**< Size of the displayed image: less than the frame's in a preview, 0 if there is none. */
  uint32_t height;  /**< Height of the displayed image. */
  uint32_t texture; /**< CUMULET_TARGET_TEXTURE: GL name, valid until the next cumulet_render or detach. */
  /**
   * CUMULET_TARGET_TEXTURE with write_depth: GL name of a GL_DEPTH_COMPONENT32F texture, valid until the next
   * cumulet_render or detach.
   */
  uint32_t depth_texture;
} cumulet_frame_result;

/**
 * [GL] Renders one frame: takes results of the workers, uploads and traces for about budget_ms in bounded dispatches,
 * and draws the newest image.
 *
 * - If a part of the frame fails, the rest is still drawn, with the previous data. The first failure is returned once;
 *   more go to the log. Later frames do not retry it until a setting changes.
 * - The call waits for no result of the device. At most three dispatches are in flight when it returns. The time of the
 *   host's own queued commands is not counted and not waited for.
 * - A dispatch is submitted if it will probably end within the budget, by the worst times measured for its kind. The
 *   smallest work of a frame (some rounds of 1024 pixels) takes a few milliseconds on software drivers. The first
 *   dispatch of a kind waits for the driver's compiler; cumulet_warm_up avoids that.
 * - Mesa's llvmpipe runs dispatches within the call, on the cores that the host's drawing uses. It also waits for the
 *   host's drawing into a depth texture that the frame names.
 * - Functions that read back wait for the dispatches in flight.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param frame  The frame.
 * @param result Receives the result; its struct_size must be set. May be NULL.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for an unsuitable target or depth; CUMULET_ERROR_UNSUPPORTED or
 *         CUMULET_ERROR_FILE for content that cannot be shown; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_render(cumulet_viewer* viewer, const cumulet_frame_desc* frame,
                                          cumulet_frame_result* result);

/** The programs that cumulet_warm_up compiles. */
typedef enum cumulet_warm_up_scope {
  CUMULET_WARM_UP_SCENE = 0, /**< The programs for frames of the present scene with the present settings. */
  /**
   * The programs of CUMULET_WARM_UP_SCENE and almost all others. The others are compiled but not used, so a driver that
   * compiles more at the first use does that later. Not included are rare programs: for grids beyond the driver's limit
   * of a texture buffer or volumes of more than 32,768 voxels per side, for sets of texture maps that the scene's
   * materials do not have, for light groups, holdouts and motion blur. If one does not build, the call that finishes
   * all others returns its error.
   */
  CUMULET_WARM_UP_ALL = 1
} cumulet_warm_up_scope;

/** The result of one cumulet_warm_up call. */
typedef struct cumulet_warm_up_result {
  size_t struct_size;
  int32_t incomplete; /**< 1: call again. */
  double progress; /**< 0 to 1, never decreasing within one warm-up (until incomplete is 0); 1 when incomplete is 0. */
} cumulet_warm_up_result;

/**
 * [GL] Compiles the shader programs for frames like this one, and uses each once for a tiny image, so that no later
 * frame waits for the driver's compiler. Without it, the frame that first needs a program compiles it. Call it after
 * cumulet_wait, or once per frame, until incomplete is 0:
 *
 *     while (cumulet_warm_up(viewer, &frame, CUMULET_WARM_UP_SCENE, &result) == CUMULET_OK && result.incomplete)
 *       show_bar();
 *
 * - It takes results of the workers and uploads them, as cumulet_render does, so that all programs of the scene are
 *   known. It draws nothing into the frame's target, and reads the frame's depth. For navigation and for
 *   camera-adaptive grids a call counts as a frame.
 * - With CUMULET_TARGET_NONE, or without a size, programs for drawing are left out.
 * - A call works for about budget_ms. A driver without parallel compilation (KHR_parallel_shader_compile) finishes the
 *   program that it compiles, however long that takes.
 * - With parallel compilation, cumulet_render does not wait for programs either: until one is ready it shows the last
 *   image, a coarser one, or only the surfaces. Two cases wait: a viewer's first [GL] call in a context, for one small
 *   program; and a frame that has nothing to show instead (the first one, or one of another encoding).
 * - A failed call ends the warm-up, and the next one starts again. A failed load ends it with incomplete 0.
 * - Programs of other viewers (cumulet_shader_cache) and binaries in a folder are not compiled again.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param frame  A frame like the later ones; its budget_ms must not be negative.
 * @param scope  The programs to compile.
 * @param result Receives the result, unchanged on failure; its struct_size must be set. May be NULL.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, CUMULET_ERROR_UNSUPPORTED, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_warm_up(cumulet_viewer* viewer, const cumulet_frame_desc* frame,
                                           cumulet_warm_up_scope scope, cumulet_warm_up_result* result);

/** @} */

/* ---- Shadows on the host's scene --------------------------------------------------------------------------------- */

/**
 * @defgroup cumulet_maps Shadows on the host's scene
 *
 * A transmittance map is a deep shadow map, by which volumes cast shadows on objects that the host draws itself.
 * @{
 */

/** The light of a transmittance map. */
typedef enum cumulet_map_light {
  CUMULET_MAP_LIGHT_SUN = 0,       /**< The viewer's sun (cumulet_sun_sky_desc), as parallel light. */
  CUMULET_MAP_LIGHT_DIRECTION = 1, /**< Parallel light of the host. */
  CUMULET_MAP_LIGHT_POINT = 2      /**< A point light of the host, outside or inside volumes. */
} cumulet_map_light;

/** A transmittance map that the host requests. */
typedef struct cumulet_transmittance_map_desc {
  size_t struct_size;
  uint32_t slot; /**< Number of the map, 0 to 15; one light each. */
  cumulet_map_light light;
  double direction[3]; /**< CUMULET_MAP_LIGHT_DIRECTION: world direction towards the light, of any length but 0. */
  double position[3];  /**< CUMULET_MAP_LIGHT_POINT: world position, each number within 1e30. */
  uint32_t size;       /**< Width and height in texels, 16 to 4096, at most GL_MAX_3D_TEXTURE_SIZE. 0: 256. */
  uint32_t slices;     /**< Texels along the light's rays, 2 to 256. 0: 32. At most 2^27 texels in all. */
  double budget_ms;    /**< Milliseconds for this call, 0 to 1e9. 0: 2. */
} cumulet_transmittance_map_desc;

/** A transmittance map for the host's shaders. */
typedef struct cumulet_transmittance_map {
  size_t struct_size;
  uint32_t texture; /**< GL name of a GL_TEXTURE_3D, GL_R16F, with linear filtering, clamped to its edges. Valid until
                         the next call for this slot, or detach. */
  uint32_t size;    /**< Its width and height in texels; smaller than requested while the scene changes. */
  uint32_t slices;
  int32_t incomplete;   /**< 1: the map is older than the scene, or coarser than requested: call again. */
  double to_map[16];    /**< Affine. Parallel light: world to texture coordinates. Point light: world to the vector from
                             the light, in world units. Far from the origin, multiply it in double precision with your
                             own matrix to the world, not in the shader. */
  double near_distance; /**< Point light: distance of the center of the first slice. Else 0. */
  double far_distance;  /**< Point light: distance of the center of the last slice. Else 0. */
} cumulet_transmittance_map;

/**
 * [GL] Updates a deep shadow map (Lokovic and Veach 2000) of one light, for shadows of volumes on the host's scene. The
 * map holds the transmittance from the light through all displayed volumes, instances included, to points in front of,
 * inside and behind them. Multiply the light in a surface's shader by
 *
 *     uniform sampler3D map;  uniform mat4 to_map;  uniform vec2 range;  // near_distance, far_distance
 *     float shadow = cumulet_transmittance(map, to_map, range, world);   // cumulet_transmittance_map_glsl()
 *
 * - Call it once per frame and light, after cumulet_render, whose newest upload it uses. While nothing changes, a call
 *   costs nothing.
 * - Values at texel centers are exact, in closed form per cell and without noise, with at most four volumes at one
 *   point. The viewer's surfaces, its ground and the host's depth cast no shadow in the map.
 * - A map is computed within the budget, over several calls if need be; the previous map is returned meanwhile. Before
 *   the first one, and without a volume, the map is one texel of 1 (no shadow).
 * - If the scene changes before a map is done, the next one is coarser, down to 16 texels, so that it follows. When the
 *   scene rests, the map gets its full size.
 * - It takes 2 bytes per texel, twice that while one is computed (256 x 256 x 32: 4 MiB), counted in
 *   cumulet_stats.gl_bytes.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param desc   The request.
 * @param map    Receives the map, unchanged on failure; its struct_size must be set.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, CUMULET_ERROR_UNSUPPORTED, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_update_transmittance_map(cumulet_viewer* viewer,
                                                            const cumulet_transmittance_map_desc* desc,
                                                            cumulet_transmittance_map* map);
/**
 * [GL] Deletes a transmittance map. Does nothing if there is none in the slot.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param slot   The map, 0 to 15.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_destroy_transmittance_map(cumulet_viewer* viewer, uint32_t slot);
/**
 * Returns GLSL (1.30 and later) for the host's shaders. Put it after the #version line and before its use. It defines
 * `float cumulet_transmittance(sampler3D map, mat4 to_map, vec2 range, vec3 world)`, the transmittance, 0 to 1, from
 * the light to a world-space point. It takes one texture fetch.
 *
 * Threads: any thread. No GL.
 *
 * @return A static string, zero-terminated.
 */
CUMULET_API const char* cumulet_transmittance_map_glsl(void);

/** @} */

/* ---- Picking and reading back ------------------------------------------------------------------------------------ */

/**
 * @defgroup cumulet_read_back Picking and reading back
 *
 * The functions that read the image wait for the dispatches in flight. The image's size is that of
 * cumulet_frame_result. Before the first image they return CUMULET_ERROR_INVALID_ARGUMENT.
 * @{
 */

/** The point of the scene under a pixel. */
typedef struct cumulet_pick {
  size_t struct_size;
  int32_t hit;              /**< 1: along the pixel's ray a surface is hit, or the volume reaches half opacity. */
  double position[3];       /**< The hit point in world space. */
  double distance;          /**< From the ray's origin. */
  int32_t hit_volume;       /**< 1: the hit is in the volume. 0: on a surface, or no hit. */
  uint32_t transform_index; /**< If hit_volume: index of the instance transform (cumulet_set_volume_transforms) with the
                       highest extinction at the hit point. 0 if there is only one. */
  /**
   * cumulet_instance_desc.tag of the instance with the highest extinction, or cumulet_model_desc.tag of the model that
   * is hit. 0 for the viewer's own volume and surfaces.
   */
  uint64_t tag;
  int32_t hit_surface;     /**< 1: a triangle of the viewer's surfaces, or of a model, is hit. */
  uint32_t material;       /**< If hit_surface: number of the material in the file, or of the host's mesh. */
  char material_name[128]; /**< "" if it has none. */
  double normal[3];        /**< Unit normal in world space, interpolated from the vertices, on the ray's side. */
} cumulet_pick;

/**
 * [GL] Returns the point of the scene under a pixel.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param x      Position from the left, in pixels of the last frame.
 * @param y      Position from the top, in pixels of the last frame.
 * @param pick   Receives the hit; its struct_size must be set. hit is 0 outside of the image.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_pick_at(cumulet_viewer* viewer, double x, double y, cumulet_pick* pick);
/**
 * Returns the world-space bounding box of the viewer's volume, its instances, surfaces and models.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer  The viewer.
 * @param box_min Receives the lowest corner.
 * @param box_max Receives the highest corner.
 * @return CUMULET_OK, or CUMULET_ERROR_INVALID_ARGUMENT if there is no content.
 */
CUMULET_API cumulet_status cumulet_get_bounds(cumulet_viewer* viewer, double box_min[3], double box_max[3]);

/**
 * [GL] Reads the image as linear radiance over the background (premultiplied if the background is transparent), and its
 * alpha, the part of a pixel that is not background. A pixel without samples is 0; with a background color it has that
 * color.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param rgba   Receives width x height x 4 floats, first pixel top left.
 * @param count  Floats at rgba.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT if count is too small, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_linear(cumulet_viewer* viewer, float* rgba, size_t count);
/**
 * [GL] Reads the image as it is displayed: exposed, tone-mapped, sRGB-encoded. It is denoised if cumulet_display_desc
 * says so and cumulet_read_denoised supports the image. It is opaque unless the background is transparent.
 *
 * Alpha is straight, as in PNG. Light that is brighter than its alpha, as of flames, has no straight color, so alpha is
 * raised until the color fits. Over black such a pixel is correct; a background behind it shows less than it should.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param rgba   Receives width x height x 4 bytes, first pixel top left.
 * @param count  Bytes at rgba.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT if count is too small, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_display(cumulet_viewer* viewer, uint8_t* rgba, size_t count);
/**
 * Converts linear values of any image in the shaded view, as cumulet_read_linear and cumulet_read_denoised return them,
 * to the bytes of cumulet_read_display.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer The viewer, for its display settings.
 * @param linear count floats.
 * @param rgba   Receives count bytes.
 * @param count  A multiple of 4.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_encode_display(cumulet_viewer* viewer, const float* linear, uint8_t* rgba,
                                                  size_t count);

/** How cumulet_read_denoised removes noise. */
typedef struct cumulet_denoise_desc {
  size_t struct_size;
  const char* network; /**< UTF-8 path of a network file of Intel's Open Image Denoise: rt_hdr_calb_cnrm.tza, or another
                            whose name begins with rt_hdr. The library contains none
                            (scripts/install_oidn_weights.sh). NULL: the filter of CUMULET_DENOISE_FAST, which needs
                            none. */
  /**
   * UTF-8 file name of the library of Intel's Open Image Denoise, version 1.4 or later, which has its own network.
   * "": its usual names (libOpenImageDenoise.so.2, libOpenImageDenoise.so.1). NULL: no library.
   *
   * It is used in place of `network` where the driver computes on the CPU, and is loaded by the first such call. The
   * log says once which version denoises, or why the library cannot be used; `network` is used then.
   */
  const char* oidn_library;
} cumulet_denoise_desc;

/**
 * [GL] Reads the image of cumulet_read_linear without noise, by a neural network or a filter. The result is an estimate
 * and not the mean of samples, and its error is not bounded. With a network, alpha does not change, and neither do
 * values that are not finite.
 *
 * - With a network: shaders in this context compute it, with up to 512 MiB of GL memory and 80 bytes per pixel during
 *   the call. The call waits for them and for their compiler: 20 to 90 seconds per megapixel on software drivers.
 * - With a library: its threads compute it while the call waits. It takes 160 bytes per pixel and the library's own
 *   memory. The result depends on the library's version. The process keeps the library.
 * - It takes twice as long if the scene has surfaces or emissive media. The noise-free component is subtracted first,
 *   and the positive and the negative residual are denoised separately.
 * - Without a network: the filter also denoises alpha. It takes 128 bytes per pixel, and one or two seconds per
 *   megapixel on software drivers.
 * - Both first trace feature rays, three of which take about as long as a sample: two per sample, at least 8 per pixel
 *   (16 with a network) and at most 64. Rays beyond 16 are traced only where they differ.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param desc   The network file and the library.
 * @param rgba   Receives width x height x 4 floats, first pixel top left.
 * @param count  Floats at rgba.
 * @return CUMULET_OK; CUMULET_ERROR_FILE for a missing or unsuitable network file; CUMULET_ERROR_UNSUPPORTED for debug
 *         views and for a preview with rasterized surfaces; CUMULET_ERROR_INVALID_ARGUMENT if count is too small, or if
 *         the image still shows the previous volume; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_denoised(cumulet_viewer* viewer, const cumulet_denoise_desc* desc, float* rgba,
                                                 size_t count);
/** Arbitrary output variables (AOVs), for compositors. z is the depth along the camera's axis. */
typedef enum cumulet_aov {
  CUMULET_AOV_BEAUTY = 0, /**< 4 floats: premultiplied linear radiance without the background, and alpha, of volume and
                               surfaces. */
  /**
   * 4 floats: premultiplied linear radiance and alpha of paths that hit the volume first. Needs
   * cumulet_sampling_desc.separate_volume_aov. Beauty minus this is the surfaces as seen through the volume.
   */
  CUMULET_AOV_VOLUME = 1,
  CUMULET_AOV_TRANSMITTANCE = 2, /**< 1 float: transmittance of the volume, up to the nearest surface or to infinity. */
  CUMULET_AOV_SURFACE_DEPTH = 3, /**< 1 float: z of the nearest surface (the viewer's or the host's) at the pixel's
                                      center; infinite where there is none. */
  CUMULET_AOV_VOLUME_DEPTH = 4,  /**< 1 float: z where the volume in front of the nearest surface reaches half opacity;
                                      infinite where it does not. */
  /**
   * 3 floats: mean shading normal of the viewer's surfaces in the pixel, in world space, towards the eye, as if there
   * were no volume; 0 where there is none.
   */
  CUMULET_AOV_NORMAL = 5,
  /**
   * 3 floats: mean linear base color of the viewer's surfaces in the pixel, as if there were no volume; 0 where there
   * is none.
   */
  CUMULET_AOV_ALBEDO = 6,
  /**
   * 1 float: estimated standard error of the pixel's luminance, including the sky behind: sqrt((mean(L^2) - mean(L)^2)
   * / (n - 1)) of the luminances L of its n samples. Infinite for fewer than two samples.
   */
  CUMULET_AOV_ERROR = 7,
  /**
   * 3 floats: mean velocity of the volume at the first scattering of camera rays, in front of the nearest surface;
   * world space, world units per second. 0 where there is no scattering, and for volumes without velocities; surfaces
   * have none. With voxel grid types also 0 if the volume's box has more than 2^27 voxels or is longer than
   * GL_MAX_3D_TEXTURE_SIZE.
   */
  CUMULET_AOV_VELOCITY = 8,
  /**
   * 2 floats: motion vector of the nearest surface at the pixel's center (the viewer's, the host's or the ground), as
   * if there were no volume. It includes the motion of the camera, the model's transform and its pose. Where there is
   * no surface, it is that of infinitely distant points under the camera's rotation (orthographic: 0).
   *
   * Motion vectors are in pixels, x to the right and y up. They point from the present position to the position in the
   * previous frame, like Nuke's backward and the first half of Blender's Vector. They are 0 where that was behind the
   * eye, and where no motion is known (cumulet_set_previous_camera).
   */
  CUMULET_AOV_MOTION = 9,
  /**
   * 2 floats: mean motion vector of the volume at the first scattering of camera rays, in front of the nearest surface,
   * due to the camera, its transform and its velocity; 0 where there is no scattering.
   */
  CUMULET_AOV_VOLUME_MOTION = 10
} cumulet_aov;

/**
 * [GL] Reads an AOV of the image. Transmittance, depths, normal, albedo, velocity and motion are computed at the first
 * request, with 16 feature rays per pixel (more for an image that was denoised, where they differ); depths use the ray
 * through the pixel's center. They have no noise, except where surfaces cover or transmit partially, which is decided
 * at random. Further requests only cost the readback.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param aov    The AOV.
 * @param values Receives width x height x the AOV's number of floats, first pixel top left.
 * @param count  Floats at values.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for debug views, if count is too small, if the image still shows
 *         the previous volume, or for CUMULET_AOV_VOLUME without separate_volume_aov; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_aov(cumulet_viewer* viewer, cumulet_aov aov, float* values, size_t count);
/**
 * [GL] Reads the contribution of one light group to the image, as if there were no other lights. The background counts
 * in the group of the sky or environment and of the sun's disk, unless it is transparent or a color. The sum of all
 * groups is the radiance of cumulet_read_linear, except for rounding and a background color. Rasterized surfaces
 * (CUMULET_SURFACE_LIGHTING_RASTERIZED) count in group 0. Previews have no light groups. On a shadow catcher, the
 * background counts in the group of the sky, and light that objects take away counts as negative in its group.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param group  The group, below cumulet_sampling_desc.light_groups.
 * @param rgb    Receives width x height x 3 floats of linear radiance, first pixel top left.
 * @param count  Floats at rgb.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for a group that was not accumulated, for debug views, and if
 *         count is too small; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_light_group(cumulet_viewer* viewer, uint32_t group, float* rgb, size_t count);

/** The image that cumulet_begin_read copies. */
typedef enum cumulet_read_source {
  CUMULET_READ_LINEAR = 0, /**< The values of cumulet_read_linear, 4 floats a pixel. */
  /**
   * The values of cumulet_read_aov for cumulet_read_desc.aov, which must be one that samples accumulate:
   * CUMULET_AOV_BEAUTY or CUMULET_AOV_VOLUME, 4 floats, or CUMULET_AOV_ERROR, 1 float.
   */
  CUMULET_READ_AOV = 1,
  CUMULET_READ_LIGHT_GROUP =
      2 /**< The values of cumulet_read_light_group for cumulet_read_desc.light_group, 3 floats. */
} cumulet_read_source;

/** A request for read-back without waiting. */
typedef struct cumulet_read_desc {
  size_t struct_size;
  cumulet_read_source source;
  cumulet_aov aov;      /**< For CUMULET_READ_AOV. */
  uint32_t light_group; /**< For CUMULET_READ_LIGHT_GROUP. */
} cumulet_read_desc;

/** The state of a read. */
typedef struct cumulet_read_info {
  size_t struct_size;
  int32_t ready;  /**< 1: the GPU has copied the values. */
  uint32_t width; /**< Of the image at the time of cumulet_begin_read. */
  uint32_t height;
  uint32_t channels; /**< Floats per pixel. */
} cumulet_read_info;

/**
 * [GL] Begins to read the image back without waiting for the GPU: queues a copy into a pixel pack buffer, and a fence.
 * cumulet_finish_read returns the values once the fence has passed, usually one or two frames later.
 *
 * - The values are those of the image at this call, with the display settings of this call. Later frames, settings and
 *   content do not change them. Of a sample that is still being traced, some pixels may have their value already.
 * - Display values: pass those of CUMULET_READ_LINEAR to cumulet_encode_display, on any thread.
 * - At most 16 reads may be begun and not finished. Each holds 16 to 56 bytes per pixel of GL memory, counted in
 *   cumulet_stats.gl_bytes, but not in cumulet_limits_desc.gl_bytes. Detaching and the loss of the context end all
 *   reads.
 * - The first read of an image with rasterized surfaces may compile a shader in this call, unless a frame was drawn.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param desc   The image to read.
 * @param read   Receives the number of the read, never 0.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT before the first image, with 16 reads begun, for an AOV that
 * samples do not accumulate or that was not accumulated, for a light group that was not accumulated, and for AOVs and
 *         light groups of debug views; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_begin_read(cumulet_viewer* viewer, const cumulet_read_desc* desc, uint64_t* read);
/**
 * [GL] Returns whether a read is ready, and its values if it is. Never waits for the GPU. The call that returns values
 * ends the read.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param read   Number of the read.
 * @param values Receives width x height x channels floats, first pixel top left, if info->ready is 1. NULL: the read is
 *               only looked at, and does not end.
 * @param count  Floats at values.
 * @param info   Receives the state; its struct_size must be set.
 * @return CUMULET_OK, also if the read is not ready; CUMULET_ERROR_INVALID_ARGUMENT for a number that is no read (it
 *         has ended, or the viewer was detached) and if count is too small; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_finish_read(cumulet_viewer* viewer, uint64_t read, float* values, size_t count,
                                               cumulet_read_info* info);
/**
 * [GL] Ends a read without its values. Does nothing if there is no such read.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param read   Number of the read.
 * @return CUMULET_OK or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_cancel_read(cumulet_viewer* viewer, uint64_t read);

/** The kind of an object that has a matte. */
typedef enum cumulet_object_kind {
  CUMULET_OBJECT_VOLUME = 0,   /**< The viewer's own volume, with one of its transforms, or an instance. */
  CUMULET_OBJECT_SURFACES = 1, /**< The viewer's own surfaces, or a model. */
  CUMULET_OBJECT_GROUND = 2    /**< The plane of cumulet_ground_desc. */
} cumulet_object_kind;

/**
 * Returns the name of an object for cumulet_read_cryptomatte. Objects with the same name share a matte. Called on the
 * calling thread; must not call the library.
 *
 * @param user  The argument of cumulet_read_cryptomatte.
 * @param kind  The kind of the object.
 * @param tag   cumulet_instance_desc.tag or cumulet_model_desc.tag; 0 for the viewer's own objects and the ground.
 * @param transform_index Index of the transform (cumulet_set_volume_transforms); 0 for other objects.
 * @return Zero-terminated UTF-8, used only during cumulet_read_cryptomatte. NULL or "": the object is in no matte.
 */
typedef const char* (*cumulet_object_name_fn)(void* user, cumulet_object_kind kind, uint64_t tag,
                                              uint32_t transform_index);

/**
 * [GL] Reads Cryptomatte ID mattes of the image (Friedman and Jones 2015; specification 1.2 of
 * https://github.com/Psyop/Cryptomatte).
 *
 * Each pixel has `ranks` pairs of floats: an object's id, whose bits are cumulet_cryptomatte_id of its name, and its
 * coverage. The coverage is the fraction of the pixel where camera rays hit the object first. In a volume it is where
 * they are scattered or absorbed, so that coverages add up to the image's alpha except for noise. Pairs are sorted by
 * coverage, the largest first; unused pairs are 0. Objects beyond `ranks` pairs, those with the smallest coverages, are
 * left out. With more than 32 names in one pixel, small ones may be left out.
 *
 * - Hidden objects are excluded. Models with shadow_only have no matte.
 * - Holdouts (of media, surfaces and models) have no matte, as they have no alpha, and occlude the objects behind them;
 *   so does the host's depth.
 * - Surfaces that transmit count fully. Surfaces of alphaMode BLEND count by their coverage.
 * - Each call computes the mattes again, with 64 rays per pixel at fixed positions, also over lens and shutter.
 *   Coverages of volumes are exact along them (at most four volumes at one point). There is no noise except where
 *   surfaces cover partially. The result does not depend on the image's samples.
 * - The call takes 16 KB of GL memory per column of pixels.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param name   Called once per object during this call.
 * @param user   First argument of name.
 * @param ranks  Pairs per pixel, 1 to 16; files mostly have 6.
 * @param values Receives width x height x ranks x 2 floats, first pixel top left.
 * @param count  Floats at values.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for debug views, if count is too small, or if the image still
 *         shows the previous volume; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_cryptomatte(cumulet_viewer* viewer, cumulet_object_name_fn name, void* user,
                                                    uint32_t ranks, float* values, size_t count);
/**
 * Returns the Cryptomatte id of a name: MurmurHash3_32 of its bytes with seed 0. If the result is not a finite normal
 * float, the lowest bit of its exponent is flipped. A file's manifest contains it in hexadecimal.
 *
 * Threads: any thread, at any time. No GL.
 *
 * @param name Zero-terminated UTF-8. NULL gives 0.
 * @return The id; no name has 0.
 */
CUMULET_API uint32_t cumulet_cryptomatte_id(const char* name);
/**
 * [GL] Measures the relative standard error of the image: the root mean square of the pixels' standard errors of
 * luminance (CUMULET_AOV_ERROR), divided by the mean luminance, over pixels with at least two samples.
 *
 * It is infinite while it is unknown: no pixel has two samples, or the image is not finite. 0 means that the samples of
 * each pixel are equal. Samples count as independent; because they are stratified, the true error is smaller. The call
 * reads the image back: do not call it every frame.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param noise  Receives the noise; 0.02 is 2 %.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_measure_noise(cumulet_viewer* viewer, double* noise);

/**
 * [GL] Reads the accumulated samples of the image in progress, so that another process can continue it. The bytes are
 * specific to the library's version and contain nothing of the scene. Only shaded images without previews
 * (CUMULET_PREVIEW_OFF) have them.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param bytes  Receives the bytes. NULL: only *size is written.
 * @param size   In: bytes of space at bytes. Out: bytes of the accumulation: 32 + 44 per pixel, or 60 with
 *               separate_volume_aov, and 16 per pixel for each light group and two more. Adaptive images have 4 more
 *               per pixel, and 1 for each block of 8 x 8 pixels.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT for other images, for too little space, and before the first
 *         cumulet_render; or a [GL] error.
 */
CUMULET_API cumulet_status cumulet_read_accumulation(cumulet_viewer* viewer, void* bytes, size_t* size);
/**
 * [GL] Replaces the samples of the image in progress by those of cumulet_read_accumulation. Call it after a
 * cumulet_render that began the image (with CUMULET_PREVIEW_OFF), with the same settings, files, size and driver. The
 * image then ends as the other one would have, bit for bit, also with a noise target. An image that has all its samples
 * already does not change.
 *
 * Threads: any thread with the context.
 *
 * @param viewer An attached viewer.
 * @param bytes  The bytes.
 * @param size   Bytes at bytes.
 * @return CUMULET_OK; CUMULET_ERROR_INVALID_ARGUMENT, with everything as it was, for bytes of an image of another size,
 *         kind or version, or with more samples than the image shall have; or a [GL] error. The library cannot check
 *         that the scene is the same.
 */
CUMULET_API cumulet_status cumulet_restore_accumulation(cumulet_viewer* viewer, const void* bytes, size_t size);

/** Statistics, in SI units. Fields without a value are 0; noise is then infinite. */
typedef struct cumulet_stats {
  size_t struct_size;
  uint64_t cells;      /**< Cells of all displayed grids. */
  uint32_t levels;     /**< Deepest bisection level of any cell; 0 for the 24 cells of the control cube. */
  uint64_t cell_bytes; /**< GL memory that rays traverse: cell data and point-location tree, or voxels. Also if other
                            viewers share it (cell_viewers). */
  uint64_t active_voxels;
  double build_seconds_total; /**< Also if another viewer built the grid. */
  double build_seconds_load;
  double build_seconds_statistics;
  double build_seconds_refine;
  double build_seconds_packing; /**< Packing the cell data. */
  double build_seconds_upload;
  double trace_seconds; /**< For the image in progress. */
  uint64_t samples;     /**< Camera paths of the image that were finished at the last cumulet_render. */
  uint64_t steps;       /**< Cells or voxels entered by all rays of those paths, at the last readback. */
  double bounds_min[3]; /**< World-space bounding box of the volume, with all its transforms. */
  double bounds_max[3];
  char gl_vendor[128];
  char gl_renderer[128];
  char gl_version[128];
  int32_t limited;   /**< 1: max_cells or a memory limit, not the threshold, ended the refinement. */
  uint64_t gl_bytes; /**< All GL memory of the viewer, including cell_bytes that others share. The memory in use by all
                          viewers is the sum of gl_bytes - cell_bytes + cell_bytes / cell_viewers. */
  /**
   * GPU time of passes since the viewer was attached, as far as it is known, because nothing waits for it. The
   * difference between two calls suits a graph. On a driver that runs dispatches within the call (Mesa's llvmpipe), it
   * is their time in the call, without drawing that the driver defers.
   */
  double pass_seconds_upload;
  double pass_seconds_host_depth;
  double pass_seconds_surfaces; /**< The surface pass of previews. */
  double pass_seconds_trace;
  double pass_seconds_inspect; /**< Debug views, and the volume's depth. */
  double pass_seconds_display;
  double noise; /**< As found by the last cumulet_measure_noise or readback of the image. Infinite before the first one,
                     and while it is unknown. */
  uint64_t memory_bytes; /**< Main memory that cumulet_limits_desc.memory_bytes counts. Viewers that share a volume or a
                              grid each count all of it, so that the sum over viewers may exceed the memory in use. */
  /**
   * Samples of the image whose radiance was not finite or exceeded 1e33. They count as black, so that no NaN or
   * infinity enters the image. A warning in the log reports them once per image (once per viewer with previews). 0 is
   * normal.
   */
  uint64_t nonfinite_samples;
  /**
   * Number of viewers that have the cells of cell_bytes in GL memory together, this one included: 1 if they are its
   * own, 0 if there are none. See cumulet_shader_cache_create.
   */
  uint64_t cell_viewers;
} cumulet_stats;

/**
 * Returns statistics of a viewer.
 *
 * Threads: any thread; waits for running [GL] calls. No GL.
 *
 * @param viewer The viewer.
 * @param stats  Receives the statistics; its struct_size must be set.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_stats(cumulet_viewer* viewer, cumulet_stats* stats);

/**
 * Returns the interpolation between voxels that is in use, which cumulet_grid_desc.interpolation may leave to the
 * library.
 *
 * Threads: any thread. No GL.
 *
 * @param viewer        The viewer.
 * @param interpolation Receives that of the newest grid of the viewer's volume, sequence or dynamic volume; without
 *                      one, of the first instance that has a grid. CUMULET_INTERPOLATION_AUTO: there is no grid.
 * @return CUMULET_OK or CUMULET_ERROR_INVALID_ARGUMENT.
 */
CUMULET_API cumulet_status cumulet_get_interpolation(cumulet_viewer* viewer, cumulet_interpolation* interpolation);

/** @} */

#ifdef __cplusplus
}
#endif

#endif
