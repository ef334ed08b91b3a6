#pragma once

// For state-leak tests: reads all state of a context with glGet.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "gl/programs.hpp"
#include "support/backends.hpp"
#include "support/legacy_gl.hpp"

namespace cumulet::test {

/// A context and its functions, on each backend, without a viewer.
class GlTest : public BackendTest {
 protected:
  void SetUp() override {
    BackendTest::SetUp();
    if (IsSkipped()) return;
    gl_ = gl::load_functions(headless::Context::get_proc, context_.get());
    programs_ = std::make_shared<gl::Programs>(*gl_, nullptr);
    if (GetParam().profile == headless::Profile::compatibility) legacy_ = std::make_shared<const LegacyGl>(*context_);
  }
  void TearDown() override {
    if (gl_) {
      EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
    }
  }

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  LegacyGlPtr legacy_;  // null in a core context
};

/// One value of the state; the name includes unit or index.
struct GlValue {
  std::string name;
  std::vector<double> values;
};
using GlState = std::vector<GlValue>;

namespace detail {

struct Named {
  const char* name;
  GLenum value;
};
#define CUMULET_NAMED(constant) \
  ::cumulet::test::detail::Named { #constant, constant }

inline const std::vector<Named>& texture_bindings() {
  static const std::vector<Named> bindings{CUMULET_NAMED(GL_TEXTURE_BINDING_1D),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_2D),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_3D),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_1D_ARRAY),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_2D_ARRAY),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_RECTANGLE),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_CUBE_MAP),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_CUBE_MAP_ARRAY),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_BUFFER),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_2D_MULTISAMPLE),
                                           CUMULET_NAMED(GL_TEXTURE_BINDING_2D_MULTISAMPLE_ARRAY),
                                           CUMULET_NAMED(GL_SAMPLER_BINDING)};
  return bindings;
}

/// State read with glIsEnabled. The capabilities that scramble() changes come first.
inline const std::vector<Named>& capabilities() {
  static const std::vector<Named> list{CUMULET_NAMED(GL_DEPTH_TEST),
                                       CUMULET_NAMED(GL_DEPTH_CLAMP),
                                       CUMULET_NAMED(GL_STENCIL_TEST),
                                       CUMULET_NAMED(GL_CULL_FACE),
                                       CUMULET_NAMED(GL_POLYGON_OFFSET_FILL),
                                       CUMULET_NAMED(GL_POLYGON_OFFSET_LINE),
                                       CUMULET_NAMED(GL_POLYGON_OFFSET_POINT),
                                       CUMULET_NAMED(GL_POLYGON_SMOOTH),
                                       CUMULET_NAMED(GL_LINE_SMOOTH),
                                       CUMULET_NAMED(GL_RASTERIZER_DISCARD),
                                       CUMULET_NAMED(GL_COLOR_LOGIC_OP),
                                       CUMULET_NAMED(GL_MULTISAMPLE),
                                       CUMULET_NAMED(GL_SAMPLE_ALPHA_TO_COVERAGE),
                                       CUMULET_NAMED(GL_SAMPLE_ALPHA_TO_ONE),
                                       CUMULET_NAMED(GL_SAMPLE_COVERAGE),
                                       CUMULET_NAMED(GL_SAMPLE_MASK),
                                       CUMULET_NAMED(GL_SAMPLE_SHADING),
                                       CUMULET_NAMED(GL_PRIMITIVE_RESTART),
                                       CUMULET_NAMED(GL_PRIMITIVE_RESTART_FIXED_INDEX),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE0),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE1),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE2),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE3),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE4),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE5),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE6),
                                       CUMULET_NAMED(GL_CLIP_DISTANCE7),
                                       CUMULET_NAMED(GL_DITHER),
                                       CUMULET_NAMED(GL_FRAMEBUFFER_SRGB),
                                       CUMULET_NAMED(GL_PROGRAM_POINT_SIZE),
                                       CUMULET_NAMED(GL_TEXTURE_CUBE_MAP_SEAMLESS),
                                       CUMULET_NAMED(GL_DEBUG_OUTPUT),
                                       CUMULET_NAMED(GL_DEBUG_OUTPUT_SYNCHRONOUS)};
  return list;
}

/// State read with glGet, at most four values each.
inline const std::vector<Named>& values() {
  static const std::vector<Named> list{CUMULET_NAMED(GL_ACTIVE_TEXTURE),
                                       CUMULET_NAMED(GL_CURRENT_PROGRAM),
                                       CUMULET_NAMED(GL_PROGRAM_PIPELINE_BINDING),
                                       CUMULET_NAMED(GL_VERTEX_ARRAY_BINDING),
                                       CUMULET_NAMED(GL_DRAW_FRAMEBUFFER_BINDING),
                                       CUMULET_NAMED(GL_READ_FRAMEBUFFER_BINDING),
                                       CUMULET_NAMED(GL_RENDERBUFFER_BINDING),
                                       CUMULET_NAMED(GL_ARRAY_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_ELEMENT_ARRAY_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_COPY_READ_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_COPY_WRITE_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_DRAW_INDIRECT_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_DISPATCH_INDIRECT_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_QUERY_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_ATOMIC_COUNTER_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_SHADER_STORAGE_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_UNIFORM_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_TRANSFORM_FEEDBACK_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_TRANSFORM_FEEDBACK_BINDING),
                                       CUMULET_NAMED(GL_PIXEL_PACK_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_PIXEL_UNPACK_BUFFER_BINDING),
                                       CUMULET_NAMED(GL_PACK_SWAP_BYTES),
                                       CUMULET_NAMED(GL_PACK_LSB_FIRST),
                                       CUMULET_NAMED(GL_PACK_ROW_LENGTH),
                                       CUMULET_NAMED(GL_PACK_IMAGE_HEIGHT),
                                       CUMULET_NAMED(GL_PACK_SKIP_PIXELS),
                                       CUMULET_NAMED(GL_PACK_SKIP_ROWS),
                                       CUMULET_NAMED(GL_PACK_SKIP_IMAGES),
                                       CUMULET_NAMED(GL_PACK_ALIGNMENT),
                                       CUMULET_NAMED(GL_PACK_COMPRESSED_BLOCK_WIDTH),
                                       CUMULET_NAMED(GL_PACK_COMPRESSED_BLOCK_HEIGHT),
                                       CUMULET_NAMED(GL_PACK_COMPRESSED_BLOCK_DEPTH),
                                       CUMULET_NAMED(GL_PACK_COMPRESSED_BLOCK_SIZE),
                                       CUMULET_NAMED(GL_UNPACK_SWAP_BYTES),
                                       CUMULET_NAMED(GL_UNPACK_LSB_FIRST),
                                       CUMULET_NAMED(GL_UNPACK_ROW_LENGTH),
                                       CUMULET_NAMED(GL_UNPACK_IMAGE_HEIGHT),
                                       CUMULET_NAMED(GL_UNPACK_SKIP_PIXELS),
                                       CUMULET_NAMED(GL_UNPACK_SKIP_ROWS),
                                       CUMULET_NAMED(GL_UNPACK_SKIP_IMAGES),
                                       CUMULET_NAMED(GL_UNPACK_ALIGNMENT),
                                       CUMULET_NAMED(GL_UNPACK_COMPRESSED_BLOCK_WIDTH),
                                       CUMULET_NAMED(GL_UNPACK_COMPRESSED_BLOCK_HEIGHT),
                                       CUMULET_NAMED(GL_UNPACK_COMPRESSED_BLOCK_DEPTH),
                                       CUMULET_NAMED(GL_UNPACK_COMPRESSED_BLOCK_SIZE),
                                       CUMULET_NAMED(GL_DEPTH_FUNC),
                                       CUMULET_NAMED(GL_DEPTH_WRITEMASK),
                                       CUMULET_NAMED(GL_DEPTH_CLEAR_VALUE),
                                       CUMULET_NAMED(GL_COLOR_CLEAR_VALUE),
                                       CUMULET_NAMED(GL_STENCIL_CLEAR_VALUE),
                                       CUMULET_NAMED(GL_STENCIL_FUNC),
                                       CUMULET_NAMED(GL_STENCIL_REF),
                                       CUMULET_NAMED(GL_STENCIL_VALUE_MASK),
                                       CUMULET_NAMED(GL_STENCIL_WRITEMASK),
                                       CUMULET_NAMED(GL_STENCIL_FAIL),
                                       CUMULET_NAMED(GL_STENCIL_PASS_DEPTH_FAIL),
                                       CUMULET_NAMED(GL_STENCIL_PASS_DEPTH_PASS),
                                       CUMULET_NAMED(GL_STENCIL_BACK_FUNC),
                                       CUMULET_NAMED(GL_STENCIL_BACK_REF),
                                       CUMULET_NAMED(GL_STENCIL_BACK_VALUE_MASK),
                                       CUMULET_NAMED(GL_STENCIL_BACK_WRITEMASK),
                                       CUMULET_NAMED(GL_STENCIL_BACK_FAIL),
                                       CUMULET_NAMED(GL_STENCIL_BACK_PASS_DEPTH_FAIL),
                                       CUMULET_NAMED(GL_STENCIL_BACK_PASS_DEPTH_PASS),
                                       CUMULET_NAMED(GL_BLEND_COLOR),
                                       CUMULET_NAMED(GL_LOGIC_OP_MODE),
                                       CUMULET_NAMED(GL_CULL_FACE_MODE),
                                       CUMULET_NAMED(GL_FRONT_FACE),
                                       CUMULET_NAMED(GL_POLYGON_MODE),
                                       CUMULET_NAMED(GL_POLYGON_OFFSET_FACTOR),
                                       CUMULET_NAMED(GL_POLYGON_OFFSET_UNITS),
                                       CUMULET_NAMED(GL_LINE_WIDTH),
                                       CUMULET_NAMED(GL_POINT_SIZE),
                                       CUMULET_NAMED(GL_POINT_FADE_THRESHOLD_SIZE),
                                       CUMULET_NAMED(GL_POINT_SPRITE_COORD_ORIGIN),
                                       CUMULET_NAMED(GL_SAMPLE_COVERAGE_VALUE),
                                       CUMULET_NAMED(GL_SAMPLE_COVERAGE_INVERT),
                                       CUMULET_NAMED(GL_MIN_SAMPLE_SHADING_VALUE),
                                       CUMULET_NAMED(GL_PRIMITIVE_RESTART_INDEX),
                                       CUMULET_NAMED(GL_PROVOKING_VERTEX),
                                       CUMULET_NAMED(GL_PATCH_VERTICES),
                                       CUMULET_NAMED(GL_PATCH_DEFAULT_INNER_LEVEL),
                                       CUMULET_NAMED(GL_PATCH_DEFAULT_OUTER_LEVEL),
                                       CUMULET_NAMED(GL_CLIP_ORIGIN),
                                       CUMULET_NAMED(GL_CLIP_DEPTH_MODE),
                                       CUMULET_NAMED(GL_CLAMP_READ_COLOR),
                                       CUMULET_NAMED(GL_READ_BUFFER),
                                       CUMULET_NAMED(GL_DRAW_BUFFER0),
                                       CUMULET_NAMED(GL_DRAW_BUFFER1),
                                       CUMULET_NAMED(GL_DRAW_BUFFER2),
                                       CUMULET_NAMED(GL_DRAW_BUFFER3),
                                       CUMULET_NAMED(GL_LINE_SMOOTH_HINT),
                                       CUMULET_NAMED(GL_POLYGON_SMOOTH_HINT),
                                       CUMULET_NAMED(GL_TEXTURE_COMPRESSION_HINT),
                                       CUMULET_NAMED(GL_FRAGMENT_SHADER_DERIVATIVE_HINT),
                                       CUMULET_NAMED(GL_DEBUG_GROUP_STACK_DEPTH)};
  return list;
}

/// State read with glGetIntegeri_v (glGetInteger64i_v if `wide`), for `count` indices.
struct Indexed {
  Named what;
  GLuint count;
  bool wide = false;
};
inline const std::vector<Indexed>& indexed_values() {
  static const std::vector<Indexed> list{{CUMULET_NAMED(GL_BLEND_SRC_RGB), 8},
                                         {CUMULET_NAMED(GL_BLEND_DST_RGB), 8},
                                         {CUMULET_NAMED(GL_BLEND_SRC_ALPHA), 8},
                                         {CUMULET_NAMED(GL_BLEND_DST_ALPHA), 8},
                                         {CUMULET_NAMED(GL_BLEND_EQUATION_RGB), 8},
                                         {CUMULET_NAMED(GL_BLEND_EQUATION_ALPHA), 8},
                                         {CUMULET_NAMED(GL_COLOR_WRITEMASK), 8},
                                         {CUMULET_NAMED(GL_SCISSOR_BOX), 16},
                                         {CUMULET_NAMED(GL_SAMPLE_MASK_VALUE), 1},
                                         {CUMULET_NAMED(GL_SHADER_STORAGE_BUFFER_BINDING), 8},
                                         {CUMULET_NAMED(GL_SHADER_STORAGE_BUFFER_START), 8, true},
                                         {CUMULET_NAMED(GL_SHADER_STORAGE_BUFFER_SIZE), 8, true},
                                         {CUMULET_NAMED(GL_UNIFORM_BUFFER_BINDING), 12},
                                         {CUMULET_NAMED(GL_UNIFORM_BUFFER_START), 12, true},
                                         {CUMULET_NAMED(GL_UNIFORM_BUFFER_SIZE), 12, true},
                                         {CUMULET_NAMED(GL_ATOMIC_COUNTER_BUFFER_BINDING), 1},
                                         {CUMULET_NAMED(GL_TRANSFORM_FEEDBACK_BUFFER_BINDING), 4},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_NAME), 8},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_LEVEL), 8},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_LAYERED), 8},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_LAYER), 8},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_ACCESS), 8},
                                         {CUMULET_NAMED(GL_IMAGE_BINDING_FORMAT), 8}};
  return list;
}

}  // namespace detail

/// Reads all state of the current context with glGet and leaves it unchanged. A value that the driver does not support
/// is a test failure. legacy: null in a core context.
inline GlState read_gl_state(const gl::Functions& gl, const LegacyGlPtr& legacy = nullptr) {
  gl.CheckFramebufferStatus(GL_DRAW_FRAMEBUFFER);  // before this call, Mesa clamps GL_STENCIL_REF to stale stencil bits
  GlState state;
  const auto add = [&](const std::string& name, std::vector<double> values) {
    EXPECT_EQ(gl.GetError(), GLenum{GL_NO_ERROR}) << name;
    state.push_back({name, std::move(values)});
  };
  const auto at = [](const char* name, GLuint index) { return std::string(name) + "[" + std::to_string(index) + "]"; };
  for (const auto& [name, value] : detail::values()) {
    std::vector<double> read(4, -1.0);
    gl.GetDoublev(value, read.data());
    add(name, std::move(read));
  }
  for (const auto& [name, value] : detail::capabilities()) add(name, {double(gl.IsEnabled(value))});
  for (const auto& [what, count, wide] : detail::indexed_values()) {
    for (GLuint i = 0; i < count; ++i) {
      std::array<GLint, 4> read{-1, -1, -1, -1};
      std::array<GLint64, 4> wide_read{-1, -1, -1, -1};
      if (wide) {
        gl.GetInteger64i_v(what.value, i, wide_read.data());
        add(at(what.name, i), {wide_read.begin(), wide_read.end()});
      } else {
        gl.GetIntegeri_v(what.value, i, read.data());
        add(at(what.name, i), {read.begin(), read.end()});
      }
    }
  }
  for (GLuint i = 0; i < 8; ++i) add(at("GL_BLEND", i), {double(gl.IsEnabledi(GL_BLEND, i))});
  for (GLuint i = 0; i < 16; ++i) {
    add(at("GL_SCISSOR_TEST", i), {double(gl.IsEnabledi(GL_SCISSOR_TEST, i))});
    std::vector<double> viewport(4);
    gl.GetDoublei_v(GL_VIEWPORT, i, viewport.data());
    add(at("GL_VIEWPORT", i), std::move(viewport));
    std::vector<double> range(2);
    gl.GetDoublei_v(GL_DEPTH_RANGE, i, range.data());
    add(at("GL_DEPTH_RANGE", i), std::move(range));
  }
  for (const auto& [name, value] :
       {CUMULET_NAMED(GL_DEBUG_CALLBACK_FUNCTION), CUMULET_NAMED(GL_DEBUG_CALLBACK_USER_PARAM)}) {
    void* pointer = nullptr;
    gl.GetPointerv(value, &pointer);
    add(name, {static_cast<double>(reinterpret_cast<std::uintptr_t>(pointer))});
  }
  GLint active = 0;
  gl.GetIntegerv(GL_ACTIVE_TEXTURE, &active);
  for (GLuint unit = 0; unit < 32; ++unit) {
    gl.ActiveTexture(GL_TEXTURE0 + unit);
    for (const auto& [name, value] : detail::texture_bindings()) {
      GLint bound = -1;
      gl.GetIntegerv(value, &bound);
      add(at(name, unit), {double(bound)});
    }
  }
  gl.ActiveTexture(static_cast<GLenum>(active));
  if (legacy) {
    for (auto& [name, read] : read_legacy_state(gl, *legacy)) state.push_back({name, std::move(read)});
  }
  return state;
}

/// Lists the names whose values differ, with both values, one per line. Returns "" if there are none.
inline std::string state_differences(const GlState& before, const GlState& after) {
  std::ostringstream lines;
  if (before.size() != after.size()) return "states of different sizes";
  const auto write = [&](const std::vector<double>& values) {
    for (const double value : values) lines << ' ' << value;
  };
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].name == after[i].name && before[i].values == after[i].values) continue;
    lines << before[i].name << ": before";
    write(before[i].values);
    lines << ", after";
    write(after[i].values);
    lines << '\n';
  }
  return lines.str();
}

}  // namespace cumulet::test
