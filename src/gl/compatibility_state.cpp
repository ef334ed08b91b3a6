#include "gl/compatibility_state.hpp"

#include <string>

#include "base/error.hpp"
#include "gl/api.hpp"
#include "gl/compatibility_functions.hpp"

namespace cumulet::gl {

namespace {

// The core profile's header lacks these.
constexpr GLenum alpha_test = 0x0BC0;
constexpr GLenum polygon_stipple = 0x0B42;
constexpr GLenum clamp_fragment_color = 0x891B;
constexpr GLenum list_index = 0x0B33;
constexpr GLenum render_mode = 0x0C40;
constexpr GLint render_mode_render = 0x1C00;
constexpr GLint render_mode_select = 0x1C02;
constexpr GLenum texture_filter_control = 0x8500;
constexpr GLenum matrix_mode = 0x0BA0;
constexpr GLenum color_matrix_mode = 0x1800;
constexpr GLenum color_matrix = 0x80B1;

constexpr std::array<GLenum, 2> fragment_test_table{alpha_test, polygon_stipple};

struct Transfer {
  GLenum name;
  GLfloat known = 0.0F;
};
constexpr std::array<Transfer, 30> transfer_table{{{0x0D10},        // GL_MAP_COLOR
                                                   {0x0D11},        // GL_MAP_STENCIL
                                                   {0x0D12},        // GL_INDEX_SHIFT
                                                   {0x0D13},        // GL_INDEX_OFFSET
                                                   {0x0D14, 1.0F},  // GL_RED_SCALE
                                                   {0x0D15},        // GL_RED_BIAS
                                                   {0x0D18, 1.0F},  // GL_GREEN_SCALE
                                                   {0x0D19},        // GL_GREEN_BIAS
                                                   {0x0D1A, 1.0F},  // GL_BLUE_SCALE
                                                   {0x0D1B},        // GL_BLUE_BIAS
                                                   {0x0D1C, 1.0F},  // GL_ALPHA_SCALE
                                                   {0x0D1D},        // GL_ALPHA_BIAS
                                                   {0x0D1E, 1.0F},  // GL_DEPTH_SCALE
                                                   {0x0D1F},        // GL_DEPTH_BIAS
                                                   // GL_ARB_imaging:
                                                   {0x801C, 1.0F},  // GL_POST_CONVOLUTION_RED_SCALE and so on
                                                   {0x801D, 1.0F},  //
                                                   {0x801E, 1.0F},  //
                                                   {0x801F, 1.0F},  //
                                                   {0x8020},        // GL_POST_CONVOLUTION_RED_BIAS and so on
                                                   {0x8021},        //
                                                   {0x8022},        //
                                                   {0x8023},        //
                                                   {0x80B4, 1.0F},  // GL_POST_COLOR_MATRIX_RED_SCALE and so on
                                                   {0x80B5, 1.0F},  //
                                                   {0x80B6, 1.0F},  //
                                                   {0x80B7, 1.0F},  //
                                                   {0x80B8},        // GL_POST_COLOR_MATRIX_RED_BIAS and so on
                                                   {0x80B9},        //
                                                   {0x80BA},        //
                                                   {0x80BB}}};      //
constexpr std::array<GLenum, 8> imaging_table{0x80D0,               // GL_COLOR_TABLE
                                              0x80D1,               // GL_POST_CONVOLUTION_COLOR_TABLE
                                              0x80D2,               // GL_POST_COLOR_MATRIX_COLOR_TABLE
                                              0x8010,               // GL_CONVOLUTION_1D
                                              0x8011,               // GL_CONVOLUTION_2D
                                              0x8012,               // GL_SEPARABLE_2D
                                              0x8024,               // GL_HISTOGRAM
                                              0x802E};              // GL_MINMAX
constexpr std::array<GLfloat, 16> identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// The table without the guard's hooks.
const GladGLContext& plain(const Functions& gl) { return gl; }

}  // namespace

BetweenBeginAndEnd between_begin_and_end(const Functions& gl) {
  if (!gl.compatibility || gl.GetString(GL_VERSION) != nullptr) return {};
  if (gl.compatibility->current_context == nullptr) return {.possible = true, .certain = false};
  const bool is_current = gl.compatibility->current_context() != nullptr;
  return {.possible = is_current, .certain = is_current};
}

void require_rendering(const Functions& gl) {
  if (!gl.compatibility) return;
  GLint list = 0;
  gl.GetIntegerv(list_index, &list);
  if (list != 0) {
    throw Error(ErrorCode::gl,
                "display list " + std::to_string(list) + " is open and would record this call: call glEndList first");
  }
  GLint mode = render_mode_render;
  gl.GetIntegerv(render_mode, &mode);
  if (mode == render_mode_render) return;
  throw Error(ErrorCode::gl, std::string("the render mode is ") +
                                 (mode == render_mode_select ? "GL_SELECT" : "GL_FEEDBACK") +
                                 ", which draws nothing: call glRenderMode(GL_RENDER) first");
}

// ---- fragments ----

void CompatibilityState::prepare_fragments() {
  static_assert(fragment_test_table.size() == fragment_tests);
  if (!gl_->compatibility || fragments_used_) return;
  fragments_used_ = true;
  const GladGLContext& gl = plain(*gl_);
  for (std::size_t i = 0; i < fragment_tests; ++i) {
    if (restore_) tests_[i] = gl.IsEnabled(fragment_test_table[i]) != GL_FALSE;
    if (tests_[i] || !restore_) gl.Disable(fragment_test_table[i]);
  }
  if (restore_) gl.GetIntegerv(clamp_fragment_color, &fragment_clamp_);
  if (fragment_clamp_ != GL_FALSE || !restore_) gl.ClampColor(clamp_fragment_color, GL_FALSE);
}

// ---- pixels ----

std::size_t CompatibilityState::transfer_count() const {
  return gl_->compatibility->MatrixMode == nullptr ? basic_transfers : transfers;
}

void CompatibilityState::load_color_matrix(const std::array<GLfloat, 16>& matrix) const {
  GLint mode = 0;
  plain(*gl_).GetIntegerv(matrix_mode, &mode);
  gl_->compatibility->MatrixMode(color_matrix_mode);
  gl_->compatibility->LoadMatrixf(matrix.data());
  gl_->compatibility->MatrixMode(static_cast<GLenum>(mode));
}

void CompatibilityState::prepare_pixels() {
  static_assert(transfer_table.size() == transfers && imaging_table.size() == imaging_steps);
  if (!gl_->compatibility || pixels_used_) return;
  pixels_used_ = true;
  const GladGLContext& gl = plain(*gl_);
  for (std::size_t i = 0; i < transfer_count(); ++i) {
    const auto [name, known] = transfer_table[i];
    if (restore_) gl.GetFloatv(name, &transfers_[i]);
    if (transfers_[i] != known || !restore_) gl_->compatibility->PixelTransferf(name, known);
  }
  if (gl_->compatibility->MatrixMode == nullptr) return;
  for (std::size_t i = 0; i < imaging_steps; ++i) {
    if (restore_) imaging_[i] = gl.IsEnabled(imaging_table[i]) != GL_FALSE;
    if (imaging_[i] || !restore_) gl.Disable(imaging_table[i]);
  }
  if (restore_) gl.GetFloatv(color_matrix, color_matrix_.data());
  if (color_matrix_ != identity || !restore_) load_color_matrix(identity);
}

// ---- texture units ----

void CompatibilityState::prepare_unit(GLuint unit) {
  if (!gl_->compatibility) return;
  GLfloat& bias = level_biases_.at(unit);
  if (restore_) gl_->compatibility->GetTexEnvfv(texture_filter_control, GL_TEXTURE_LOD_BIAS, &bias);
  if (bias != 0.0F || !restore_) gl_->compatibility->TexEnvf(texture_filter_control, GL_TEXTURE_LOD_BIAS, 0.0F);
}

void CompatibilityState::restore_unit(GLuint unit) const {
  if (level_biases_.at(unit) == 0.0F) return;
  plain(*gl_).ActiveTexture(GL_TEXTURE0 + unit);
  gl_->compatibility->TexEnvf(texture_filter_control, GL_TEXTURE_LOD_BIAS, level_biases_.at(unit));
}

// ---- restore ----

void CompatibilityState::restore() const {
  const GladGLContext& gl = plain(*gl_);
  if (fragments_used_) {
    for (std::size_t i = 0; i < fragment_tests; ++i) {
      if (tests_[i]) gl.Enable(fragment_test_table[i]);
    }
    if (fragment_clamp_ != GL_FALSE) gl.ClampColor(clamp_fragment_color, static_cast<GLenum>(fragment_clamp_));
  }
  if (!pixels_used_) return;
  for (std::size_t i = 0; i < transfer_count(); ++i) {
    const auto [name, known] = transfer_table[i];
    if (transfers_[i] != known) gl_->compatibility->PixelTransferf(name, transfers_[i]);
  }
  if (gl_->compatibility->MatrixMode == nullptr) return;
  for (std::size_t i = 0; i < imaging_steps; ++i) {
    if (imaging_[i]) gl.Enable(imaging_table[i]);
  }
  if (color_matrix_ != identity) load_color_matrix(color_matrix_);
}

}  // namespace cumulet::gl
