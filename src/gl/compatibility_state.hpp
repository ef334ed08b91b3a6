#pragma once

#include <glad/gl.h>

#include <array>
#include <cstddef>

#include "gl/bindings.hpp"

namespace cumulet::gl {

struct Functions;

/// Whether the calling thread is between glBegin and glEnd, where GL answers no query. `certain` is false if the window
/// system cannot be queried; there may then be no current context.
struct BetweenBeginAndEnd {
  bool possible = false;
  bool certain = false;
};
BetweenBeginAndEnd between_begin_and_end(const Functions& gl);

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
