#pragma once

#include <glad/gl.h>

#include <array>
#include <cstddef>
#include <memory>

#include "gl/bindings.hpp"

namespace cumulet::gl {

struct Functions;

/// The functions that only a compatibility context has, as far as the library needs them. They are loaded through the
/// host's callback.
struct CompatibilityFunctions {
  using GetProc = void* (*)(void* user, const char* name);

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
std::shared_ptr<const CompatibilityFunctions> load_compatibility(const Functions& gl,
                                                                 CompatibilityFunctions::GetProc get_proc, void* user);

/// Returns the window system's query for the current context. Null if the host's callback provides none that returns a
/// context.
void* (*find_current_context(CompatibilityFunctions::GetProc get_proc, void* user))();

/// Whether the calling thread is between glBegin and glEnd, where GL answers no query. `certain` is false if the window
/// system cannot be queried; there may then be no current context.
struct BetweenBeginAndEnd {
  bool possible = false;
  bool certain = false;
};
BetweenBeginAndEnd between_begin_and_end(const Functions& gl);
inline constexpr const char* between_begin_and_end_message =
    "the function was called between glBegin and glEnd, which OpenGL does not allow: call it after glEnd";

/// Throws Error(gl) if a display list is open, or if glRenderMode is GL_SELECT or GL_FEEDBACK. Does nothing in a core
/// context.
void require_rendering(const Functions& gl);

/// Compatibility-profile state that affects the library's draws and pixel transfers and that core contexts lack. Used
/// by StateGuard: each group is saved and set to the value of a core context at its first use.
///
/// All calls do nothing in a core context.
class CompatibilityState {
 public:
  CompatibilityState(const Functions& gl, bool restore) : gl_(&gl), restore_(restore) {}

  /// Call before draws: alpha test, polygon stipple, fragment color clamp.
  void prepare_fragments();
  /// Call before pixel transfers: scales, biases, maps, and the imaging subset.
  void prepare_pixels();
  /// Resets the level-of-detail bias of the texture unit, which must be active.
  void prepare_unit(GLuint unit);
  /// Restores the bias of the unit; makes the unit active if there is something to restore.
  void restore_unit(GLuint unit) const;

  /// Restores everything but texture units.
  void restore() const;

 private:
  static constexpr std::size_t fragment_tests = 2;
  static constexpr std::size_t transfers = 30;
  static constexpr std::size_t basic_transfers = 14;  // without the imaging subset
  static constexpr std::size_t imaging_steps = 8;

  [[nodiscard]] std::size_t transfer_count() const;
  void load_color_matrix(const std::array<GLfloat, 16>& matrix) const;

  const Functions* gl_;
  bool restore_;
  bool fragments_used_ = false;
  std::array<bool, fragment_tests> tests_{};
  GLint fragment_clamp_ = 0;
  bool pixels_used_ = false;
  std::array<GLfloat, transfers> transfers_{};
  std::array<bool, imaging_steps> imaging_{};
  std::array<GLfloat, 16> color_matrix_{};
  std::array<GLfloat, core::CM_UNITS> level_biases_{};
};

}  // namespace cumulet::gl
