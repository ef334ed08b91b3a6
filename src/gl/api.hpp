#pragma once

#include <glad/gl.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

namespace cumulet::gl {

class StateGuard;
struct CompatibilityFunctions;

/// The GL function table of one context, loaded through the host's callback. Nothing is linked.
///
/// Functions that set state, or that need some to be known, hide glad's of the same name: they tell the innermost
/// StateGuard that is in scope before they call. Without one they just call.
struct Functions : GladGLContext {
  /// The context is gone: objects are forgotten, not deleted.
  mutable std::atomic<bool> abandoned = false;
  /// Dispatches are over when their call returns, as on software drivers: find_out_dispatches().
  mutable std::atomic<bool> dispatches_in_call = false;
  /// The innermost that is in scope.
  mutable StateGuard* guard = nullptr;
  /// The constant GL_MAX_DRAW_BUFFERS.
  GLuint draw_buffers = 8;
  /// Null in a core context.
  std::shared_ptr<const CompatibilityFunctions> compatibility;
  /// The constant GL_MAX_DEBUG_GROUP_STACK_DEPTH.
  GLint max_debug_groups = 0;
  /// The constant GL_MAX_TEXTURE_SIZE, in texels.
  GLint max_texture_size = 0;
  /// For DebugGroup: how many of them are open. One thread has the context.
  mutable GLint open_debug_groups = 0;
  /// How many may be open beside those of the host; nothing until a call queries it.
  mutable std::optional<GLint> debug_group_room;

  void UseProgram(GLuint program) const;
  void BindProgramPipeline(GLuint pipeline) const;
  void BindVertexArray(GLuint array) const;
  void BindFramebuffer(GLenum target, GLuint framebuffer) const;
  void ActiveTexture(GLenum unit) const;
  void BindTexture(GLenum target, GLuint texture) const;
  void BindTextureUnit(GLuint unit, GLuint texture) const;
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
  void BlendEquationSeparatei(GLuint buffer, GLenum colour, GLenum alpha) const;
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

  // These note what a texture is, so that binding one is about one target, and asks for that alone.
  void CreateTextures(GLenum target, GLsizei count, GLuint* names) const;
  void DeleteTextures(GLsizei count, const GLuint* names) const;
  /// 0 for a texture that was not made here.
  [[nodiscard]] GLenum target_of(GLuint texture) const;

 private:
  mutable std::unordered_map<GLuint, GLenum> texture_targets_;
};

/// What the library needs of the context's limits.
struct Limits {
  std::int64_t texture_buffer_texels = 0;
  std::int64_t storage_block_bytes = 0;
  int texture_size_3d = 0;
  int texture_size_2d = 0;
};

/// Loads the table and checks version 4.5 and compute. Throws Error(unsupported) that says what is missing.
std::shared_ptr<const Functions> load_functions(void* (*get_proc)(void* user, const char* name), void* user);
/// The same functions, for what outlives the viewer whose those are, with states of its own.
std::shared_ptr<const Functions> copy_of(const Functions& gl);
Limits query_limits(const Functions& gl);

/// Takes all pending GL errors; throws Error(out_of_memory, context_lost or gl) that names the step.
void check(const Functions& gl, const char* step);
/// Whether the driver says that it reset the context.
bool was_reset(const Functions& gl);
inline constexpr const char* reset_message = "the driver reset the GL context";
/// Throws Error(context_lost) if the driver says that it reset the context.
void check_reset(const Functions& gl);
/// Drops errors that were pending before we came.
void clear_errors(const Functions& gl);

/// Whether the current context has it.
bool has_extension(const Functions& gl, const char* name);

/// The GL name of a context string, "" if the driver gives none.
std::string string_of(const Functions& gl, GLenum name);

}  // namespace cumulet::gl
