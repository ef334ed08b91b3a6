// A host that sets all state to unusual values before each [GL] call of the API, and compares all of it afterwards.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "settings/aov_table.hpp"
#include "support/c_host.hpp"
#include "support/gl_state.hpp"
#include "support/gltf_seeds.hpp"
#include "support/scrambling_host.hpp"

namespace {

using cumulet::headless::Context;
using cumulet::test::converge;
using cumulet::test::GlTest;
using cumulet::test::HostTarget;
using cumulet::test::make_desc;
using cumulet::test::read_gl_state;
using cumulet::test::ScramblingHost;
using cumulet::test::state_differences;
using cumulet::test::ViewerPtr;

constexpr int side = 24;

class StateScramble : public GlTest {
 protected:
  /// Scrambles, calls and compares. A GL error of the host may be pending before.
  void expect_kept(ScramblingHost& host, std::uint32_t seed, const std::string& what,
                   const std::function<cumulet_status()>& call) {
    SCOPED_TRACE(what + ", seed " + std::to_string(seed));
    host.scramble(seed);
    const auto before = read_gl_state(*gl_, legacy_);
    const cumulet_status status = call();
    EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
    EXPECT_EQ(state_differences(before, read_gl_state(*gl_, legacy_)), "");
    EXPECT_EQ(status, CUMULET_OK);
  }
  [[nodiscard]] cumulet_create_desc create_desc() const {
    auto create = make_desc<cumulet_create_desc>();
    create.get_proc = Context::get_proc;
    create.get_proc_user = context_.get();
    return create;
  }
};

TEST_P(StateScramble, ReadsWithoutWaitingRestoreTheState) {
  ScramblingHost host(gl_, legacy_);
  const HostTarget target(*gl_, side, side);
  const auto ball = cumulet::test::make_ball(12);
  const ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  cumulet_viewer* v = viewer.get();
  ASSERT_EQ(cumulet_set_volume(v, ball.get()), CUMULET_OK);
  converge(v, target.frame());
  auto desc = make_desc<cumulet_read_desc>();
  std::vector<float> values(std::size_t{4} * side * side);
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    desc.source = seed % 2 == 0 ? CUMULET_READ_LINEAR : CUMULET_READ_AOV;
    auto info = make_desc<cumulet_read_info>();
    std::uint64_t read = 0;
    expect_kept(host, seed, "begin_read", [&] { return cumulet_begin_read(v, &desc, &read); });
    while (info.ready == 0 && !HasFailure()) {
      expect_kept(host, seed, "finish_read",
                  [&] { return cumulet_finish_read(v, read, values.data(), values.size(), &info); });
    }
    expect_kept(host, seed, "cancel_read", [&] { return cumulet_cancel_read(v, read); });
  }
}

TEST_P(StateScramble, EveryCallRestoresTheState) {
  ScramblingHost host(gl_, legacy_);
  const HostTarget target(*gl_, side, side);
  const auto small = cumulet::test::make_ball(12);
  const auto large = cumulet::test::make_ball(16);
  std::uint32_t seed = 0;

  cumulet_viewer* made = nullptr;
  const cumulet_create_desc create = create_desc();
  expect_kept(host, ++seed, "create", [&] { return cumulet_create(&create, &made, nullptr, 0); });
  ASSERT_NE(made, nullptr);
  cumulet_destroy(made);
  ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  cumulet_viewer* v = viewer.get();
  expect_kept(host, ++seed, "detach", [&] { return cumulet_detach(v); });
  expect_kept(host, ++seed, "attach", [&] { return cumulet_attach(v, Context::get_proc, context_.get()); });

  const auto render = [&](const std::string& what, const cumulet_frame_desc& frame) {
    for (int i = 0; i < 2; ++i) {
      expect_kept(host, ++seed, "render " + what, [&] { return cumulet_render(v, &frame, nullptr); });
    }
  };
  render("nothing", target.frame());
  // Each grid type and view mode: their uploads, their first frames, and frames that only draw.
  for (const cumulet_grid_type march : {CUMULET_GRID_TETRAHEDRAL, CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS}) {
    auto grid = make_desc<cumulet_grid_desc>();
    grid.type = march;
    ASSERT_EQ(cumulet_set_grid(v, &grid), CUMULET_OK);
    ASSERT_EQ(cumulet_set_volume(v, march == CUMULET_GRID_DENSE ? large.get() : small.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
    for (const cumulet_view_mode view :
         {CUMULET_VIEW_CELLS, CUMULET_VIEW_STEPS, CUMULET_VIEW_DENSITY, CUMULET_VIEW_WIREFRAME, CUMULET_VIEW_SHADED}) {
      auto sampling = make_desc<cumulet_sampling_desc>();
      sampling.samples = 2;
      sampling.view = view;
      ASSERT_EQ(cumulet_set_sampling(v, &sampling), CUMULET_OK);
      render("march " + std::to_string(march) + " view " + std::to_string(view), target.frame());
    }
  }
  converge(v, target.frame());

  for (const auto& [color, format] : std::initializer_list<std::pair<cumulet_color_encoding, GLenum>>{
           {CUMULET_COLOR_SRGB, GL_RGBA8},
           {CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_SRGB8_ALPHA8},
           {CUMULET_COLOR_LINEAR, GL_RGBA16F},
           {CUMULET_COLOR_HDR, GL_RGBA16F}}) {
    const HostTarget encoded(*gl_, side, side, format);
    cumulet_frame_desc frame = encoded.frame();
    frame.color = color;
    render("color encoding " + std::to_string(color), frame);
  }
  cumulet_frame_desc frame = target.frame();
  frame.blend = CUMULET_BLEND_REPLACE;
  frame.flip_y = 1;
  render("replace, flipped", frame);
  frame.viewport[0] = 3;
  frame.viewport[1] = 4;
  frame.viewport[2] = frame.viewport[3] = 9;
  render("in a rectangle", frame);
  frame = target.frame();
  frame.target = CUMULET_TARGET_TEXTURE;
  frame.write_depth = 1;
  render("into its own texture", frame);
  frame.width = side + 8;
  render("into another texture", frame);
  frame.target = CUMULET_TARGET_NONE;
  render("into nothing", frame);
  frame.width = 0;
  render("of no size", frame);

  // The host's depth from each kind of source.
  frame = target.frame();
  frame.write_depth = 1;
  frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
  frame.depth_name = target.depth_texture();
  render("with a depth texture", frame);
  frame.depth_source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER;
  frame.depth_name = target.framebuffer();
  render("with a framebuffer's depth", frame);
  GLuint multisampled = 0;
  gl_->CreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &multisampled);
  gl_->TextureStorage2DMultisample(multisampled, 4, GL_DEPTH_COMPONENT32F, side, side, GL_TRUE);
  frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE;
  frame.depth_name = multisampled;
  render("with multisampled depth", frame);

  converge(v, target.frame());
  std::vector<float> rgba(std::size_t{side} * side * 4);
  std::vector<std::uint8_t> bytes(rgba.size());
  auto pick = make_desc<cumulet_pick>();
  double noise = 0.0;
  for (int i = 0; i < 3; ++i) {
    for (const cumulet_map_light light : {CUMULET_MAP_LIGHT_SUN, CUMULET_MAP_LIGHT_POINT}) {
      auto desc = make_desc<cumulet_transmittance_map_desc>();
      auto map = make_desc<cumulet_transmittance_map>();
      desc.light = light;
      expect_kept(host, ++seed, "transmittance map", [&] { return cumulet_update_transmittance_map(v, &desc, &map); });
    }
    expect_kept(host, ++seed, "drop it", [&] { return cumulet_destroy_transmittance_map(v, 0); });
    expect_kept(host, ++seed, "pick_at", [&] { return cumulet_pick_at(v, side / 2.0, side / 2.0, &pick); });
    expect_kept(host, ++seed, "read_linear", [&] { return cumulet_read_linear(v, rgba.data(), rgba.size()); });
    expect_kept(host, ++seed, "read_display", [&] { return cumulet_read_display(v, bytes.data(), bytes.size()); });
    expect_kept(host, ++seed, "measure_noise", [&] { return cumulet_measure_noise(v, &noise); });
  }
  expect_kept(host, ++seed, "detach", [&] { return cumulet_detach(v); });
  expect_kept(host, ++seed, "attach", [&] { return cumulet_attach(v, Context::get_proc, context_.get()); });
  render("anew", target.frame());
  expect_kept(host, ++seed, "destroy", [&] {
    viewer.reset();
    return CUMULET_OK;
  });
  gl_->DeleteTextures(1, &multisampled);
}

// With surfaces in all variants: textures, blended ones, lights and emitters; each lighting mode, path traced and
// rasterized, previews, each kind of host depth, targets, read-backs and AOVs.
TEST_P(StateScramble, EveryCallWithSurfacesRestoresTheState) {
  ScramblingHost host(gl_, legacy_);
  const HostTarget target(*gl_, side, side);
  const auto volume = cumulet::test::make_ball(12);
  const auto file = cumulet::test::seed_materials().glb();
  cumulet_surfaces* out = nullptr;
  std::array<char, 256> error{};
  ASSERT_EQ(cumulet_surfaces_from_memory(file.data(), file.size(), nullptr, nullptr, &out, error.data(), error.size()),
            CUMULET_OK)
      << error.data();
  const cumulet::test::SurfacesRef surfaces(out);
  ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  cumulet_viewer* v = viewer.get();
  std::uint32_t seed = 300;
  const auto render = [&](const std::string& what, cumulet_frame_desc frame) {
    frame.budget_ms = 1.0;
    expect_kept(host, ++seed, "render " + what, [&] { return cumulet_render(v, &frame, nullptr); });
  };
  GLuint multisampled = 0;
  gl_->CreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &multisampled);
  gl_->TextureStorage2DMultisample(multisampled, 4, GL_DEPTH_COMPONENT32F, side, side, GL_TRUE);

  // Surfaces without a volume; then with one.
  ASSERT_EQ(cumulet_set_surfaces(v, surfaces.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
  render("surfaces alone", target.frame());
  ASSERT_EQ(cumulet_set_volume(v, volume.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
  std::vector<float> rgba(std::size_t{side} * side * 4);
  std::vector<std::uint8_t> bytes(rgba.size());
  auto pick = make_desc<cumulet_pick>();
  double noise = 0.0;
  for (const cumulet_surface_lighting light :
       {CUMULET_SURFACE_LIGHTING_RASTERIZED, CUMULET_SURFACE_LIGHTING_GLOBAL, CUMULET_SURFACE_LIGHTING_DIRECT}) {
    const std::string name = "light " + std::to_string(light);
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = light;
    ASSERT_EQ(cumulet_set_surface_settings(v, &settings), CUMULET_OK);
    for (const cumulet_preview preview : {CUMULET_PREVIEW_AUTO, CUMULET_PREVIEW_OFF}) {
      auto sampling = make_desc<cumulet_sampling_desc>();
      sampling.samples = 1;
      sampling.preview = preview;
      sampling.separate_volume_aov = 1;
      ASSERT_EQ(cumulet_set_sampling(v, &sampling), CUMULET_OK);
      cumulet_frame_desc frame = target.frame();
      frame.write_depth = 1;
      render(name + " with depth out", frame);
      frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
      frame.depth_name = target.depth_texture();
      render(name + " and a depth texture", frame);
      frame.depth_source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER;
      frame.depth_name = target.framebuffer();
      render(name + " and a framebuffer's depth", frame);
      frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE_MULTISAMPLE;
      frame.depth_name = multisampled;
      render(name + " and multisampled depth", frame);
      frame = target.frame();
      frame.target = CUMULET_TARGET_TEXTURE;
      render(name + " into its own texture", frame);
      render(name, target.frame());
    }
    for (const cumulet_view_mode view : {CUMULET_VIEW_CELLS, CUMULET_VIEW_SHADED}) {
      auto sampling = make_desc<cumulet_sampling_desc>();
      sampling.samples = 1;
      sampling.preview = CUMULET_PREVIEW_OFF;
      sampling.view = view;
      sampling.separate_volume_aov = 1;
      ASSERT_EQ(cumulet_set_sampling(v, &sampling), CUMULET_OK);
      render(name + " view " + std::to_string(view), target.frame());
    }
    converge(v, target.frame());
    for (const cumulet::settings::Aov& aov : cumulet::settings::aovs) {
      expect_kept(host, ++seed, name + " aov " + std::to_string(aov.value),
                  [&] { return cumulet_read_aov(v, aov.value, rgba.data(), rgba.size()); });
    }
    expect_kept(host, ++seed, "pick_at", [&] { return cumulet_pick_at(v, side / 2.0, side / 2.0, &pick); });
    expect_kept(host, ++seed, "read_linear", [&] { return cumulet_read_linear(v, rgba.data(), rgba.size()); });
    expect_kept(host, ++seed, "read_display", [&] { return cumulet_read_display(v, bytes.data(), bytes.size()); });
    expect_kept(host, ++seed, "measure_noise", [&] { return cumulet_measure_noise(v, &noise); });
  }
  ASSERT_EQ(cumulet_set_surfaces(v, nullptr), CUMULET_OK);
  render("without them", target.frame());
  expect_kept(host, ++seed, "destroy", [&] {
    viewer.reset();
    return CUMULET_OK;
  });
  gl_->DeleteTextures(1, &multisampled);
}

// With an environment and with a physical sky: their uploads, previews, and removal.
TEST_P(StateScramble, EveryCallWithAnEnvironmentRestoresTheState) {
  ScramblingHost host(gl_, legacy_);
  const HostTarget target(*gl_, side, side);
  const auto volume = cumulet::test::make_ball(12);
  const auto panes = cumulet::test::make_panes(3.0F);
  const auto small = cumulet::test::make_environment(64, 32);
  const auto large = cumulet::test::make_environment(1024, 512);
  ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  cumulet_viewer* v = viewer.get();
  ASSERT_EQ(cumulet_set_volume(v, volume.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(v, panes.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
  std::uint32_t seed = 500;
  const auto render = [&](const std::string& what) {
    cumulet_frame_desc frame = target.frame();
    frame.budget_ms = 1.0;
    for (int i = 0; i < 2; ++i) {
      expect_kept(host, ++seed, "render " + what, [&] { return cumulet_render(v, &frame, nullptr); });
    }
  };
  const auto ground = [&](cumulet_ground_mode mode) {
    auto desc = make_desc<cumulet_ground_desc>();
    desc.mode = mode;
    ASSERT_EQ(cumulet_set_ground(v, &desc), CUMULET_OK);
  };
  for (const cumulet_surface_lighting light : {CUMULET_SURFACE_LIGHTING_RASTERIZED, CUMULET_SURFACE_LIGHTING_GLOBAL}) {
    const std::string name = ", light " + std::to_string(light);
    auto settings = make_desc<cumulet_surface_settings_desc>();
    settings.lighting = light;
    ASSERT_EQ(cumulet_set_surface_settings(v, &settings), CUMULET_OK);
    ASSERT_EQ(cumulet_set_environment(v, large.get()), CUMULET_OK);
    render("a large environment" + name);
    ASSERT_EQ(cumulet_set_environment(v, small.get()), CUMULET_OK);
    render("another" + name);
    auto turned = make_desc<cumulet_environment_settings_desc>();
    turned.rotation_degrees = 30.0F;
    turned.strength = 2.0F;
    ASSERT_EQ(cumulet_set_environment_settings(v, &turned), CUMULET_OK);
    render("turned" + name);
    ground(CUMULET_GROUND_BELOW);
    render("over a ground" + name);
    ASSERT_EQ(cumulet_set_environment(v, nullptr), CUMULET_OK);
    auto day = make_desc<cumulet_sun_sky_desc>();
    day.sky = CUMULET_SKY_PHYSICAL;
    day.sun_elevation_degrees = 40.0F;
    ASSERT_EQ(cumulet_set_sun_sky(v, &day), CUMULET_OK);
    render("while a sky is computed" + name);
    ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
    render("a sky" + name);
    ground(CUMULET_GROUND_NONE);
    ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
    render("no ground" + name);
  }
  converge(v, target.frame());
  expect_kept(host, ++seed, "detach", [&] { return cumulet_detach(v); });
  ASSERT_EQ(cumulet_set_environment(v, large.get()), CUMULET_OK);
  expect_kept(host, ++seed, "attach", [&] { return cumulet_attach(v, Context::get_proc, context_.get()); });
  render("anew");
  expect_kept(host, ++seed, "destroy", [&] {
    viewer.reset();
    return CUMULET_OK;
  });
}

// Failing calls preserve the state too.
TEST_P(StateScramble, FailedCallsRestoreTheState) {
  ScramblingHost host(gl_, legacy_);
  const HostTarget target(*gl_, side, side);
  const ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  const auto volume = cumulet::test::make_ball(12);
  cumulet::test::picture_of(viewer.get(), volume.get(), target);
  const auto fails = [&](std::uint32_t seed, const std::function<cumulet_status()>& call) {
    expect_kept(host, seed, "a failing call", [&] {
      EXPECT_NE(call(), CUMULET_OK);
      return CUMULET_OK;
    });
  };
  cumulet_frame_desc frame = target.frame();
  frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
  frame.depth_name = 4321;  // no such texture
  fails(100, [&] { return cumulet_render(viewer.get(), &frame, nullptr); });
  frame = target.frame();
  frame.framebuffer = 4321;
  fails(101, [&] { return cumulet_render(viewer.get(), &frame, nullptr); });
  float one = 0.0F;
  fails(102, [&] { return cumulet_read_linear(viewer.get(), &one, 1); });
}

// The drawn image does not depend on the state either.
TEST_P(StateScramble, ImageDoesNotDependOnTheHostsState) {
  const HostTarget target(*gl_, side, side);
  const auto volume = cumulet::test::make_ball(12);
  const auto draw = [&] {
    auto viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get(), .samples = 2});
    if (cumulet_set_volume(viewer.get(), volume.get()) != CUMULET_OK) throw std::runtime_error("set_volume");
    auto frame = target.frame();
    frame.write_depth = 1;
    converge(viewer.get(), frame);
  };
  target.clear({}, 1.0F);
  draw();
  const auto pixels = target.pixels();
  const auto depths = target.depths();
  EXPECT_GT(*std::max_element(pixels.begin(), pixels.end()), 60);
  EXPECT_LT(*std::min_element(depths.begin(), depths.end()), 1.0F);
  ScramblingHost host(gl_, legacy_);
  for (std::uint32_t seed = 200; seed < 212; ++seed) {
    SCOPED_TRACE(seed);
    target.clear({}, 1.0F);
    host.scramble(seed);
    draw();
    // Sets the pack state that the host needs for reading.
    for (const GLenum name : {GL_PACK_ROW_LENGTH, GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_ROWS, GL_PACK_SWAP_BYTES,
                              GL_PACK_LSB_FIRST, GL_PACK_IMAGE_HEIGHT, GL_PACK_SKIP_IMAGES})
      gl_->PixelStorei(name, 0);
    gl_->BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    EXPECT_EQ(target.pixels(), pixels);
    EXPECT_EQ(target.depths(), depths);
    gl_->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl_->DepthMask(GL_TRUE);
    gl_->Disable(GL_SCISSOR_TEST);
    gl_->Disable(GL_RASTERIZER_DISCARD);
  }
}

// Pending errors of the host are cleared. Its debug callback and filters stay.
TEST_P(StateScramble, PendingErrorsAreDroppedAndTheDebugCallbackIsTheHosts) {
  const HostTarget target(*gl_, side, side);
  const ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get()});
  const auto volume = cumulet::test::make_ball(12);
  int messages = 0;
  const auto callback = [](GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar*, const void* user) {
    if (type == GL_DEBUG_TYPE_ERROR) ++*static_cast<int*>(const_cast<void*>(user));
  };
  gl_->Enable(GL_DEBUG_OUTPUT);
  gl_->DebugMessageCallback(callback, &messages);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
  gl_->Enable(GL_FLOAT);  // not a capability
  converge(viewer.get(), target.frame());
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  void* function = nullptr;
  void* user = nullptr;
  gl_->GetPointerv(GL_DEBUG_CALLBACK_FUNCTION, &function);
  gl_->GetPointerv(GL_DEBUG_CALLBACK_USER_PARAM, &user);
  const GLDEBUGPROC expected = callback;
  EXPECT_EQ(function, reinterpret_cast<void*>(expected));
  EXPECT_EQ(user, &messages);
  EXPECT_LE(messages, 1);  // the host's own error, none of the library's
  gl_->DebugMessageCallback(nullptr, nullptr);
}

/// A program with a varying that transform feedback captures.
GLuint make_capturing_program(const GladGLContext& gl) {
  const char* source = "#version 450\nout float captured;\nvoid main() { captured = 1.0; gl_Position = vec4(0); }\n";
  const GLuint shader = gl.CreateShader(GL_VERTEX_SHADER);
  gl.ShaderSource(shader, 1, &source, nullptr);
  gl.CompileShader(shader);
  const GLuint program = gl.CreateProgram();
  gl.AttachShader(program, shader);
  const char* varying = "captured";
  gl.TransformFeedbackVaryings(program, 1, &varying, GL_INTERLEAVED_ATTRIBS);
  gl.LinkProgram(program);
  gl.DeleteShader(shader);
  return program;
}

// The host's queries may be active, and its transform feedback paused.
TEST_P(StateScramble, QueriesAndPausedTransformFeedbackContinue) {
  const HostTarget target(*gl_, side, side);
  const auto volume = cumulet::test::make_ball(12);
  ViewerPtr viewer = cumulet::test::make_viewer({.get_proc = Context::get_proc, .user = context_.get(), .samples = 2});
  cumulet_viewer* v = viewer.get();
  const auto expected = cumulet::test::picture_of(v, volume.get(), target);
  constexpr std::array<GLenum, 4> kinds{GL_SAMPLES_PASSED, GL_PRIMITIVES_GENERATED, GL_TIME_ELAPSED,
                                        GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN};
  std::array<GLuint, kinds.size()> queries{};
  const GLuint program = make_capturing_program(*gl_);
  GLuint vertices = 0;
  GLuint array = 0;
  gl_->CreateBuffers(1, &vertices);
  gl_->NamedBufferStorage(vertices, 64, nullptr, 0);
  gl_->CreateVertexArrays(1, &array);
  gl_->BindVertexArray(array);
  gl_->BindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, vertices);
  gl_->UseProgram(program);
  gl_->BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer());
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    gl_->CreateQueries(kinds[i], 1, &queries[i]);
    gl_->BeginQuery(kinds[i], queries[i]);
  }
  gl_->BeginTransformFeedback(GL_POINTS);
  gl_->DrawArrays(GL_POINTS, 0, 3);

  gl_->PauseTransformFeedback();
  const auto the_same = cumulet::test::make_ball(12);  // uploaded and traced again
  EXPECT_TRUE(cumulet::test::picture_of(v, the_same.get(), target) == expected);
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  GLint current = 0;
  gl_->GetIntegerv(GL_CURRENT_PROGRAM, &current);
  EXPECT_EQ(static_cast<GLuint>(current), program);
  gl_->ResumeTransformFeedback();
  gl_->DrawArrays(GL_POINTS, 0, 3);
  gl_->EndTransformFeedback();
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    GLint active = 0;
    gl_->GetQueryiv(kinds[i], GL_CURRENT_QUERY, &active);
    EXPECT_EQ(static_cast<GLuint>(active), queries[i]) << i;
    gl_->EndQuery(kinds[i]);
  }
  GLuint written = 0;
  gl_->GetQueryObjectuiv(queries.back(), GL_QUERY_RESULT, &written);
  EXPECT_EQ(written, 6U);
  EXPECT_EQ(gl_->GetError(), GLenum{GL_NO_ERROR});
  EXPECT_TRUE(cumulet::test::drawn_once(v, target) == expected);
  gl_->DeleteQueries(static_cast<GLsizei>(queries.size()), queries.data());
  gl_->UseProgram(0);
  gl_->DeleteProgram(program);
  gl_->DeleteBuffers(1, &vertices);
  gl_->DeleteVertexArrays(1, &array);
}

CUMULET_ON_PROFILES(StateScramble);

}  // namespace
