#pragma once

// For state-leak tests: reads all state of a context with glGet, and a host that sets it to unusual but legal values.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <random>
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

/// A host with objects of its own at arbitrary bindings. Its debug callback turns every GL error during its lifetime
/// into a test failure.
class ScramblingHost {
 public:
  /// legacy: null in a core context.
  explicit ScramblingHost(gl::FunctionsPtr gl, const LegacyGlPtr& legacy = nullptr) : gl_(std::move(gl)) {
    if (legacy) legacy_ = std::make_unique<LegacyHost>(*gl_, legacy);
    make_programs();
    make_textures();
    for (int i = 0; i < 4; ++i) {
      buffers_.push_back(gl::make_buffer(gl_, 4096, nullptr, GL_DYNAMIC_STORAGE_BIT, "a host's buffer"));
      samplers_.push_back(gl::make_sampler(gl_));
      gl_->SamplerParameteri(samplers_.back().name(), GL_TEXTURE_COMPARE_MODE,
                             i % 2 == 0 ? GL_NONE : GL_COMPARE_REF_TO_TEXTURE);
      gl_->SamplerParameteri(samplers_.back().name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    }
    for (int i = 0; i < 2; ++i) {
      vertex_arrays_.push_back(gl::make_vertex_array(gl_));
      gl_->VertexArrayElementBuffer(vertex_arrays_.back().name(), buffers_[static_cast<std::size_t>(i)].name());
      make_framebuffer();
    }
  }
  ~ScramblingHost() {
    gl_->DeleteProgramPipelines(1, &pipeline_);
    gl_->BindTransformFeedback(GL_TRANSFORM_FEEDBACK, 0);
    gl_->DeleteTransformFeedbacks(1, &feedback_);
    gl_->DeleteRenderbuffers(1, &renderbuffer_);
    gl_->DebugMessageCallback(nullptr, nullptr);
  }
  ScramblingHost(const ScramblingHost&) = delete;
  ScramblingHost& operator=(const ScramblingHost&) = delete;
  ScramblingHost(ScramblingHost&&) = delete;
  ScramblingHost& operator=(ScramblingHost&&) = delete;

  /// Sets all state that read_gl_state reads to values derived from `seed`, except state that may not be set outside a
  /// frame.
  void scramble(std::uint32_t seed) {
    random_.seed(seed);
    scramble_bindings();
    scramble_textures();
    scramble_pixels();
    scramble_raster();
    scramble_fragments();
    if (legacy_) legacy_->scramble(random_);
    gl::check(*gl_, "scrambling");
  }

 private:
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  bool coin() { return below(2) == 1; }
  float unit() { return static_cast<float>(below(1U << 20U)) / float(1U << 20U); }
  GLboolean boolean() { return coin() ? GL_TRUE : GL_FALSE; }
  template <std::size_t N>
  GLenum one_of(const GLenum (&values)[N]) {
    return values[below(N)];
  }
  /// Returns a random object of the list, or 0.
  GLuint any(const std::vector<gl::Object>& objects) {
    const std::uint32_t pick = below(static_cast<std::uint32_t>(objects.size()) + 1);
    return pick == objects.size() ? 0 : objects[pick].name();
  }

  void make_programs() {
    const char* vertex =
        "#version 450\nout gl_PerVertex { vec4 gl_Position; };\nvoid main() { gl_Position = vec4(0); }\n";
    for (int i = 0; i < 2; ++i) {
      const gl::Object shader(gl_, gl::Object::Kind::shader, gl_->CreateShader(GL_VERTEX_SHADER));
      gl_->ShaderSource(shader.name(), 1, &vertex, nullptr);
      gl_->CompileShader(shader.name());
      programs_.emplace_back(gl_, gl::Object::Kind::program, gl_->CreateProgram());
      gl_->ProgramParameteri(programs_.back().name(), GL_PROGRAM_SEPARABLE, GL_TRUE);
      gl_->AttachShader(programs_.back().name(), shader.name());
      gl_->LinkProgram(programs_.back().name());
    }
    gl_->GenProgramPipelines(1, &pipeline_);
    gl_->UseProgramStages(pipeline_, GL_VERTEX_SHADER_BIT, programs_[0].name());
    gl_->GenTransformFeedbacks(1, &feedback_);
    gl_->CreateRenderbuffers(1, &renderbuffer_);
    gl_->Enable(GL_DEBUG_OUTPUT);
    gl_->DebugMessageCallback(
        [](GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar* message, const void*) {
          if (type == GL_DEBUG_TYPE_ERROR) ADD_FAILURE() << "the host's debug callback: " << message;
        },
        this);
    gl::check(*gl_, "a host's programs");
  }

  void make_textures() {
    const auto make = [this](GLenum target, auto&& allocate) {
      for (int i = 0; i < 2; ++i) {
        GLuint name = 0;
        gl_->CreateTextures(target, 1, &name);
        textures_[target_index(target)].emplace_back(gl_, gl::Object::Kind::texture, name);
        allocate(name);
      }
    };
    make(GL_TEXTURE_1D, [this](GLuint t) { gl_->TextureStorage1D(t, 1, GL_RGBA8, 8); });
    make(GL_TEXTURE_2D, [this](GLuint t) { gl_->TextureStorage2D(t, 4, GL_RGBA8, 8, 8); });
    make(GL_TEXTURE_3D, [this](GLuint t) { gl_->TextureStorage3D(t, 1, GL_R32F, 8, 8, 8); });
    make(GL_TEXTURE_1D_ARRAY, [this](GLuint t) { gl_->TextureStorage2D(t, 1, GL_R8, 8, 8); });
    make(GL_TEXTURE_2D_ARRAY, [this](GLuint t) { gl_->TextureStorage3D(t, 1, GL_RGBA32F, 8, 8, 8); });
    make(GL_TEXTURE_RECTANGLE, [this](GLuint t) { gl_->TextureStorage2D(t, 1, GL_R8, 8, 8); });
    make(GL_TEXTURE_CUBE_MAP, [this](GLuint t) { gl_->TextureStorage2D(t, 1, GL_R8, 8, 8); });
    make(GL_TEXTURE_CUBE_MAP_ARRAY, [this](GLuint t) { gl_->TextureStorage3D(t, 1, GL_R8, 8, 8, 6); });
    make(GL_TEXTURE_2D_MULTISAMPLE,
         [this](GLuint t) { gl_->TextureStorage2DMultisample(t, 4, GL_RGBA8, 8, 8, GL_TRUE); });
    make(GL_TEXTURE_2D_MULTISAMPLE_ARRAY,
         [this](GLuint t) { gl_->TextureStorage3DMultisample(t, 4, GL_RGBA8, 8, 8, 2, GL_TRUE); });
    texel_buffer_ = gl::make_buffer(gl_, 256, nullptr, 0, "a host's buffer");
    make(GL_TEXTURE_BUFFER, [this](GLuint t) { gl_->TextureBuffer(t, GL_R32F, texel_buffer_.name()); });
    gl::check(*gl_, "a host's textures");
  }

  void make_framebuffer() {
    const gl::Object& framebuffer = framebuffers_.emplace_back(gl::make_framebuffer(gl_));
    for (GLenum i = 0; i < 3; ++i) {
      attachments_.push_back(gl::make_texture_2d(gl_, GL_RGBA8, 8, 8, "a host's attachment"));
      gl_->NamedFramebufferTexture(framebuffer.name(), GL_COLOR_ATTACHMENT0 + i, attachments_.back().name(), 0);
    }
    attachments_.push_back(gl::make_texture_2d(gl_, GL_DEPTH24_STENCIL8, 8, 8, "a host's attachment"));
    gl_->NamedFramebufferTexture(framebuffer.name(), GL_DEPTH_STENCIL_ATTACHMENT, attachments_.back().name(), 0);
    const std::array<GLenum, 4> buffers{GL_COLOR_ATTACHMENT2, GL_COLOR_ATTACHMENT0, GL_NONE, GL_COLOR_ATTACHMENT1};
    gl_->NamedFramebufferDrawBuffers(framebuffer.name(), 4, buffers.data());
    gl_->NamedFramebufferReadBuffer(framebuffer.name(), GL_COLOR_ATTACHMENT1);
  }

  static constexpr std::array<GLenum, 11> targets{GL_TEXTURE_1D,
                                                  GL_TEXTURE_2D,
                                                  GL_TEXTURE_3D,
                                                  GL_TEXTURE_1D_ARRAY,
                                                  GL_TEXTURE_2D_ARRAY,
                                                  GL_TEXTURE_RECTANGLE,
                                                  GL_TEXTURE_CUBE_MAP,
                                                  GL_TEXTURE_CUBE_MAP_ARRAY,
                                                  GL_TEXTURE_BUFFER,
                                                  GL_TEXTURE_2D_MULTISAMPLE,
                                                  GL_TEXTURE_2D_MULTISAMPLE_ARRAY};
  static std::size_t target_index(GLenum target) {
    std::size_t i = 0;
    while (targets[i] != target) ++i;
    return i;
  }

  void scramble_bindings() {
    gl_->UseProgram(any(programs_));
    gl_->BindProgramPipeline(coin() ? pipeline_ : 0);
    gl_->BindTransformFeedback(GL_TRANSFORM_FEEDBACK, coin() ? feedback_ : 0);
    gl_->BindVertexArray(any(vertex_arrays_));
    gl_->BindRenderbuffer(GL_RENDERBUFFER, coin() ? renderbuffer_ : 0);
    gl_->BindFramebuffer(GL_DRAW_FRAMEBUFFER, any(framebuffers_));
    gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, any(framebuffers_));
    const auto bind_ranges = [this](GLenum target, GLuint count) {
      for (GLuint i = 0; i < count; ++i) {
        const GLuint buffer = any(buffers_);
        if (buffer != 0 && coin()) {
          gl_->BindBufferRange(target, i, buffer, 256 * static_cast<GLintptr>(below(8)),
                               16 * (1 + GLsizeiptr(below(16))));
        } else {
          gl_->BindBufferBase(target, i, buffer);
        }
      }
    };
    bind_ranges(GL_SHADER_STORAGE_BUFFER, 8);
    bind_ranges(GL_UNIFORM_BUFFER, 12);
    bind_ranges(GL_ATOMIC_COUNTER_BUFFER, 1);
    bind_ranges(GL_TRANSFORM_FEEDBACK_BUFFER, 4);
    for (const GLenum target :
         {GL_ARRAY_BUFFER, GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, GL_DRAW_INDIRECT_BUFFER,
          GL_DISPATCH_INDIRECT_BUFFER, GL_QUERY_BUFFER, GL_ATOMIC_COUNTER_BUFFER, GL_SHADER_STORAGE_BUFFER,
          GL_UNIFORM_BUFFER, GL_TRANSFORM_FEEDBACK_BUFFER, GL_PIXEL_PACK_BUFFER, GL_PIXEL_UNPACK_BUFFER}) {
      gl_->BindBuffer(target, any(buffers_));
    }
  }

  void scramble_textures() {
    for (GLuint i = 0; i < 32; ++i) {
      gl_->ActiveTexture(GL_TEXTURE0 + i);
      for (std::size_t t = 0; t < targets.size(); ++t) gl_->BindTexture(targets[t], any(textures_[t]));
      gl_->BindSampler(i, any(samplers_));
    }
    gl_->ActiveTexture(GL_TEXTURE0 + below(32));
    for (GLuint i = 0; i < 8; ++i) {
      const std::vector<gl::Object>& pool = textures_[target_index(coin() ? GL_TEXTURE_2D : GL_TEXTURE_2D_ARRAY)];
      gl_->BindImageTexture(i, any(pool), static_cast<GLint>(below(3)), boolean(), static_cast<GLint>(below(4)),
                            one_of({GL_READ_ONLY, GL_WRITE_ONLY, GL_READ_WRITE}),
                            one_of({GL_RGBA8, GL_R32UI, GL_RGBA16F, GL_R8}));
    }
  }

  void scramble_pixels() {
    for (const GLenum name : {GL_PACK_SWAP_BYTES, GL_PACK_LSB_FIRST, GL_UNPACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST}) {
      gl_->PixelStorei(name, coin() ? 1 : 0);
    }
    for (const GLenum name : {GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT}) gl_->PixelStorei(name, 1 << below(4));
    for (const GLenum name :
         {GL_PACK_ROW_LENGTH, GL_PACK_IMAGE_HEIGHT, GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_ROWS, GL_PACK_SKIP_IMAGES,
          GL_PACK_COMPRESSED_BLOCK_WIDTH, GL_PACK_COMPRESSED_BLOCK_HEIGHT, GL_PACK_COMPRESSED_BLOCK_DEPTH,
          GL_PACK_COMPRESSED_BLOCK_SIZE, GL_UNPACK_ROW_LENGTH, GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_PIXELS,
          GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_IMAGES, GL_UNPACK_COMPRESSED_BLOCK_WIDTH,
          GL_UNPACK_COMPRESSED_BLOCK_HEIGHT, GL_UNPACK_COMPRESSED_BLOCK_DEPTH, GL_UNPACK_COMPRESSED_BLOCK_SIZE}) {
      gl_->PixelStorei(name, static_cast<GLint>(below(5)));
    }
  }

  void scramble_raster() {
    for (const auto& [name, value] : detail::capabilities()) {
      if (value == GL_DEBUG_OUTPUT) continue;
      if (coin()) {
        gl_->Enable(value);
      } else {
        gl_->Disable(value);
      }
    }
    for (GLuint i = 0; i < 16; ++i) {
      gl_->ViewportIndexedf(i, 10.0F * unit(), 10.0F * unit(), 1.0F + 20.0F * unit(), 1.0F + 20.0F * unit());
      gl_->ScissorIndexed(i, static_cast<GLint>(below(5)), static_cast<GLint>(below(5)), static_cast<GLint>(below(5)),
                          static_cast<GLint>(below(5)));
      gl_->DepthRangeIndexed(i, 0.25 * below(4), 0.25 * below(4));
      if (coin()) {
        gl_->Enablei(GL_SCISSOR_TEST, i);
      } else {
        gl_->Disablei(GL_SCISSOR_TEST, i);
      }
    }
    gl_->CullFace(one_of({GL_FRONT, GL_BACK, GL_FRONT_AND_BACK}));
    gl_->FrontFace(one_of({GL_CW, GL_CCW}));
    gl_->PolygonMode(GL_FRONT_AND_BACK, one_of({GL_POINT, GL_LINE, GL_FILL}));
    gl_->PolygonOffset(unit(), unit());
    gl_->LineWidth(1.0F);
    gl_->PointSize(1.0F + unit());
    gl_->PointParameterf(GL_POINT_FADE_THRESHOLD_SIZE, unit());
    gl_->PointParameteri(GL_POINT_SPRITE_COORD_ORIGIN, static_cast<GLint>(one_of({GL_LOWER_LEFT, GL_UPPER_LEFT})));
    gl_->PrimitiveRestartIndex(below(3));
    gl_->ProvokingVertex(one_of({GL_FIRST_VERTEX_CONVENTION, GL_LAST_VERTEX_CONVENTION}));
    gl_->PatchParameteri(GL_PATCH_VERTICES, 1 + static_cast<GLint>(below(8)));
    const std::array<GLfloat, 4> levels{1.0F + unit(), 1.0F + unit(), 1.0F + unit(), 1.0F + unit()};
    gl_->PatchParameterfv(GL_PATCH_DEFAULT_OUTER_LEVEL, levels.data());
    gl_->PatchParameterfv(GL_PATCH_DEFAULT_INNER_LEVEL, levels.data());
    gl_->ClipControl(one_of({GL_LOWER_LEFT, GL_UPPER_LEFT}), one_of({GL_NEGATIVE_ONE_TO_ONE, GL_ZERO_TO_ONE}));
    for (const GLenum hint : {GL_LINE_SMOOTH_HINT, GL_POLYGON_SMOOTH_HINT, GL_TEXTURE_COMPRESSION_HINT,
                              GL_FRAGMENT_SHADER_DERIVATIVE_HINT}) {
      gl_->Hint(hint, one_of({GL_FASTEST, GL_NICEST, GL_DONT_CARE}));
    }
  }

  void scramble_fragments() {
    gl_->SampleCoverage(unit(), boolean());
    gl_->SampleMaski(0, below(16));
    gl_->MinSampleShading(unit());
    for (const GLenum face : {GL_FRONT, GL_BACK}) {
      gl_->StencilFuncSeparate(face, GL_NEVER + below(8), static_cast<GLint>(below(256)), below(256));
      gl_->StencilMaskSeparate(face, below(256));
      gl_->StencilOpSeparate(face, one_of({GL_KEEP, GL_ZERO, GL_INVERT}), one_of({GL_REPLACE, GL_INCR}),
                             one_of({GL_DECR, GL_INCR_WRAP}));
    }
    gl_->DepthFunc(GL_NEVER + below(8));
    gl_->DepthMask(boolean());
    gl_->ClearDepth(unit());
    gl_->ClearStencil(static_cast<GLint>(below(256)));
    gl_->ClearColor(unit(), unit(), unit(), unit());
    gl_->BlendColor(unit(), unit(), unit(), unit());
    gl_->LogicOp(GL_CLEAR + below(16));
    gl_->ClampColor(GL_CLAMP_READ_COLOR, one_of({GL_TRUE, GL_FALSE, GL_FIXED_ONLY}));
    const auto factor = [this] {
      return one_of({GL_ZERO, GL_ONE, GL_SRC_COLOR, GL_ONE_MINUS_DST_ALPHA, GL_CONSTANT_COLOR, GL_SRC_ALPHA_SATURATE});
    };
    const auto equation = [this] {
      return one_of({GL_FUNC_ADD, GL_FUNC_SUBTRACT, GL_FUNC_REVERSE_SUBTRACT, GL_MIN, GL_MAX});
    };
    for (GLuint i = 0; i < 8; ++i) {
      gl_->ColorMaski(i, boolean(), boolean(), boolean(), boolean());
      gl_->BlendFuncSeparatei(i, factor(), factor(), factor(), factor());
      gl_->BlendEquationSeparatei(i, equation(), equation());
      if (coin()) {
        gl_->Enablei(GL_BLEND, i);
      } else {
        gl_->Disablei(GL_BLEND, i);
      }
    }
  }

  gl::FunctionsPtr gl_;
  std::unique_ptr<LegacyHost> legacy_;
  std::mt19937 random_;
  std::vector<gl::Object> programs_;
  GLuint pipeline_ = 0;
  GLuint feedback_ = 0;
  GLuint renderbuffer_ = 0;
  std::array<std::vector<gl::Object>, 11> textures_;
  gl::Object texel_buffer_;
  std::vector<gl::Object> buffers_;
  std::vector<gl::Object> samplers_;
  std::vector<gl::Object> vertex_arrays_;
  std::vector<gl::Object> attachments_;
  std::vector<gl::Object> framebuffers_;
};

}  // namespace cumulet::test
