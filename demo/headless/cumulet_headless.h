/**
 * @file
 * The C interface of libcumulet_headless: OpenGL 4.5 contexts that need no display and no window, for scripts and tests
 * that render with Cumulet. A host with a window does not need it.
 *
 *     cumulet_headless_create -> cumulet_create with cumulet_headless_get_proc -> ... -> cumulet_destroy ->
 *     cumulet_headless_destroy
 *
 * EGL is tried first: every device of the device platform (hardware before software), then Mesa's surfaceless platform,
 * then the default display. OSMesa, a software driver, is tried last. cumulet_headless_name returns the one that was
 * chosen. Both libraries are loaded at run time.
 *
 * Descriptors, errors and ownership follow the rules of cumulet.h.
 */
#ifndef CUMULET_CUMULET_HEADLESS_H
#define CUMULET_CUMULET_HEADLESS_H

#include <cumulet/cumulet.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A context without a window. Ended by cumulet_headless_destroy. */
typedef struct cumulet_headless cumulet_headless;

/** The library that creates the context. */
typedef enum cumulet_headless_backend {
  CUMULET_HEADLESS_AUTO = 0, /**< EGL, or else OSMesa. */
  CUMULET_HEADLESS_EGL = 1,
  CUMULET_HEADLESS_OSMESA = 2
} cumulet_headless_backend;

/** How a context is created. */
typedef struct cumulet_headless_desc {
  size_t struct_size;
  cumulet_headless_backend backend;
  int32_t debug;         /**< 1: a debug context, if the backend has them. */
  int32_t compatibility; /**< 1: the compatibility profile. 0: the core profile. */
} cumulet_headless_desc;

/**
 * Creates a context and makes it current on the calling thread, in place of the present one
 * (cumulet_headless_release_current).
 *
 * Threads: any thread.
 *
 * @param desc       Backend and profile.
 * @param out        Receives the context, which the caller destroys; NULL on failure.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_UNSUPPORTED with a line that lists all attempts.
 */
CUMULET_API cumulet_status cumulet_headless_create(const cumulet_headless_desc* desc, cumulet_headless** out,
                                                   char* error, size_t error_size);
/**
 * Destroys a context, after cumulet_headless_release_current on this thread. If it is current on another thread, EGL
 * destroys it when that thread releases it.
 *
 * Threads: one call per context at a time.
 *
 * @param context May be NULL.
 */
CUMULET_API void cumulet_headless_destroy(cumulet_headless* context);
/**
 * Makes a context current on the calling thread. Does nothing if it is current there.
 *
 * Threads: one call per context at a time. A context is current on one thread at most.
 *
 * @param context    The context.
 * @param error      Receives the cause in one line, zero-terminated and cut to fit; may be NULL.
 * @param error_size Bytes at error.
 * @return CUMULET_OK, CUMULET_ERROR_INVALID_ARGUMENT, or CUMULET_ERROR_GL, for example if it is current elsewhere.
 */
CUMULET_API cumulet_status cumulet_headless_make_current(cumulet_headless* context, char* error, size_t error_size);
/**
 * Releases a context from the calling thread. With EGL, the context of EGL that it replaced on this thread is current
 * again. Does nothing if the context is not current on this thread.
 *
 * Threads: one call per context at a time.
 *
 * @param context May be NULL.
 */
CUMULET_API void cumulet_headless_release_current(cumulet_headless* context);
/**
 * Returns how a context was created.
 *
 * Threads: any thread, at any time.
 *
 * @param context The context; NULL gives "".
 * @return "egl-device", "egl-surfaceless", "egl-default" or "osmesa".
 */
CUMULET_API const char* cumulet_headless_name(const cumulet_headless* context);
/**
 * Returns the address of a GL function, or NULL. It is a cumulet_get_proc_fn.
 *
 * Threads: any thread, at any time.
 *
 * @param context The cumulet_headless.
 * @param name    The function's name.
 * @return The address, or NULL.
 */
CUMULET_API void* cumulet_headless_get_proc(void* context, const char* name);

#ifdef __cplusplus
}
#endif

#endif
