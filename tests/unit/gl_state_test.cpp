// The GL state contract: state that a guard saves, sets and restores, and the helpers that find leaks.

#include "gl/state_guard.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "base/error.hpp"
#include "render/passes/compositor.hpp"
#include "render/raster/host_depth.hpp"
#include "support/gl_state.hpp"
#include "support/scrambling_host.hpp"

namespace {

using cumulet::Error;
using cumulet::gl::Object;
using cumulet::gl::StateGuard;
using cumulet::headless::Backend;
using cumulet::test::GlState;
using cumulet::test::read_gl_state;
using cumulet::test::ScramblingHost;
using cumulet::test::state_differences;
namespace gl = cumulet::gl;
namespace render = cumulet::render;

class State : public cumulet::test::GlTest {};
CUMULET_ON_PROFILES(State);

/// Changes all state that the contract allows a call to change.
class Scribbler {
 public:
  explicit Scribbler(const gl::FunctionsPtr& gl) : gl_(*gl), programs_(*gl, nullptr) {
    buffer_ = gl::make_buffer(gl, 1024, nullptr, 0, "a buffer");
    GLuint name = 0;
    gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &name);
    textures_.emplace_back(gl, Object::Kind::texture, name);
    gl_.TextureBuffer(name, GL_R32F, buffer_.name());
    textures_.push_back(gl::make_texture_2d(gl, GL_RGBA32F, 4, 4, "2D"));
    textures_.push_back(gl::make_texture_2d_array(gl, GL_RGBA32F, 4, 4, 2, "array"));
    textures_.push_back(gl::make_texture_2d_multisample(gl, GL_RGBA8, 4, 4, 4, "multisample"));
    textures_.push_back(gl::make_texture_3d(gl, GL_RGBA32F, 4, 4, 4, "3D"));
    sampler_ = gl::make_sampler(gl);
    vertex_array_ = gl::make_vertex_array(gl);
    framebuffer_ = gl::make_framebuffer(gl);
    gl_.NamedFramebufferTexture(framebuffer_.name(), GL_COLOR_ATTACHMENT0, textures_[1].name(), 0);
  }
  void scribble() const {
    gl_.UseProgram(programs_.get({"composite.frag", {"CM_DEPTH 1"}, "composite.vert"}).name());
    gl_.BindProgramPipeline(0);
    gl_.BindVertexArray(vertex_array_.name());
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    for (GLuint unit = 0; unit < StateGuard::units; ++unit) {
      for (const Object& texture : textures_) gl_.BindTextureUnit(unit, texture.name());
      gl_.BindSampler(unit, sampler_.name());
    }
    gl_.ActiveTexture(GL_TEXTURE3);
    for (GLuint i = 0; i < StateGuard::ranges; ++i) {
      gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, buffer_.name());
      gl_.BindBufferBase(GL_UNIFORM_BUFFER, i, buffer_.name());
    }
    for (GLuint i = 0; i < StateGuard::images; ++i) {
      gl_.BindImageTexture(i, textures_[2].name(), 0, GL_TRUE, 0, GL_READ_WRITE, GL_RGBA32F);
    }
    gl_.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, buffer_.name());
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, buffer_.name());
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, buffer_.name());
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 2);
    gl_.PixelStorei(GL_UNPACK_ROW_LENGTH, 7);
    for (const GLenum capability : {GL_DEPTH_TEST, GL_CULL_FACE, GL_FRAMEBUFFER_SRGB, GL_CLIP_DISTANCE4, GL_DITHER}) {
      gl_.Enable(capability);
    }
    gl_.Disable(GL_MULTISAMPLE);
    gl_.ViewportIndexedf(0, 1.0F, 2.0F, 3.0F, 4.0F);
    gl_.ScissorIndexed(0, 1, 1, 1, 1);
    gl_.Enablei(GL_SCISSOR_TEST, 0);
    gl_.DepthRangeIndexed(0, 0.125, 0.625);
    gl_.DepthMask(GL_FALSE);
    gl_.DepthFunc(GL_NOTEQUAL);
    for (GLuint i = 0; i < StateGuard::blended_buffers; ++i) {
      gl_.BlendFuncSeparatei(i, GL_DST_COLOR, GL_DST_ALPHA, GL_ZERO, GL_ONE);
      gl_.BlendEquationSeparatei(i, GL_MIN, GL_FUNC_SUBTRACT);
    }
    for (GLuint i = 0; i < 8; ++i) {
      gl_.ColorMaski(i, GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
      gl_.Enablei(GL_BLEND, i);
    }
    gl_.CullFace(GL_FRONT_AND_BACK);
    gl_.FrontFace(GL_CW);
    gl_.PolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    gl_.ClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
  }

  /// Uses state with known values and leaves the values unchanged.
  void touch() const {
    const std::array<GLfloat, 4> nothing{};
    gl_.ClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, nothing.data());
    gl_.ClearTexImage(textures_[1].name(), 0, GL_RGBA, GL_FLOAT, nothing.data());
    std::array<GLfloat, 64> pixels{};
    gl_.GetTextureImage(textures_[1].name(), 0, GL_RGBA, GL_FLOAT, sizeof pixels, pixels.data());
    gl_.CullFace(GL_BACK);
    for (GLuint i = 0; i < StateGuard::blended_buffers; ++i) gl_.BlendEquationSeparatei(i, GL_FUNC_ADD, GL_FUNC_ADD);
    for (GLuint i = 1; i < 8; ++i) gl_.ColorMaski(i, GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  }

 private:
  const gl::Functions& gl_;
  Object buffer_;
  std::vector<Object> textures_;
  Object sampler_;
  Object vertex_array_;
  Object framebuffer_;
  mutable gl::Programs programs_;
};

/// A frame of the library: draws an image with depth into a framebuffer that also supplies host depth.
struct Frame {
  Frame(const gl::FunctionsPtr& functions, const gl::ProgramsPtr& programs)
      : gl_(functions), compositor(functions, programs), depth(functions, programs) {
    sum = gl::make_texture_2d(gl_, GL_RGBA32F, 8, 8, "sum");
    counts = gl::make_texture_2d(gl_, GL_RG32UI, 8, 8, "counts");
    z = gl::make_texture_2d(gl_, GL_R32F, 8, 8, "z");
    color = gl::make_texture_2d(gl_, GL_RGBA32F, 8, 8, "colour");
    depth_texture = gl::make_texture_2d(gl_, GL_DEPTH_COMPONENT32F, 8, 8, "depth");
    target = gl::make_framebuffer(gl_);
    gl_->NamedFramebufferTexture(target.name(), GL_COLOR_ATTACHMENT0, color.name(), 0);
    gl_->NamedFramebufferTexture(target.name(), GL_DEPTH_ATTACHMENT, depth_texture.name(), 0);
    const glm::vec4 radiance(0.5F, 0.25F, 0.125F, 0.5F);
    const glm::uvec2 samples(2U);
    const float half = 4.0F;
    gl_->ClearTexImage(sum.name(), 0, GL_RGBA, GL_FLOAT, &radiance);
    gl_->ClearTexImage(counts.name(), 0, GL_RG_INTEGER, GL_UNSIGNED_INT, &samples);
    gl_->ClearTexImage(z.name(), 0, GL_RED, GL_FLOAT, &half);
  }
  void draw() {
    StateGuard guard(*gl_);
    const float far = 1.0F;
    const glm::vec4 grey(0.5F);
    gl_->ClearTexImage(depth_texture.name(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, &far);
    gl_->ClearTexImage(color.name(), 0, GL_RGBA, GL_FLOAT, &grey);
    render::HostDepthInput input;
    input.source = render::DepthSource::framebuffer;
    input.name = target.name();
    input.viewport = {1, 1, 6, 6};
    input.target_size = {8U, 8U};
    input.depth_a = 1.0;
    input.depth_b = -1.0;
    depth.update(input);
    render::FrameTarget to;
    to.framebuffer = target.name();
    to.viewport = {1, 1, 6, 6};
    to.write_depth = true;
    to.depth_a = 1.0;
    to.depth_b = -1.0;
    render::Display display;
    display.transparent = true;
    render::PictureTextures picture;
    picture.sum = sum.name();
    picture.background = sum.name();
    picture.counts = counts.name();
    picture.size = {8U, 8U};
    picture.volume_z = z.name();
    if (denoise) {
      display.denoise = true;
      to.filter_ms = 1e6;
      picture.moments = z.name();
      picture.guides = render::PictureGuides{sum.name(), sum.name(), z.name(), z.name(), z.name()};
    }
    compositor.draw(picture, display, to);
  }
  /// Colors, then depths.
  [[nodiscard]] std::vector<float> read() const {
    const StateGuard guard(*gl_);
    std::vector<float> pixels(64 * 5);
    gl_->GetTextureImage(color.name(), 0, GL_RGBA, GL_FLOAT, 64 * 16, pixels.data());
    gl_->GetTextureImage(depth_texture.name(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, 64 * 4, &pixels[64 * 4]);
    return pixels;
  }

  gl::FunctionsPtr gl_;
  render::Compositor compositor;
  render::HostDepth depth;
  Object sum, counts, z, color, depth_texture, target;
  bool denoise = false;
};

TEST_P(State, StateReaderSeesScrambledState) {
  ScramblingHost host(gl_, legacy_);
  const GlState fresh = read_gl_state(*gl_, legacy_);
  EXPECT_EQ(state_differences(fresh, read_gl_state(*gl_, legacy_)), "");
  // Each value must have changed at some seed, except for a few that cannot have another value here.
  std::vector<bool> moved(fresh.size(), false);
  for (std::uint32_t seed = 0; seed < 24; ++seed) {
    host.scramble(seed);
    const GlState state = read_gl_state(*gl_, legacy_);
    for (std::size_t i = 0; i < state.size(); ++i) {
      if (state[i].values != fresh[i].values) moved[i] = true;
    }
  }
  std::string still;
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    if (!moved[i]) still += fresh[i].name + " ";
  }
  EXPECT_EQ(still,
            "GL_LINE_WIDTH GL_DRAW_BUFFER2 GL_DEBUG_GROUP_STACK_DEPTH GL_DEBUG_OUTPUT GL_DEBUG_CALLBACK_FUNCTION "
            "GL_DEBUG_CALLBACK_USER_PARAM " +
                (legacy_ ? std::string("GL_LIST_INDEX GL_RENDER_MODE GL_CURRENT_RASTER_POSITION ") : std::string()));
}

TEST_P(State, EverythingIsRestored) {
  ScramblingHost host(gl_, legacy_);
  const Scribbler scribbler(gl_);
  for (std::uint32_t seed = 0; seed < 32; ++seed) {
    host.scramble(seed);
    const GlState before = read_gl_state(*gl_, legacy_);
    {
      const StateGuard guard(*gl_);
      scribbler.scribble();
      ASSERT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR}) << seed;
    }
    ASSERT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR}) << seed;
    ASSERT_EQ(state_differences(before, read_gl_state(*gl_, legacy_)), "") << seed;
  }
}

/// For each seed in [first, second), scrambles the state and draws. The frame must be the same and leave the state
/// unchanged.
void expect_untouched(const gl::FunctionsPtr& functions, const cumulet::test::LegacyGlPtr& legacy, Frame& frame,
                      const std::vector<float>& expected, std::pair<std::uint32_t, std::uint32_t> seeds) {
  ScramblingHost host(functions, legacy);
  for (std::uint32_t seed = seeds.first; seed < seeds.second; ++seed) {
    host.scramble(seed);
    const GlState before = read_gl_state(*functions, legacy);
    frame.draw();
    ASSERT_EQ(functions->GetError(), GLenum{GL_NO_ERROR}) << seed;
    ASSERT_EQ(state_differences(before, read_gl_state(*functions, legacy)), "") << seed;
    const std::vector<float> read = frame.read();
    const auto [is, was] = std::ranges::mismatch(read, expected);
    ASSERT_EQ(is, read.end()) << seed << ": " << *is << " for " << *was << " at " << is - read.begin();
    ASSERT_EQ(state_differences(before, read_gl_state(*functions, legacy)), "") << seed;
  }
}

TEST_P(State, DenoisedFrameRestoresStateAndDoesNotReadIt) {
  Frame frame(gl_, programs_);
  frame.draw();
  EXPECT_EQ(frame.compositor.bytes(), 64U * 16U);
  frame.denoise = true;
  frame.draw();
  EXPECT_EQ(frame.compositor.bytes(), 64U * (16U + 112U));
  const std::vector<float> expected = frame.read();
  expect_untouched(gl_, legacy_, frame, expected, {200, 216});
}

TEST_P(State, FrameRestoresStateAndDoesNotReadIt) {
  Frame frame(gl_, programs_);
  frame.draw();
  const std::vector<float> expected = frame.read();
  EXPECT_NE(expected[4 * 9], expected[0]);           // drawn inside the viewport
  EXPECT_EQ(expected[64 * 4 + 9], 1.0F - 1.0F / 4);  // with its depth
  EXPECT_EQ(expected[64 * 4], 1.0F);
  expect_untouched(gl_, legacy_, frame, expected, {100, 132});
}

TEST_P(State, StateDuringAFrameDoesNotDependOnTheHost) {
  ScramblingHost host(gl_, legacy_);
  const Scribbler scribbler(gl_);
  const auto is_known = [](const std::string& name) {
    for (const char* prefix : {"GL_PACK_",
                               "GL_UNPACK_",
                               "GL_BLEND[",
                               "GL_COLOR_WRITEMASK",
                               "GL_PIXEL_",
                               "GL_DEPTH_TEST",
                               "GL_DEPTH_CLAMP",
                               "GL_DEPTH_FUNC",
                               "GL_DEPTH_WRITEMASK",
                               "GL_CULL_FACE",
                               "GL_DITHER",
                               "GL_FRAMEBUFFER_SRGB",
                               "GL_CLIP_",
                               "GL_POLYGON_MODE",
                               "GL_SCISSOR_TEST[0]",
                               "GL_BLEND_SRC_RGB[0]",
                               "GL_BLEND_EQUATION_RGB[1]",
                               "GL_RASTERIZER_DISCARD",
                               "GL_FRONT_FACE",
                               "GL_DEPTH_RANGE[0]"}) {
      if (name.rfind(prefix, 0) == 0) return true;
    }
    return false;
  };
  std::vector<GlState> states;
  for (const bool restore : {true, false, true, false}) {
    host.scramble(static_cast<std::uint32_t>(7 + states.size()));
    const StateGuard guard(*gl_, restore);
    scribbler.touch();
    GlState known;
    for (const auto& value : read_gl_state(*gl_, legacy_)) {
      if (is_known(value.name)) known.push_back(value);
    }
    ASSERT_GT(known.size(), 60U);
    states.push_back(std::move(known));
  }
  for (const GlState& state : states) EXPECT_EQ(state_differences(states[0], state), "");
}

TEST_P(State, WithHostResetsOnlyDocumentedStateChanges) {
  ScramblingHost host(gl_, legacy_);
  const Scribbler scribbler(gl_);
  host.scramble(5);
  const GlState before = read_gl_state(*gl_, legacy_);
  GlState inside;
  {
    const StateGuard guard(*gl_, false);
    scribbler.scribble();
    inside = read_gl_state(*gl_, legacy_);
  }
  const GlState after = read_gl_state(*gl_, legacy_);
  EXPECT_EQ(state_differences(inside, after), "");  // nothing was restored
  EXPECT_NE(state_differences(before, after), "");
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].values == after[i].values) continue;
    const std::string& name = before[i].name;
    for (const char* untouched :
         {"GL_STENCIL_FUNC", "GL_STENCIL_BACK_FUNC", "GL_STENCIL_WRITEMASK", "GL_BLEND_COLOR", "GL_ARRAY_",
          "GL_RENDERBUFFER", "GL_COPY_", "GL_HINT", "GL_TEXTURE_BINDING_CUBE", "GL_TEXTURE_BINDING_1D",
          "GL_TEXTURE_BINDING_RECT", "GL_LOGIC_OP", "GL_SAMPLE_MASK_VALUE", "GL_TRANSFORM", "GL_ATOMIC", "GL_CLEAR"}) {
      EXPECT_NE(name.rfind(untouched, 0), 0U) << name;
    }
    for (const char* higher :
         {"GL_VIEWPORT[1]", "GL_SCISSOR_BOX[1]", "GL_SCISSOR_TEST[1]", "GL_DEPTH_RANGE[1]", "GL_TEXTURE_BINDING_2D[16]",
          "GL_SAMPLER_BINDING[16]", "GL_UNIFORM_BUFFER_BINDING[8]", "GL_BLEND_SRC_RGB[2]"}) {
      EXPECT_NE(name, higher);
    }
  }
}

TEST_P(State, GuardsNest) {
  ScramblingHost host(gl_, legacy_);
  const Scribbler scribbler(gl_);
  host.scramble(11);
  const GlState before = read_gl_state(*gl_, legacy_);
  {
    const StateGuard outer(*gl_);
    scribbler.scribble();
    const GlState between = read_gl_state(*gl_, legacy_);
    {
      const StateGuard inner(*gl_);
      scribbler.scribble();
    }
    EXPECT_EQ(state_differences(between, read_gl_state(*gl_, legacy_)), "");
  }
  EXPECT_EQ(state_differences(before, read_gl_state(*gl_, legacy_)), "");
}

GLint integer(const gl::Functions& gl, GLenum name) {
  GLint value = -1;
  gl.GetIntegerv(name, &value);
  return value;
}

TEST_P(State, HostProgramsWithAFailedRelinkAreHandled) {
  const Scribbler scribbler(gl_);
  const gl::ProgramKey key{"composite.frag", {"CM_DEPTH 1"}, "composite.vert"};
  const GLuint name = programs_->get(key).name();
  // After a failed relink the program still runs, but cannot be made current again.
  gl_->UseProgram(name);
  Object shader(gl_, Object::Kind::shader, gl_->CreateShader(GL_FRAGMENT_SHADER));
  const char* nonsense = "#version 450\nnonsense\n";
  gl_->ShaderSource(shader.name(), 1, &nonsense, nullptr);
  gl_->CompileShader(shader.name());
  gl_->AttachShader(name, shader.name());
  gl_->LinkProgram(name);
  { const StateGuard untouched(*gl_); }
  EXPECT_EQ(integer(*gl_, GL_CURRENT_PROGRAM), static_cast<GLint>(name));
  {
    const StateGuard guard(*gl_);
    scribbler.scribble();
  }
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  EXPECT_EQ(integer(*gl_, GL_CURRENT_PROGRAM), 0);

  // A program deleted while current exists until another becomes current.
  auto others = std::make_unique<gl::Programs>(*gl_, nullptr);
  const GLuint second = others->get(key).name();
  const auto second_name = static_cast<GLint>(second);
  gl_->UseProgram(second);
  others.reset();
  { const StateGuard untouched(*gl_); }
  EXPECT_EQ(integer(*gl_, GL_CURRENT_PROGRAM), second_name);
  {
    const StateGuard guard(*gl_);
    scribbler.scribble();
  }
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  EXPECT_EQ(integer(*gl_, GL_CURRENT_PROGRAM), 0);
}

/// EGL's own functions, for a second context that shares objects with the test's.
struct SharedContext {
  using Handle = void*;
  void* library = dlopen("libEGL.so.1", RTLD_NOW);
  Handle display = nullptr;
  Handle first = nullptr;
  Handle second = nullptr;

  template <class Function>
  Function get(const char* name) const {
    return reinterpret_cast<Function>(dlsym(library, name));
  }
  SharedContext() {
    display = get<Handle (*)()>("eglGetCurrentDisplay")();
    first = get<Handle (*)()>("eglGetCurrentContext")();
    const std::array<int, 7> attributes{0x3098, 4, 0x30FB, 5, 0x30FD, 1, 0x3038};  // version 4.5, core
    int config_id = 0;
    get<unsigned (*)(Handle, Handle, int, int*)>("eglQueryContext")(display, first, 0x3028, &config_id);
    const std::array<int, 3> wanted{0x3028, config_id, 0x3038};
    Handle config = nullptr;
    int count = 0;
    if (config_id != 0) {
      get<unsigned (*)(Handle, const int*, Handle*, int, int*)>("eglChooseConfig")(display, wanted.data(), &config, 1,
                                                                                   &count);
    }
    second = get<Handle (*)(Handle, Handle, Handle, const int*)>("eglCreateContext")(display, config, first,
                                                                                     attributes.data());
  }
  SharedContext(const SharedContext&) = delete;
  SharedContext& operator=(const SharedContext&) = delete;
  ~SharedContext() {
    use(first);
    get<unsigned (*)(Handle, Handle)>("eglDestroyContext")(display, second);
  }
  void use(Handle context) const {
    ASSERT_EQ(get<unsigned (*)(Handle, Handle, Handle, Handle)>("eglMakeCurrent")(display, nullptr, nullptr, context),
              1U);
  }
};

TEST_P(State, ObjectsDeletedInAnotherContextWhileBound) {
  if (GetParam() != Backend::egl) GTEST_SKIP() << "OSMesa is asked for no shared contexts here";
  const Scribbler scribbler(gl_);
  const SharedContext shared;
  ASSERT_NE(shared.second, nullptr);
  for (const bool reused : {false, true}) {
    Object texture = gl::make_texture_2d(gl_, GL_RGBA8, 4, 4, "texture");
    Object sampler = gl::make_sampler(gl_);
    Object buffer = gl::make_buffer(gl_, 1024, nullptr, 0, "buffer");
    const auto name = static_cast<GLint>(texture.name());
    gl_->BindTextureUnit(2, texture.name());
    gl_->BindSampler(2, sampler.name());
    gl_->BindBufferRange(GL_SHADER_STORAGE_BUFFER, 1, buffer.name(), 256, 16);
    gl_->BindBuffer(GL_PIXEL_PACK_BUFFER, buffer.name());
    gl_->BindImageTexture(1, texture.name(), 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA8);
    shared.use(shared.second);
    texture = {};
    sampler = {};
    buffer = {};
    gl_->Finish();
    // The driver may reuse the names for objects of another target.
    std::vector<Object> others;
    for (int i = 0; reused && i < 8; ++i) others.push_back(gl::make_texture_3d(gl_, GL_R8, 2, 2, 2, "another"));
    shared.use(shared.first);
    gl_->ActiveTexture(GL_TEXTURE2);
    ASSERT_EQ(integer(*gl_, GL_TEXTURE_BINDING_2D), name);  // still bound here
    const GlState before = read_gl_state(*gl_, legacy_);
    {
      const StateGuard guard(*gl_);
      gl_->UseProgram(0);
    }
    const std::string lost = state_differences(before, read_gl_state(*gl_, legacy_));
    EXPECT_EQ(lost.find("GL_TEXTURE_BINDING"), std::string::npos)
        << lost;  // bindings that the guard did not save are unchanged
    {
      const StateGuard guard(*gl_);
      scribbler.scribble();
    }
    EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
    gl_->ActiveTexture(GL_TEXTURE2);
    // Some drivers (NVIDIA's) still accept the name of an object that is bound elsewhere.
    EXPECT_TRUE(integer(*gl_, GL_TEXTURE_BINDING_2D) == 0 || integer(*gl_, GL_TEXTURE_BINDING_2D) == name);
    EXPECT_EQ(integer(*gl_, GL_SAMPLER_BINDING), 0);
    EXPECT_EQ(integer(*gl_, GL_PIXEL_PACK_BUFFER_BINDING), 0);
    gl_->BindTexture(GL_TEXTURE_3D, 0);
  }
}

TEST_P(State, ImageUnitsWithoutATexture) {
  const Scribbler scribbler(gl_);
  gl_->BindImageTexture(0, 0, 2, GL_TRUE, 3, GL_WRITE_ONLY, GL_RGBA16F);
  const GLuint none = 0;
  gl_->BindImageTextures(1, 1, &none);
  const GlState before = read_gl_state(*gl_, legacy_);
  {
    const StateGuard guard(*gl_);
    scribbler.scribble();
  }
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  EXPECT_EQ(state_differences(before, read_gl_state(*gl_, legacy_)), "");
}

TEST_P(State, GuardDurationIsMeasured) {
  ScramblingHost host(gl_, legacy_);
  host.scramble(3);
  for (const bool restore : {true, false}) {
    std::vector<double> times;
    for (int i = 0; i < 400; ++i) {
      const auto start = std::chrono::steady_clock::now();
      { const StateGuard guard(*gl_, restore); }
      times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
    }
    std::nth_element(times.begin(), times.begin() + 200, times.end());
    std::printf("%s: %.1f us\n", restore ? "save, set and restore" : "set", times[200]);
    EXPECT_LT(times[200], 5000.0);
  }
}

}  // namespace
