#pragma once

#include <glad/gl.h>

#include <memory>

#include "gl/proc_address.hpp"

namespace cumulet::gl {

/// The functions that only a compatibility context has, as far as the library needs them. They are loaded through the
/// host's callback.
struct CompatibilityFunctions {
  void(GLAD_API_PTR* PixelTransferf)(GLenum name, GLfloat value) = nullptr;
  void(GLAD_API_PTR* TexEnvf)(GLenum target, GLenum name, GLfloat value) = nullptr;
  void(GLAD_API_PTR* GetTexEnvfv)(GLenum target, GLenum name, GLfloat* values) = nullptr;
  // Null where the context lacks GL_ARB_imaging.
  void(GLAD_API_PTR* MatrixMode)(GLenum mode) = nullptr;
  void(GLAD_API_PTR* LoadMatrixf)(const GLfloat* matrix) = nullptr;
  /// The window system's query for the current context. Null if the host's callback does not provide one.
  void* (*current_context)() = nullptr;
};

/// Returns null in a core or forward-compatible context. Throws Error(unsupported) with the name of a missing function.
std::shared_ptr<const CompatibilityFunctions> load_compatibility(const GladGLContext& gl, GetProc get_proc, void* user);

/// Returns the window system's query for the current context. Null if the host's callback provides none that returns a
/// context.
void* (*find_current_context(GetProc get_proc, void* user))();

inline constexpr const char* between_begin_and_end_message =
    "the function was called between glBegin and glEnd, which OpenGL does not allow: call it after glEnd";

}  // namespace cumulet::gl
