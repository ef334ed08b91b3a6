#pragma once

// For state-leak tests: a host that sets the state of a context to unusual but legal values.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "gl/programs.hpp"
#include "support/legacy_gl.hpp"

namespace cumulet::test {

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
