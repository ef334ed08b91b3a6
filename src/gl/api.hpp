#pragma once

#include <glad/gl.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "gl/proc_address.hpp"

namespace cumulet::gl {

class StateGuard;
struct CompatibilityFunctions;

/// The GL function table of one context, loaded through the host's callback. The library links no GL.
///
/// Functions that set state, or that depend on state, hide glad's function of the same name: they notify the innermost
/// StateGuard in scope before they call GL. Without a guard they only call GL.
struct Functions : GladGLContext {
  /// True once the context is lost: objects are then forgotten, not deleted.
  mutable std::atomic<bool> abandoned = false;
  /// True if a dispatch is complete when its call returns, as on software drivers. Set by find_out_dispatches().
  mutable std::atomic<bool> dispatches_in_call = false;
  /// The innermost guard in scope.
  mutable StateGuard* guard = nullptr;
  /// The constant GL_MAX_DRAW_BUFFERS.
  GLuint draw_buffers = 8;
  /// Null in a core context.
  std::shared_ptr<const CompatibilityFunctions> compatibility;
  /// The constant GL_MAX_DEBUG_GROUP_STACK_DEPTH.
  GLint max_debug_groups = 0;
  /// The constant GL_MAX_TEXTURE_SIZE, in texels.
  GLint max_texture_size = 0;
  /// Number of DebugGroup objects that are open. Not atomic: one thread has the context.
  mutable GLint open_debug_groups = 0;
  /// Number of debug groups that fit on the driver's stack besides the host's. Empty until a DebugGroup queries it.
  mutable std::optional<GLint> debug_group_room;

  void UseProgram(GLuint program) const;
  void BindProgramPipeline(GLuint pipeline) const;
  void BindVertexArray(GLuint array) const;
  void BindFramebuffer(GLenum target, GLuint framebuffer) const;
  void ActiveTexture(GLenum unit) const;
  void BindTexture(GLenum target, GLuint texture) const;
  void BindTextureUnit(GLuint unit, GLuint texture) const;
  /// Binds a texture with this target. It may have been created through another table of the share group.
  void BindTextureUnit(GLuint unit, GLuint texture, GLenum target) const;
  void BindSampler(GLuint unit, GLuint sampler) const;
  void BindBuffer(GLenum target, GLuint buffer) const;
  void BindBufferBase(GLenum target, GLuint index, GLuint buffer) const;
  void BindBufferRange(GLenum target, GLuint index, GLuint buffer, GLintptr offset, GLsizeiptr size) const;
  void BindImageTexture(GLuint unit, GLuint texture, GLint level, GLboolean layered, GLint layer, GLenum access,
                        GLenum format) const;

  void PixelStorei(GLenum name, GLint value) const;
  void ClearTexImage(GLuint texture, GLint level, GLenum format, GLenum type, const void* data) const;
  void ClearTexSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width, GLsizei height,
                        GLsizei depth, GLenum format, GLenum type, const void* data) const;
  void TextureSubImage2D(GLuint texture, GLint level, GLint x, GLint y, GLsizei width, GLsizei height, GLenum format,
                         GLenum type, const void* pixels) const;
  void TextureSubImage3D(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width, GLsizei height,
                         GLsizei depth, GLenum format, GLenum type, const void* pixels) const;
  void GetTextureImage(GLuint texture, GLint level, GLenum format, GLenum type, GLsizei bytes, void* pixels) const;
  void GetTextureSubImage(GLuint texture, GLint level, GLint x, GLint y, GLint z, GLsizei width, GLsizei height,
                          GLsizei depth, GLenum format, GLenum type, GLsizei bytes, void* pixels) const;

  void Enable(GLenum capability) const;
  void Disable(GLenum capability) const;
  void Enablei(GLenum capability, GLuint index) const;
  void Disablei(GLenum capability, GLuint index) const;
  void ColorMaski(GLuint buffer, GLboolean r, GLboolean g, GLboolean b, GLboolean a) const;
  void BlendFuncSeparatei(GLuint buffer, GLenum from, GLenum to, GLenum from_alpha, GLenum to_alpha) const;
  void BlendEquationSeparatei(GLuint buffer, GLenum color, GLenum alpha) const;
  void DepthMask(GLboolean write) const;
  void DepthFunc(GLenum function) const;
  void DepthRangeIndexed(GLuint index, GLdouble near, GLdouble far) const;
  void CullFace(GLenum mode) const;
  void FrontFace(GLenum mode) const;
  void PolygonMode(GLenum face, GLenum mode) const;
  void ClipControl(GLenum origin, GLenum depth) const;
  void ViewportIndexedf(GLuint index, GLfloat x, GLfloat y, GLfloat width, GLfloat height) const;
  void ScissorIndexed(GLuint index, GLint left, GLint bottom, GLsizei width, GLsizei height) const;

  void DrawArrays(GLenum mode, GLint first, GLsizei count) const;
  void DrawElementsInstancedBaseInstance(GLenum mode, GLsizei count, GLenum type, const void* indices,
                                         GLsizei instances, GLuint first) const;
  void ClearNamedFramebufferfv(GLuint framebuffer, GLenum buffer, GLint index, const GLfloat* value) const;
  void BlitNamedFramebuffer(GLuint from, GLuint to, GLint x0, GLint y0, GLint x1, GLint y1, GLint u0, GLint v0,
                            GLint u1, GLint v1, GLbitfield mask, GLenum filter) const;

  // These record the target of each texture, so that the guard saves only the binding of that target when one is bound.
  void CreateTextures(GLenum target, GLsizei count, GLuint* names) const;
  void DeleteTextures(GLsizei count, const GLuint* names) const;
  /// Returns 0 for a texture that was not created through this table.
  [[nodiscard]] GLenum target_of(GLuint texture) const;

 private:
  mutable std::unordered_map<GLuint, GLenum> texture_targets_;
};

/// The limits of the context that the library needs.
struct Limits {
  std::int64_t texture_buffer_texels = 0;
  std::int64_t storage_block_bytes = 0;
  int texture_size_3d = 0;
  int texture_size_2d = 0;
};

/// Loads the table and checks for OpenGL 4.5 and for each function that the library calls. Throws Error(unsupported)
/// with the version or the name of the function.
std::shared_ptr<const Functions> load_functions(GetProc get_proc, void* user);
/// Copies the functions, but not the state, for objects that outlive the viewer that owns `gl`.
std::shared_ptr<const Functions> copy_of(const Functions& gl);
Limits query_limits(const Functions& gl);

/// Consumes all pending GL errors. If there was one, throws Error(out_of_memory, context_lost or gl) with the step.
void check(const Functions& gl, const char* step);
/// Whether the driver reports that it reset the context.
bool was_reset(const Functions& gl);
inline constexpr const char* reset_message = "the driver reset the GL context";
/// Throws Error(context_lost) if the driver reports that it reset the context.
void check_reset(const Functions& gl);
/// Drops errors that are pending, for example from calls of the host.
void clear_errors(const Functions& gl);

/// Returns a string of the context (GL_VENDOR, GL_VERSION, ...), or "" if the driver returns none.
std::string string_of(const Functions& gl, GLenum name);

}  // namespace cumulet::gl
