// The embedding contract of docs/architecture.md, one test per point, using only cumulet.h and cumulet.hpp. Points that
// need more than one test (all state, all allocations, threads, windows) are in robustness_test.cpp and tests/embed.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "support/c_host.hpp"
#include "support/fake_gl.hpp"
#include "support/folder.hpp"
#include "support/radiance.hpp"
#include "viewer/c_fields.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::CameraRef;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::EnvironmentRef;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

constexpr int side = 32;

class Contract : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr viewer(cumulet::test::ViewerOptions options = {}) {
    options.get_proc = FakeGl::get_proc;
    options.user = &fake_;
    return cumulet::test::make_viewer(options);
  }
  void show(cumulet_viewer* v, cumulet_background background) {
    auto display = make_desc<cumulet_display_desc>();
    display.background = background;
    ASSERT_EQ(cumulet_set_display(v, &display), CUMULET_OK);
  }
  [[nodiscard]] std::array<int, 4> at(const Picture& pixels, int x, int y) const {
    std::array<int, 4> rgba{};
    for (std::size_t c = 0; c < 4; ++c) rgba[c] = pixels[static_cast<std::size_t>(y * side + x) * 4 + c];
    return rgba;
  }

  Context context_ = Context::create(Backend::automatic);
  FakeGl fake_{Context::get_proc, &context_};
  const GladGLContext& gl_ = fake_.real();
  HostTarget target_{gl_, side, side};
  VolumeRef volume_ = make_ball(16, 2.0F);
  ViewerPtr viewer_ = viewer();
  cumulet_viewer* v_ = viewer_.get();
};

TEST_F(Contract, Contract01OpaqueHandlesAndAThinLayerOverThem) {
  const Picture by_c = picture_of(v_, volume_.get(), target_);
  auto made = cumulet::Viewer::create({.get_proc = {FakeGl::get_proc, &fake_}});
  ASSERT_TRUE(made);
  cumulet::Viewer& viewer = *made;
  ASSERT_TRUE(viewer.set_sun_sky({.sun_azimuth_degrees = 60.0F,
                                  .sun_elevation_degrees = 40.0F,
                                  .sun_irradiance = {2.5F, 2.5F, 2.5F},
                                  .sky_radiance = {0.3F, 0.3F, 0.3F}}));
  ASSERT_TRUE(viewer.set_sampling({.samples = 4, .preview = cumulet::Preview::off}));
  const auto camera = cumulet::Camera::create({.eye = {0.0, 6.0, 32.0}});
  ASSERT_TRUE(viewer.set_camera(*camera));
  ASSERT_TRUE(viewer.set_volume(cumulet::Volume::adopt(cumulet_volume_retain(volume_.get()))));
  ASSERT_TRUE(viewer.wait());
  target_.clear({});
  cumulet::FrameResult result;
  do {
    const auto frame =
        viewer.render({.budget_ms = 50.0, .framebuffer = target_.framebuffer(), .width = side, .height = side});
    ASSERT_TRUE(frame) << frame.error().message.c_str();
    result = *frame;
  } while (!result.has(cumulet::RenderFlags::converged));
  EXPECT_EQ(difference(target_.pixels(), by_c), "");
}

/// Checks struct_size of a descriptor: the call accepts the whole struct and any size that ends where a member begins.
/// It rejects sizes that cut a member or are too large.
template <class Desc>
void check_sizes(const char* name, Desc desc, const std::function<cumulet_status(const Desc*)>& call,
                 std::size_t least = sizeof(std::size_t)) {
  SCOPED_TRACE(name);
  EXPECT_EQ(call(&desc), CUMULET_OK);
  for (const std::size_t wrong : {std::size_t{0}, std::size_t{4}, sizeof(Desc) + 8, std::size_t{1} << 40U}) {
    desc.struct_size = wrong;
    EXPECT_EQ(call(&desc), CUMULET_ERROR_INVALID_ARGUMENT) << wrong;
  }
  const auto& fields = cumulet::c_abi::fields_of<Desc>;
  for (std::size_t shorter = 1; shorter < sizeof(Desc); ++shorter) {
    const bool whole = std::ranges::any_of(fields, [&](const auto& field) { return field.offset == shorter; });
    // An older header's struct may have padding where a member begins now.
    const bool padded = shorter % alignof(Desc) == 0 && std::ranges::any_of(fields, [&](const auto& field) {
                          const std::size_t end = field.offset + field.size;
                          return end <= shorter && shorter < end + alignof(Desc);
                        });
    const bool cut = !padded && std::ranges::any_of(fields, [&](const auto& field) {
      return field.offset < shorter && shorter < field.offset + field.size;
    });
    if (!cut && (!whole || shorter < least)) continue;
    // Allocates only the bytes that struct_size declares.
    std::vector<unsigned char> bytes(std::max(shorter, sizeof(std::size_t)));
    desc.struct_size = shorter;
    std::memcpy(bytes.data(), &desc, bytes.size());
    EXPECT_EQ(call(reinterpret_cast<const Desc*>(bytes.data())), cut ? CUMULET_ERROR_INVALID_ARGUMENT : CUMULET_OK)
        << shorter;
  }
  EXPECT_EQ(call(nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

/// An enum member accepts only its enumerators.
template <class Desc, class Enum>
void check_enum(const char* name, Enum Desc::*member, int values,
                const std::function<cumulet_status(const Desc*)>& call, Desc desc = make_desc<Desc>()) {
  SCOPED_TRACE(name);
  for (int value = -1; value <= values; ++value) {
    std::memcpy(&(desc.*member), &value, sizeof value);
    const bool known = value >= 0 && value < values;
    if (!known) {
      EXPECT_EQ(call(&desc), CUMULET_ERROR_INVALID_ARGUMENT) << value;
    }
  }
}

TEST_F(Contract, Contract02DescriptorsHaveSizesAndEnumsNoUnknownValues) {
  picture_of(v_, volume_.get(), target_);
  cumulet_viewer* out = nullptr;
  const std::function create = [&](const cumulet_create_desc* d) {
    const cumulet_status status = cumulet_create(d, &out, nullptr, 0);
    cumulet_destroy(out);
    out = nullptr;
    return status;
  };
  const std::function grid = [&](const cumulet_grid_desc* d) { return cumulet_set_grid(v_, d); };
  const std::function medium = [&](const cumulet_medium_desc* d) { return cumulet_set_medium(v_, d); };
  const std::function light = [&](const cumulet_sun_sky_desc* d) { return cumulet_set_sun_sky(v_, d); };
  const std::function sampling = [&](const cumulet_sampling_desc* d) { return cumulet_set_sampling(v_, d); };
  const std::function display = [&](const cumulet_display_desc* d) { return cumulet_set_display(v_, d); };
  const std::function navigation = [&](const cumulet_navigation_desc* d) { return cumulet_set_navigation(v_, d); };
  const std::function event = [&](const cumulet_event* e) { return cumulet_input(v_, e, nullptr); };
  const std::function frame = [&](const cumulet_frame_desc* d) { return cumulet_render(v_, d, nullptr); };
  const std::function camera = [&](const cumulet_camera_desc* d) {
    cumulet_camera* made = nullptr;
    const cumulet_status status = cumulet_camera_create(d, &made);
    cumulet_camera_release(made);
    return status;
  };
  const std::array<float, 8> voxels{1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F};
  auto dense_desc = make_desc<cumulet_dense_desc>();
  dense_desc.values = voxels.data();
  dense_desc.value_count = voxels.size();
  for (int& length : dense_desc.size) length = 2;
  const std::function dense = [&](const cumulet_dense_desc* d) {
    cumulet_volume* made = nullptr;
    const cumulet_status status = cumulet_volume_from_dense(d, &made, nullptr, 0);
    cumulet_volume_release(made);
    return status;
  };
  const std::array<std::int32_t, 3> origin{0, 0, 0};
  const std::vector<float> brick(512, 1.0F);
  auto sparse_desc = make_desc<cumulet_sparse_desc>();
  sparse_desc.brick_origins = origin.data();
  sparse_desc.brick_values = brick.data();
  sparse_desc.brick_count = 1;
  const std::function sparse = [&](const cumulet_sparse_desc* d) {
    cumulet_volume* made = nullptr;
    const cumulet_status status = cumulet_volume_from_sparse(d, &made, nullptr, 0);
    cumulet_volume_release(made);
    return status;
  };
  check_sizes("create", make_desc<cumulet_create_desc>(), create);
  check_sizes("grid", make_desc<cumulet_grid_desc>(), grid);
  check_sizes("medium", make_desc<cumulet_medium_desc>(), medium);
  check_sizes("light", make_desc<cumulet_sun_sky_desc>(), light);
  check_sizes("sampling", make_desc<cumulet_sampling_desc>(), sampling);
  check_sizes("display", make_desc<cumulet_display_desc>(), display);
  check_sizes("navigation", make_desc<cumulet_navigation_desc>(), navigation);
  check_sizes("event", make_desc<cumulet_event>(), event);
  check_sizes("camera", make_desc<cumulet_camera_desc>(), camera);
  check_sizes("frame", make_desc<cumulet_frame_desc>(), frame);
  check_sizes("dense", dense_desc, dense, offsetof(cumulet_dense_desc, index_to_world));
  check_sizes("sparse", sparse_desc, sparse, offsetof(cumulet_sparse_desc, tiles));

  // Output structs: the library writes no more bytes than the caller's size.
  const auto filled = [&](auto desc, const auto& call) {
    using Desc = decltype(desc);
    EXPECT_EQ(call(&desc), CUMULET_OK);
    EXPECT_EQ(desc.struct_size, sizeof(Desc));
    for (const auto& field : cumulet::c_abi::fields_of<Desc>) {
      const std::size_t shorter = field.offset + field.size;
      std::vector<unsigned char> bytes(shorter + 8, 0xCD);
      std::memcpy(bytes.data(), &shorter, sizeof shorter);
      EXPECT_EQ(call(reinterpret_cast<Desc*>(bytes.data())), CUMULET_OK);
      for (std::size_t i = shorter; i < shorter + 8; ++i) EXPECT_EQ(bytes[i], 0xCD) << "written past " << shorter;
      const std::size_t cut = shorter - 1;
      std::memcpy(bytes.data(), &cut, sizeof cut);
      EXPECT_EQ(call(reinterpret_cast<Desc*>(bytes.data())), CUMULET_ERROR_INVALID_ARGUMENT) << cut;
    }
    desc.struct_size = 0;
    EXPECT_EQ(call(&desc), CUMULET_ERROR_INVALID_ARGUMENT);
  };
  filled(make_desc<cumulet_progress>(), [&](cumulet_progress* p) { return cumulet_get_progress(v_, p); });
  filled(make_desc<cumulet_stats>(), [&](cumulet_stats* s) { return cumulet_get_stats(v_, s); });
  filled(make_desc<cumulet_pick>(), [&](cumulet_pick* p) { return cumulet_pick_at(v_, 1.0, 1.0, p); });
  const auto map = make_desc<cumulet_transmittance_map_desc>();
  filled(make_desc<cumulet_transmittance_map>(),
         [&](cumulet_transmittance_map* m) { return cumulet_update_transmittance_map(v_, &map, m); });
  filled(make_desc<cumulet_volume_info>(),
         [&](cumulet_volume_info* i) { return cumulet_volume_get_info(volume_.get(), i); });
  filled(make_desc<cumulet_histogram_info>(), [&](cumulet_histogram_info* i) {
    return cumulet_volume_get_histogram(volume_.get(), CUMULET_RAMP_DENSITY, i);
  });
  const cumulet_frame_desc whole = target_.frame();
  filled(make_desc<cumulet_frame_result>(), [&](cumulet_frame_result* r) { return cumulet_render(v_, &whole, r); });

  check_enum("gl_state", &cumulet_create_desc::gl_state, 2, create);
  check_enum("type", &cumulet_grid_desc::type, 3, grid);
  check_enum("cells", &cumulet_grid_desc::cells, 2, grid);
  check_enum("criterion", &cumulet_grid_desc::criterion, 3, grid);
  check_enum("view", &cumulet_sampling_desc::view, 5, sampling);
  check_enum("preview", &cumulet_sampling_desc::preview, 2, sampling);
  check_enum("tone_map", &cumulet_display_desc::tone_map, 3, display);
  check_enum("background", &cumulet_display_desc::background, 3, display);
  check_enum("denoise", &cumulet_display_desc::denoise, 2, display);
  check_enum("depth", &cumulet_camera_desc::depth, 2, camera);
  check_enum("style", &cumulet_navigation_desc::style, 3, navigation);
  check_enum("type", &cumulet_event::type, 7, event);
  check_enum("button", &cumulet_event::button, 3, event);
  check_enum("target", &cumulet_frame_desc::target, 3, frame, whole);
  check_enum("colour", &cumulet_frame_desc::color, 4, frame, whole);
  check_enum("blend", &cumulet_frame_desc::blend, 2, frame, whole);
  check_enum("depth_source", &cumulet_frame_desc::depth_source, 4, frame, whole);
  std::array<double, 16> matrix{};
  const CameraRef owner([] {
    cumulet_camera* made = nullptr;
    const auto desc = make_desc<cumulet_camera_desc>();
    cumulet_camera_create(&desc, &made);
    return made;
  }());
  for (const int clip : {-1, 2}) {
    cumulet_clip_space value{};
    std::memcpy(&value, &clip, sizeof clip);
    EXPECT_EQ(cumulet_camera_get_matrices(owner.get(), 1.0, value, matrix.data(), matrix.data()),
              CUMULET_ERROR_INVALID_ARGUMENT);
  }
}

TEST_F(Contract, Contract03FunctionsComeFromEachInstancesCallback) {
  Context other_context = Context::create(Backend::automatic);
  FakeGl other(Context::get_proc, &other_context);
  const std::uint64_t others = other.calls();
  context_.make_current();
  fake_.make_current();
  picture_of(v_, volume_.get(), target_);
  EXPECT_GT(fake_.calls(), 100U);
  EXPECT_EQ(other.calls(), others) << "a viewer called by another's table";
  EXPECT_EQ(FakeGl::strays(), 0U);
  const std::uint64_t mine = fake_.calls();
  {
    other_context.make_current();
    other.make_current();
    const HostTarget target(other.real(), side, side);
    const ViewerPtr second = cumulet::test::make_viewer({.get_proc = FakeGl::get_proc, .user = &other});
    picture_of(second.get(), volume_.get(), target);
  }
  EXPECT_GT(other.calls(), others);
  EXPECT_EQ(fake_.calls(), mine);
  context_.make_current();
  fake_.make_current();
}

TEST_F(Contract, Contract04CreationSaysWhatIsMissing) {
  const auto refusal = [&](cumulet_get_proc_fn get_proc) {
    auto create = make_desc<cumulet_create_desc>();
    create.get_proc = get_proc;
    create.get_proc_user = &context_;
    std::array<char, 256> error{};
    cumulet_viewer* out = v_;
    EXPECT_EQ(cumulet_create(&create, &out, error.data(), error.size()), CUMULET_ERROR_UNSUPPORTED);
    EXPECT_EQ(out, nullptr);
    return std::string(error.data());
  };
  EXPECT_NE(refusal([](void*, const char*) -> void* { return nullptr; }), "");
  EXPECT_NE(refusal([](void* user, const char* name) -> void* {
              return std::strcmp(name, "glDispatchCompute") == 0 ? nullptr : Context::get_proc(user, name);
            }).find("4.5"),
            std::string::npos);
  const std::string old = refusal([](void* user, const char* name) -> void* {
    if (std::strcmp(name, "glGetString") != 0) return Context::get_proc(user, name);
    const auto get_string = +[](GLenum) { return reinterpret_cast<const GLubyte*>("3.3 (a test's)"); };
    return reinterpret_cast<void*>(get_string);
  });
  EXPECT_NE(old.find("4.5"), std::string::npos) << old;
  EXPECT_NE(old.find("3.3"), std::string::npos) << old;
}

TEST(ContractDetached, Contract05NoWindowAndNoContextAreMade) {
  // No context is current, and none is made, but files are read and grids are built.
  const ViewerPtr viewer = cumulet::test::make_viewer({});
  const VolumeRef volume = make_ball(16);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(viewer.get(), &stats), CUMULET_OK);
  EXPECT_GT(stats.cells, 24U);
  EXPECT_STREQ(stats.gl_version, "");
  const auto frame = make_desc<cumulet_frame_desc>();
  EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_ERROR_DETACHED);
  EXPECT_EQ(FakeGl::strays(), 0U);
}

// All state of all calls: tests/embed/scramble.cpp. This test checks the difference between the two modes.
TEST_F(Contract, Contract06StateIsRestoredOrTheHostResetsIt) {
  GLuint buffer = 0;
  gl_.CreateBuffers(1, &buffer);
  GLuint program = 0;
  const auto disturb = [&] {
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, buffer);
    gl_.PixelStorei(GL_PACK_ROW_LENGTH, 7);
    gl_.Enable(GL_CULL_FACE);
    gl_.Viewport(1, 2, 3, 4);
    gl_.UseProgram(program);
  };
  disturb();
  picture_of(v_, volume_.get(), target_);
  std::array<GLint, 4> viewport{};
  GLint row_length = 0;
  GLint bound = 0;
  gl_.GetIntegerv(GL_VIEWPORT, viewport.data());
  gl_.GetIntegerv(GL_PACK_ROW_LENGTH, &row_length);
  gl_.GetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &bound);
  EXPECT_EQ(viewport, (std::array<GLint, 4>{1, 2, 3, 4}));
  EXPECT_EQ(row_length, 7);
  EXPECT_EQ(static_cast<GLuint>(bound), buffer);
  EXPECT_EQ(gl_.IsEnabled(GL_CULL_FACE), GL_TRUE);

  const auto calls_a_frame = [&](cumulet_viewer* v) {
    auto frame = target_.frame();
    frame.budget_ms = -1.0;
    const std::uint64_t before = fake_.calls();
    EXPECT_EQ(cumulet_render(v, &frame, nullptr), CUMULET_OK);
    return fake_.calls() - before;
  };
  gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  const Picture restored = target_.pixels();
  const ViewerPtr resetting = viewer({.gl_state = CUMULET_GL_STATE_HOST_RESETS});
  disturb();
  picture_of(resetting.get(), volume_.get(), target_);
  gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  gl_.PixelStorei(GL_PACK_ROW_LENGTH, 0);
  EXPECT_EQ(difference(target_.pixels(), restored), "");
  EXPECT_LT(calls_a_frame(resetting.get()), calls_a_frame(v_)) << "nothing is saved";
  gl_.DeleteBuffers(1, &buffer);
}

// All state: tests/embed/scramble.cpp. This test checks that state a frame does not use is neither queried nor set.
TEST_F(Contract, Contract06bStateIsSavedAsItIsUsed) {
  picture_of(v_, volume_.get(), target_);
  const auto of_frame = [&](const cumulet_frame_desc& frame) {
    const std::uint64_t before = fake_.questions();
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
    return fake_.questions() - before;
  };
  cumulet_frame_desc frame = target_.frame();
  frame.budget_ms = -1.0;  // draws the current image
  const std::uint64_t stores = fake_.calls("PixelStorei");
  const std::uint64_t images = fake_.calls("BindImageTexture");
  const std::uint64_t ranges = fake_.calls("BindBufferBase") + fake_.calls("BindBufferRange");
  const std::uint64_t drawn = of_frame(frame);
  EXPECT_GT(drawn, 20U);
  EXPECT_LT(drawn, 80U);  // it was 350 once
  EXPECT_EQ(fake_.calls("PixelStorei"), stores);
  EXPECT_EQ(fake_.calls("BindImageTexture"), images);
  EXPECT_EQ(fake_.calls("BindBufferBase") + fake_.calls("BindBufferRange"), ranges);
  RecordProperty("queries_of_a_frame_that_draws", static_cast<int>(drawn));

  const std::uint64_t enabled = fake_.calls("Enable") + fake_.calls("Disable") + fake_.calls("ColorMaski");
  frame.target = CUMULET_TARGET_NONE;
  // One query is for the free entries of the debug group stack.
  EXPECT_LE(of_frame(frame), 3U) << "a frame that does nothing";
  EXPECT_EQ(fake_.calls("Enable") + fake_.calls("Disable") + fake_.calls("ColorMaski"), enabled);

  // With CUMULET_GL_STATE_HOST_RESETS, a frame queries three things: whether the target is a framebuffer, its draw
  // buffer 0, and the depth of the debug group stack.
  const ViewerPtr resetting = viewer({.gl_state = CUMULET_GL_STATE_HOST_RESETS});
  picture_of(resetting.get(), volume_.get(), target_);
  frame = target_.frame();
  frame.budget_ms = -1.0;
  const std::uint64_t before = fake_.questions();
  EXPECT_EQ(cumulet_render(resetting.get(), &frame, nullptr), CUMULET_OK);
  EXPECT_LE(fake_.questions() - before, 3U);
}

TEST_F(Contract, Contract07HostObjectsAreNotChanged) {
  const GLenum none = GL_NONE;
  const HostTarget bystander(gl_, 4, 4);
  gl_.NamedFramebufferDrawBuffers(bystander.framebuffer(), 1, &none);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, bystander.framebuffer());
  const auto before = bystander.pixels();
  picture_of(v_, volume_.get(), target_);
  GLint draw_buffer = -1;
  gl_.GetIntegerv(GL_DRAW_BUFFER, &draw_buffer);
  EXPECT_EQ(draw_buffer, GL_NONE);
  GLint bound = 0;
  gl_.GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &bound);
  EXPECT_EQ(static_cast<GLuint>(bound), bystander.framebuffer());
  EXPECT_EQ(difference(bystander.pixels(), before), "");
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

TEST_F(Contract, Contract08ErrorsAreCleanAndTheDebugCallbackIsTheHosts) {
  int told = 0;
  const GLDEBUGPROC callback = [](GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar*, const void* user) {
    if (type == GL_DEBUG_TYPE_ERROR) ++*static_cast<int*>(const_cast<void*>(user));
  };
  gl_.Enable(GL_DEBUG_OUTPUT);
  gl_.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  gl_.DebugMessageCallback(callback, &told);
  gl_.Enable(GL_FLOAT);  // pending: INVALID_ENUM
  const int own = told;
  picture_of(v_, volume_.get(), target_);
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  EXPECT_EQ(told, own) << "errors of ours went to the host";
  auto frame = target_.frame();
  frame.framebuffer = 999;  // a failing call
  EXPECT_NE(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  void* function = nullptr;
  gl_.GetPointerv(GL_DEBUG_CALLBACK_FUNCTION, &function);
  EXPECT_EQ(function, reinterpret_cast<void*>(callback));
  EXPECT_EQ(fake_.calls("DebugMessageCallback") + fake_.calls("DebugMessageControl"), 0U);
  gl_.DebugMessageCallback(nullptr, nullptr);
}

TEST_F(Contract, ObjectsAndPassesHaveNames) {
  const auto named = [&](GLenum kind, GLuint name) {
    std::array<char, 300> text{};
    gl_.GetObjectLabel(kind, name, static_cast<GLsizei>(text.size()), nullptr, text.data());
    return std::string(text.data());
  };
  constexpr GLuint most = 300;
  // The host's own objects have no names.
  const auto unnamed = [&] {
    std::array<int, 3> counts{};
    for (GLuint name = 1; name < most; ++name) {
      if (gl_.IsBuffer(name) != 0 && named(GL_BUFFER, name).empty()) ++counts[0];
      if (gl_.IsTexture(name) != 0 && named(GL_TEXTURE, name).empty()) ++counts[1];
      if (gl_.IsProgram(name) != 0 && named(GL_PROGRAM, name).empty()) ++counts[2];
    }
    return counts;
  };
  const auto before = unnamed();
  picture_of(v_, volume_.get(), target_);
  EXPECT_EQ(unnamed(), before);
  std::set<std::string> names;
  for (GLuint name = 1; name < most; ++name) {
    if (gl_.IsProgram(name) != 0) names.insert(named(GL_PROGRAM, name));
  }
  EXPECT_TRUE(
      std::ranges::any_of(names, [](const std::string& n) { return n.starts_with("cumulet: trace.comp, CM_"); }));
  EXPECT_GT(fake_.calls("PushDebugGroup"), 0U);
  EXPECT_EQ(fake_.calls("PushDebugGroup"), fake_.calls("PopDebugGroup"));
}

TEST_F(Contract, PassesAreTimedWithoutWaiting) {
  const auto seconds = [&] {
    auto stats = make_desc<cumulet_stats>();
    EXPECT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
    return stats;
  };
  EXPECT_EQ(seconds().pass_seconds_trace, 0.0);
  const auto begun = std::chrono::steady_clock::now();
  picture_of(v_, volume_.get(), target_);
  // Timings of in-flight work arrive some frames later.
  for (int i = 0; i < 5; ++i) {
    gl_.Finish();
    auto frame = target_.frame();
    ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
  const cumulet_stats first = seconds();
  EXPECT_GT(first.pass_seconds_trace, 0.0);
  EXPECT_GT(first.pass_seconds_display, 0.0);
  EXPECT_LE(first.pass_seconds_trace + first.pass_seconds_display, taken.count());
  EXPECT_EQ(first.pass_seconds_inspect, 0.0);
  EXPECT_EQ(first.pass_seconds_host_depth, 0.0);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.view = CUMULET_VIEW_STEPS;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  auto frame = target_.frame();
  frame.depth_source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER;
  frame.depth_name = target_.framebuffer();
  converge(v_, frame);
  gl_.Finish();
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  EXPECT_GT(seconds().pass_seconds_inspect, 0.0);
  EXPECT_GT(seconds().pass_seconds_host_depth, 0.0);
  EXPECT_EQ(fake_.alive().count("Queries"), 0U) << "contexts do not share them";
}

TEST_F(Contract, FramesPassesAndJobsAreReportedAtTheirEnd) {
  struct Told {
    std::mutex mutex;
    std::map<std::string, std::vector<std::pair<double, double>>> pieces;
  } told;
  auto desc = make_desc<cumulet_create_desc>();
  desc.get_proc = FakeGl::get_proc;
  desc.get_proc_user = &fake_;
  desc.trace = [](void* user, const char* name, double begin, double end) {
    auto& t = *static_cast<Told*>(user);
    const std::scoped_lock lock(t.mutex);
    t.pieces[name].emplace_back(begin, end);
    EXPECT_EQ(cumulet_rebuild(nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  };
  desc.trace_user = &told;
  cumulet_viewer* raw = nullptr;
  ASSERT_EQ(cumulet_create(&desc, &raw, nullptr, 0), CUMULET_OK);
  ViewerPtr viewer(raw);
  picture_of(viewer.get(), volume_.get(), target_);
  viewer.reset();
  for (const char* name : {"frame", "cumulet: upload", "cumulet: trace", "cumulet: draw", "building the grid"})
    EXPECT_FALSE(told.pieces[name].empty()) << name;
  // Passes are nested in their frame.
  const auto [begin, end] = told.pieces["cumulet: draw"].back();
  EXPECT_LE(begin, end);
  EXPECT_TRUE(
      std::ranges::any_of(told.pieces["frame"], [&](const auto& f) { return f.first <= begin && end <= f.second; }));
}

TEST_F(Contract, Contract09TheTargetIsGivenWithEveryFrame) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  const HostTarget second(gl_, side, side);
  converge(v_, second.frame());
  EXPECT_EQ(difference(second.pixels(), picture), "");
  const HostTarget wide(gl_, 2 * side, side, GL_RGBA16F);
  converge(v_, wide.frame());
  const auto wide_pixels = wide.floats();
  // The image is rendered for the new size, not stretched: the colors of the middle column are the same.
  converge(v_, target_.frame());
  EXPECT_EQ(difference(target_.pixels(), picture), "") << "the first target's again";
  EXPECT_GT(std::ranges::max(wide_pixels), 0.3F);
}

TEST_F(Contract, Contract10FramebufferZeroIsNotAssumed) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  picture_of(v_, volume_.get(), target_);
  EXPECT_GT(std::ranges::max(target_.pixels()), 60);
  // An incomplete or foreign framebuffer is an error; nothing is drawn elsewhere.
  GLuint empty = 0;
  gl_.CreateFramebuffers(1, &empty);
  auto frame = target_.frame();
  frame.framebuffer = empty;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(cumulet_last_error(v_)).find(std::to_string(empty)), std::string::npos);
  gl_.DeleteFramebuffers(1, &empty);
}

TEST_F(Contract, Contract11ViewerOwnedTexture) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  for (const GLenum format : {GL_RGBA8, GL_RGBA16F, GL_RGBA32F}) {
    auto frame = target_.frame();
    frame.target = CUMULET_TARGET_TEXTURE;
    frame.format = format;
    frame.write_depth = 1;
    const auto result = converge(v_, frame);
    ASSERT_EQ(gl_.IsTexture(result.texture), GL_TRUE);
    GLint width = 0;
    GLint internal = 0;
    gl_.GetTextureLevelParameteriv(result.texture, 0, GL_TEXTURE_WIDTH, &width);
    gl_.GetTextureLevelParameteriv(result.texture, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
    EXPECT_EQ(width, side);
    EXPECT_EQ(static_cast<GLenum>(internal), format);
    gl_.GetTextureLevelParameteriv(result.depth_texture, 0, GL_TEXTURE_INTERNAL_FORMAT, &internal);
    EXPECT_EQ(internal, GL_DEPTH_COMPONENT32F);
    Picture pixels(picture.size());
    gl_.GetTextureImage(result.texture, 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(pixels.size()),
                        pixels.data());
    int largest = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) largest = std::max(largest, std::abs(pixels[i] - picture[i]));
    EXPECT_LE(largest, 1);
  }
  auto frame = target_.frame();
  frame.target = CUMULET_TARGET_TEXTURE;
  frame.format = GL_R8;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(Contract, Contract12FlippedAndInARectangle) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  auto frame = target_.frame();
  frame.flip_y = 1;
  converge(v_, frame);
  const Picture turned = cumulet::test::upside_down(picture, side);
  EXPECT_EQ(difference(target_.pixels(), turned), "");
  EXPECT_NE(difference(picture, turned), "");

  const HostTarget larger(gl_, side + 20, side + 10);
  larger.clear({1.0F, 0.0F, 1.0F, 1.0F});
  frame = larger.frame();
  frame.viewport[0] = 13;
  frame.viewport[1] = 3;
  frame.viewport[2] = frame.viewport[3] = side;
  converge(v_, frame);
  const Picture pixels = larger.pixels();
  Picture inside;
  int outside_changed = 0;
  for (int y = 0; y < side + 10; ++y) {
    for (int x = 0; x < side + 20; ++x) {
      const auto pixel = pixels.begin() + (y * (side + 20) + x) * 4;
      if (x >= 13 && x < 13 + side && y >= 3 && y < 3 + side) {
        inside.insert(inside.end(), pixel, pixel + 4);
      } else {
        outside_changed += pixel[0] == 255 && pixel[1] == 0 && pixel[2] == 255 ? 0 : 1;
      }
    }
  }
  EXPECT_EQ(outside_changed, 0);
  EXPECT_EQ(difference(inside, picture), "");
  frame.viewport[0] = 21;
  EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_INVALID_ARGUMENT) << "not inside the target";
}

TEST_F(Contract, AovsAreReadThroughTheAbi) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  std::vector<float> values(std::size_t{4} * side * side);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, values.data(), values.size()), CUMULET_ERROR_INVALID_ARGUMENT)
      << "nothing was rendered";
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  sampling.separate_volume_aov = 2;
  EXPECT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_ERROR_INVALID_ARGUMENT);
  sampling.separate_volume_aov = 1;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  picture_of(v_, volume_.get(), target_);
  for (int aov = CUMULET_AOV_BEAUTY; aov <= CUMULET_AOV_VOLUME_MOTION; ++aov) {
    EXPECT_EQ(cumulet_read_aov(v_, static_cast<cumulet_aov>(aov), values.data(), values.size()), CUMULET_OK) << aov;
  }
  EXPECT_EQ(cumulet_read_aov(v_, std::bit_cast<cumulet_aov>(11), values.data(), values.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, nullptr, values.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_NORMAL, values.data(), 3), CUMULET_ERROR_INVALID_ARGUMENT);
  // Without surfaces the beauty layer is the volume, and its alpha is 1 - transmittance.
  std::vector<float> beauty(values.size());
  std::vector<float> passes(values.size() / 4);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_BEAUTY, beauty.data(), beauty.size()), CUMULET_OK);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_VOLUME, values.data(), values.size()), CUMULET_OK);
  EXPECT_EQ(beauty, values);
  ASSERT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()), CUMULET_OK);
  double difference = 0.0;
  for (std::size_t i = 0; i < passes.size(); ++i) difference += (1.0 - passes[i] - values[4 * i + 3]) / (side * side);
  EXPECT_NEAR(difference, 0.0, 0.02);
  // A frame of size 0 discards the view but keeps the image.
  auto frame = target_.frame();
  frame.width = frame.height = 0;
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_SURFACE_DEPTH, passes.data(), passes.size()), CUMULET_OK);
  // AOVs of an image are not read with another grid type's data.
  auto grid = make_desc<cumulet_grid_desc>();
  grid.type = CUMULET_GRID_DENSE;
  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
  frame.budget_ms = 1e3;
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);  // uploads, traces nothing
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()),
            CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(cumulet_last_error(v_)).find("render"), std::string::npos);
  EXPECT_EQ(cumulet_detach(v_), CUMULET_OK);
  EXPECT_EQ(cumulet_read_aov(v_, CUMULET_AOV_TRANSMITTANCE, passes.data(), passes.size()), CUMULET_ERROR_DETACHED);
}

TEST_F(Contract, AccumulationContinuesInAnotherViewer) {
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 40;
  sampling.preview = CUMULET_PREVIEW_OFF;
  const auto begun = [&](double budget_ms) {
    ViewerPtr own = viewer();
    show(own.get(), CUMULET_BACKGROUND_TRANSPARENT);
    EXPECT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    auto frame = target_.frame();
    frame.budget_ms = budget_ms;
    // The first frames upload the grid and wait for the driver's compiler. Stop there.
    std::size_t size = 0;
    for (int i = 0; i < 60000; ++i) {
      EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_OK);
      if (cumulet_read_accumulation(own.get(), nullptr, &size) == CUMULET_OK) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return own;
  };
  const auto whole = [&](cumulet_viewer* v) {
    converge(v, target_.frame());
    std::vector<float> rgba(std::size_t{4} * side * side);
    EXPECT_EQ(cumulet_read_linear(v, rgba.data(), rgba.size()), CUMULET_OK);
    return rgba;
  };
  std::size_t size = 7;
  EXPECT_EQ(cumulet_read_accumulation(v_, nullptr, &size), CUMULET_ERROR_INVALID_ARGUMENT) << "nothing was rendered";
  EXPECT_EQ(size, 7u);
  std::vector<std::byte> bytes;
  {
    const ViewerPtr first = begun(3.0);
    EXPECT_EQ(cumulet_read_accumulation(first.get(), nullptr, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
    ASSERT_EQ(cumulet_read_accumulation(first.get(), nullptr, &size), CUMULET_OK);
    EXPECT_EQ(size, 32U + 44U * side * side);
    bytes.resize(size);
    size -= 1;
    EXPECT_EQ(cumulet_read_accumulation(first.get(), bytes.data(), &size), CUMULET_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(size, bytes.size()) << "what it takes is told";
    ASSERT_EQ(cumulet_read_accumulation(first.get(), bytes.data(), &size), CUMULET_OK);
  }
  const ViewerPtr second = begun(1.0);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), nullptr, size), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size - 1), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size), CUMULET_OK);
  EXPECT_EQ(whole(second.get()), whole(begun(5.0).get()));
  ASSERT_EQ(cumulet_detach(second.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_read_accumulation(second.get(), bytes.data(), &size), CUMULET_ERROR_DETACHED);
  EXPECT_EQ(cumulet_restore_accumulation(second.get(), bytes.data(), size), CUMULET_ERROR_DETACHED);
}

// Conventions, multisampling and real geometry: tests/embed/reversed_z.cpp.
TEST_F(Contract, Contract13HostDepthHidesWhatIsBehindIt) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  const Picture picture = picture_of(v_, volume_.get(), target_);
  const Picture nothing(picture.size(), 0);
  for (const cumulet_depth_convention convention : {CUMULET_DEPTH_STANDARD, CUMULET_DEPTH_REVERSED}) {
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
    const CameraRef owner(camera);
    auto pose = make_desc<cumulet_camera_desc>();
    ASSERT_EQ(cumulet_camera_get(camera, &pose), CUMULET_OK);
    pose.depth = convention;
    ASSERT_EQ(cumulet_camera_set(camera, &pose), CUMULET_OK);
    const bool reversed = convention == CUMULET_DEPTH_REVERSED;
    auto frame = target_.frame();
    frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
    frame.depth_name = target_.depth_texture();
    // First without host geometry, then with some directly in front of the eye.
    for (const bool near : {false, true}) {
      frame.target = CUMULET_TARGET_NONE;
      target_.clear({}, near != reversed ? 0.0F : 1.0F);
      converge(v_, frame);
      frame.target = CUMULET_TARGET_FRAMEBUFFER;
      ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
      EXPECT_EQ(difference(target_.pixels(), near ? nothing : picture), "") << (near ? "near" : "far");
    }
  }
}

TEST_F(Contract, Contract14PremultipliedAlphaAndDepthOut) {
  show(v_, CUMULET_BACKGROUND_TRANSPARENT);
  const HostTarget black(gl_, side, side, GL_RGBA32F);
  const HostTarget white(gl_, side, side, GL_RGBA32F);
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  auto frame = black.frame();
  frame.color = CUMULET_COLOR_LINEAR;
  frame.target = CUMULET_TARGET_NONE;
  frame.write_depth = 1;
  converge(v_, frame);
  frame.target = CUMULET_TARGET_FRAMEBUFFER;
  black.clear({0.0F, 0.0F, 0.0F, 0.0F});
  white.clear({1.0F, 1.0F, 1.0F, 1.0F});
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  frame.framebuffer = white.framebuffer();
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  const auto over_black = black.floats();
  const auto over_white = white.floats();
  int partly = 0;
  for (std::size_t i = 0; i < over_black.size(); i += 4) {
    const float alpha = over_black[i + 3];
    partly += alpha > 0.05F && alpha < 0.95F ? 1 : 0;
    for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(over_white[i + c], over_black[i + c] + 1.0F - alpha, 1e-5F);
  }
  EXPECT_GT(partly, 10);

  // The written depth equals the pick's where the image is half opaque. Elsewhere it is not written.
  const auto depths = black.depths();
  auto pick = make_desc<cumulet_pick>();
  ASSERT_EQ(cumulet_pick_at(v_, side / 2.0, side / 2.0, &pick), CUMULET_OK);
  ASSERT_EQ(pick.hit, 1);
  cumulet_camera* camera = nullptr;
  ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
  const CameraRef owner(camera);
  std::array<double, 16> view{}, projection{};
  ASSERT_EQ(cumulet_camera_get_matrices(camera, 1.0, CUMULET_CLIP_NEGATIVE_ONE_TO_ONE, view.data(), projection.data()),
            CUMULET_OK);
  const auto multiply = [](const std::array<double, 16>& m, const std::array<double, 4>& v) {
    std::array<double, 4> r{};
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t k = 0; k < 4; ++k) r[row] += m[k * 4 + row] * v[k];
    return r;
  };
  const auto clip = multiply(projection, multiply(view, {pick.position[0], pick.position[1], pick.position[2], 1.0}));
  const double expected = 0.5 + 0.5 * clip[2] / clip[3];
  // Pixel (16, 16) from the top is row 15 from the bottom.
  EXPECT_NEAR(depths[static_cast<std::size_t>((side - 1 - side / 2) * side + side / 2)], expected, 1e-5);
  EXPECT_EQ(depths[0], 1.0F);
}

TEST_F(Contract, Contract15Colors) {
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  const auto draw = [&](cumulet_color_encoding color, GLenum format) {
    const HostTarget target(gl_, side, side, format);
    auto frame = target.frame();
    frame.color = color;
    converge(v_, frame);
    return target.floats();  // decoded if the format is sRGB
  };
  const auto decode = [](float e) { return e <= 0.04045F ? e / 12.92F : std::pow((e + 0.055F) / 1.055F, 2.4F); };
  const auto linear = draw(CUMULET_COLOR_LINEAR, GL_RGBA32F);
  const auto encoded = draw(CUMULET_COLOR_SRGB, GL_RGBA32F);
  const auto by_gl = draw(CUMULET_COLOR_SRGB_FRAMEBUFFER, GL_SRGB8_ALPHA8);
  const auto hdr = draw(CUMULET_COLOR_HDR, GL_RGBA32F);
  for (std::size_t i = 0; i < linear.size(); ++i) {
    if (i % 4 == 3) continue;
    ASSERT_NEAR(decode(encoded[i]), linear[i], 1e-4F);
    // Half a step of the 8 bits of a stored color. (Reading back may decode it or not.)
    const float half_a_step = 0.5F / 255.0F + 1e-3F;
    ASSERT_TRUE(std::abs(by_gl[i] - encoded[i]) < half_a_step || std::abs(decode(encoded[i]) - by_gl[i]) < 0.005F);
  }
  EXPECT_LE(std::ranges::max(linear), 1.0F);
  // Exposure doubles values without a tone map and does not restart sampling.
  auto display = make_desc<cumulet_display_desc>();
  display.exposure_stops = 1.0F;
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t samples = stats.samples;
  ASSERT_EQ(cumulet_set_display(v_, &display), CUMULET_OK);
  const auto exposed = draw(CUMULET_COLOR_HDR, GL_RGBA32F);
  for (std::size_t i = 0; i < hdr.size(); ++i) {
    const float factor = i % 4 == 3 ? 1.0F : 2.0F;
    ASSERT_NEAR(exposed[i], factor * hdr[i], 1e-4F + 1e-4F * hdr[i]);
  }
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  EXPECT_EQ(stats.samples, samples);
  EXPECT_EQ(gl_.IsEnabled(GL_FRAMEBUFFER_SRGB), GL_FALSE);
}

TEST_F(Contract, Contract16SizesArePhysicalAndMayBeZero) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  auto frame = target_.frame();
  frame.scale = 2.0;
  target_.clear({});
  converge(v_, frame);
  EXPECT_EQ(difference(target_.pixels(), picture), "") << "a scale changes no pixel of a shaded picture";
  for (const auto& [width, height] : {std::pair(0, 0), {0, side}, {side, 0}}) {
    frame = target_.frame();
    frame.width = static_cast<std::uint32_t>(width);
    frame.height = static_cast<std::uint32_t>(height);
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << width << " x " << height;
  }
  target_.clear({});
  converge(v_, target_.frame());
  EXPECT_EQ(difference(target_.pixels(), picture), "");
}

// Coalescing and errors: UpdateCallback in robustness_test.cpp.
TEST_F(Contract, Contract17UpdateCallbackReportsFinishedJobs) {
  std::atomic<int> updates = 0;
  const ViewerPtr told =
      viewer({.update = [](void* user) { ++*static_cast<std::atomic<int>*>(user); }, .update_user = &updates});
  auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(told.get(), &frame, nullptr), CUMULET_OK);
  updates = 0;
  ASSERT_EQ(cumulet_set_volume(told.get(), volume_.get()), CUMULET_OK);
  EXPECT_GE(updates, 1);
  ASSERT_EQ(cumulet_render(told.get(), &frame, nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(told.get(), -1.0), CUMULET_OK);
  for (int i = 0; i < 1000 && updates < 2; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_GE(updates, 1);
  EXPECT_LE(updates, 2);
}

TEST_F(Contract, Contract18ProgressiveWithinTheTimeBudget) {
  const HostTarget large(gl_, 512, 512);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 100000;
  ASSERT_EQ(cumulet_set_sampling(v_, &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(v_, volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
  auto frame = large.frame();
  frame.budget_ms = 5.0;
  auto result = make_desc<cumulet_frame_result>();
  double progress = -1.0;
  std::vector<double> spent;
  for (int i = 0; i < 30; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
    spent.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    EXPECT_NE(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
    EXPECT_EQ(result.flags & CUMULET_RENDER_CONVERGED, 0U);
    progress = result.progress;
  }
  EXPECT_LT(progress, 0.9);
  std::ranges::sort(spent);
  // Bounds for a busy machine: the median, and less than a watchdog's second, because dispatches are bounded.
  EXPECT_LT(spent[15], 150.0);
  EXPECT_LT(spent[28], 1000.0);
  // A negative budget traces nothing.
  auto stats = make_desc<cumulet_stats>();
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  const std::uint64_t samples = stats.samples;
  frame.budget_ms = -1.0;
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  ASSERT_EQ(cumulet_get_stats(v_, &stats), CUMULET_OK);
  EXPECT_EQ(stats.samples, samples);
}

TEST_F(Contract, Contract19FlagsReportPendingWork) {
  auto result = make_desc<cumulet_frame_result>();
  const auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, 0U) << "nothing is there, nothing is to come";
  EXPECT_EQ(result.width, 0U);
  const VolumeRef large = make_ball(96, 1.0F);
  ASSERT_EQ(cumulet_set_volume(v_, large.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_LOADING, 0U);
  EXPECT_EQ(result.flags & CUMULET_RENDER_CONVERGED, 0U);
  result = converge(v_, frame);
  EXPECT_EQ(result.flags, unsigned{CUMULET_RENDER_CONVERGED});
  EXPECT_EQ(result.progress, 1.0);
  EXPECT_EQ(result.width, unsigned{side});
  // An image made without a target stays flagged until it is drawn.
  auto unseen = frame;
  unseen.target = CUMULET_TARGET_NONE;
  ASSERT_EQ(cumulet_render(v_, &unseen, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, unsigned{CUMULET_RENDER_CONVERGED}) << "drawn already";
  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sun_irradiance[0] = 3.0F;
  light.sun_elevation_degrees = 30.0F;
  ASSERT_EQ(cumulet_set_sun_sky(v_, &light), CUMULET_OK);
  EXPECT_EQ(converge(v_, unseen).flags, unsigned{CUMULET_RENDER_CONVERGED | CUMULET_RENDER_NEW_IMAGE});
  auto drawing = frame;
  drawing.budget_ms = -1.0;
  ASSERT_EQ(cumulet_render(v_, &drawing, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, unsigned{CUMULET_RENDER_CONVERGED});
  ASSERT_EQ(cumulet_render(v_, &unseen, &result), CUMULET_OK);
  EXPECT_EQ(result.flags, unsigned{CUMULET_RENDER_CONVERGED});
  ASSERT_EQ(cumulet_load_volume(v_, "no such file.vdb", nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_FILE);
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_FAILED, 0U);
}

TEST_F(Contract, Contract20AnyThreadAndLoadingIsAsynchronous) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  const VolumeRef large = make_ball(160, 1.0F);
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = 0.001;
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(cumulet_set_volume(v_, large.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_grid(v_, &grid), CUMULET_OK);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
  auto progress = make_desc<cumulet_progress>();
  std::thread([&] {
    EXPECT_EQ(cumulet_get_progress(v_, &progress), CUMULET_OK);
    cumulet_cancel(v_);
  }).join();
  EXPECT_NE(progress.stage, CUMULET_STAGE_IDLE);
  EXPECT_GE(progress.fraction, 0.0);
  EXPECT_LE(progress.fraction, 1.0);
  EXPECT_EQ(cumulet_wait(v_, 60000.0), CUMULET_ERROR_CANCELLED);
  target_.clear({});
  auto frame = target_.frame();
  frame.budget_ms = -1.0;
  ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(difference(target_.pixels(), picture), "");
  EXPECT_EQ(cumulet_wait(v_, 0.0), CUMULET_ERROR_CANCELLED) << "how the last one ended";
}

TEST_F(Contract, Contract20bEnvironmentsLoadAsynchronously) {
  const cumulet::test::Folder folder;
  const auto write = [&](const char* name, std::uint32_t width, std::uint32_t height) {
    const std::string path = (folder / name).string();
    std::ofstream(path, std::ios::binary) << cumulet::test::radiance_file(width, height);
    return path;
  };
  const std::string small = write("small.hdr", 16, 8);
  const std::string large = write("large.hdr", 4096, 2048);
  const auto expect_shown = [&](const char* path) {
    cumulet_environment* raw = nullptr;
    ASSERT_EQ(cumulet_get_environment(v_, &raw), CUMULET_OK);
    const EnvironmentRef shown(raw);
    if (path == nullptr) {
      EXPECT_EQ(shown, nullptr);
      return;
    }
    auto info = make_desc<cumulet_environment_info>();
    ASSERT_EQ(cumulet_environment_get_info(shown.get(), &info), CUMULET_OK);
    EXPECT_STREQ(info.name, path);
    ASSERT_EQ(cumulet_get_environment(v_, &raw), CUMULET_OK);
    EXPECT_EQ(EnvironmentRef(raw), shown) << "the same handle each time";
  };
  // Continues from the state that the failed load left.
  const auto pixels = [&] {
    const ViewerPtr other = viewer();
    cumulet_environment* raw = nullptr;
    EXPECT_EQ(cumulet_get_environment(v_, &raw), CUMULET_OK);
    const EnvironmentRef shown(raw);
    EXPECT_EQ(cumulet_set_environment(other.get(), shown.get()), CUMULET_OK);
    return picture_of(other.get(), volume_.get(), target_);
  };
  const auto seen = [&] {
    auto frame = target_.frame();
    auto result = make_desc<cumulet_frame_result>();
    for (int i = 0; i < 20000 && (result.flags & CUMULET_RENDER_CONVERGED) == 0; ++i)
      EXPECT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
    target_.clear({});
    frame.budget_ms = -1.0;
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK);
    return target_.pixels();
  };
  const Picture sky = picture_of(v_, volume_.get(), target_);

  EXPECT_EQ(cumulet_load_environment(v_, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_load_environment(v_, ""), CUMULET_ERROR_INVALID_ARGUMENT);
  ASSERT_EQ(cumulet_load_environment(v_, "no such sky.hdr"), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_FILE);
  EXPECT_STREQ(cumulet_last_error(v_), "no such sky.hdr: No such file or directory");
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(v_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.status, CUMULET_ERROR_FILE);
  EXPECT_EQ(progress.environment_status, CUMULET_ERROR_FILE);
  EXPECT_STREQ(progress.environment_message, cumulet_last_error(v_));
  EXPECT_EQ(progress.volume_status, CUMULET_OK);
  EXPECT_EQ(progress.surfaces_status, CUMULET_OK);
  const auto frame = target_.frame();
  auto result = make_desc<cumulet_frame_result>();
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_FAILED, 0U);
  expect_shown(nullptr);
  EXPECT_EQ(difference(seen(), sky), "");

  // While a large file loads, the previous environment stays and can be drawn.
  ASSERT_EQ(cumulet_load_environment(v_, large.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_get_progress(v_, &progress), CUMULET_OK);
  EXPECT_EQ(progress.stage, CUMULET_STAGE_LOADING);
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_LOADING, 0U);
  EXPECT_EQ(result.flags & CUMULET_RENDER_CONVERGED, 0U);
  EXPECT_EQ(result.width, unsigned{side});
  expect_shown(nullptr);
  cumulet_cancel(v_);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_CANCELLED);
  expect_shown(nullptr);
  EXPECT_EQ(difference(seen(), sky), "");

  // The newest request wins and clears the previous result.
  ASSERT_EQ(cumulet_load_environment(v_, large.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_load_environment(v_, small.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK) << cumulet_last_error(v_);
  expect_shown(small.c_str());
  const Picture lit = seen();
  EXPECT_NE(difference(lit, sky), "");
  EXPECT_EQ(difference(lit, pixels()), "");
  ASSERT_EQ(cumulet_load_environment(v_, (small + ".none").c_str()), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_FILE);
  expect_shown(small.c_str());
  EXPECT_EQ(difference(seen(), lit), "");

  // cumulet_set_environment takes effect at once and cancels the load.
  ASSERT_EQ(cumulet_load_environment(v_, large.c_str()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_environment(v_, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_CANCELLED);
  expect_shown(nullptr);
  EXPECT_EQ(difference(seen(), sky), "");

  // Setting an environment clears the error of a failed load.
  ASSERT_EQ(cumulet_load_environment(v_, "no such sky.hdr"), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_ERROR_FILE);
  ASSERT_EQ(cumulet_set_environment(v_, nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK) << cumulet_last_error(v_);
  ASSERT_EQ(cumulet_render(v_, &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags & CUMULET_RENDER_FAILED, 0U);
}

TEST_F(Contract, EnvironmentPixelsAreReadAtAnySize) {
  const EnvironmentRef environment = cumulet::test::make_environment(64, 32);
  std::vector<float> rgb(std::size_t{3} * 8 * 4 + 1, -1.0F);
  const auto get = [&](std::uint32_t width, std::uint32_t height, std::uint64_t count) {
    return cumulet_environment_get_pixels(environment.get(), width, height, rgb.data(), count);
  };
  ASSERT_EQ(get(8, 4, 96), CUMULET_OK);
  EXPECT_NEAR(rgb[0], 6.0F, 0.01F);
  EXPECT_NEAR(rgb[3], 0.09F, 0.001F);
  EXPECT_NEAR(rgb[5], 0.3F, 0.001F);
  EXPECT_EQ(rgb[96], -1.0F);
  EXPECT_EQ(get(8, 4, 95), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(get(0, 4, 96), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(get(16385, 1, 96), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_environment_get_pixels(nullptr, 8, 4, rgb.data(), 96), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(cumulet_environment_get_pixels(environment.get(), 8, 4, nullptr, 96), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(Contract, Contract20cPhysicalSkiesAreComputedOnAWorker) {
  struct Told {
    std::mutex mutex;
    std::vector<std::thread::id> threads;
  } told;
  auto desc = make_desc<cumulet_create_desc>();
  desc.trace = [](void* user, const char* name, double, double) {
    auto& t = *static_cast<Told*>(user);
    const std::scoped_lock lock(t.mutex);
    if (std::string(name) == "computing the sky") t.threads.push_back(std::this_thread::get_id());
  };
  desc.trace_user = &told;
  cumulet_viewer* raw = nullptr;
  ASSERT_EQ(cumulet_create(&desc, &raw, nullptr, 0), CUMULET_OK);
  ViewerPtr dragged(raw);
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 4;
  sampling.preview = CUMULET_PREVIEW_OFF;
  ASSERT_EQ(cumulet_set_sampling(raw, &sampling), CUMULET_OK);
  cumulet_camera* camera = nullptr;
  ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
  ASSERT_EQ(cumulet_set_camera(raw, camera), CUMULET_OK);
  cumulet_camera_release(camera);
  ASSERT_EQ(cumulet_attach(raw, FakeGl::get_proc, &fake_), CUMULET_OK);

  auto light = make_desc<cumulet_sun_sky_desc>();
  light.sky = CUMULET_SKY_PHYSICAL;
  light.ground_albedo = 0.3F;
  const auto at = [&](cumulet_viewer* v, float elevation) {
    light.sun_elevation_degrees = elevation;
    light.sun_azimuth_degrees = 2.0F * elevation;
    ASSERT_EQ(cumulet_set_sun_sky(v, &light), CUMULET_OK);
  };
  at(v_, 45.0F);
  const Picture alone = picture_of(v_, volume_.get(), target_);
  at(v_, 20.0F);
  EXPECT_NE(difference(picture_of(v_, volume_.get(), target_), alone), "");

  // While dragging: the newest sky is displayed in the end.
  at(raw, 15.0F);
  ASSERT_EQ(cumulet_set_volume(raw, volume_.get()), CUMULET_OK);
  auto frame = target_.frame();
  frame.budget_ms = 1.0;
  constexpr int steps = 30;
  for (int i = 1; i <= steps; ++i) {
    at(raw, 15.0F + static_cast<float>(i));
    ASSERT_EQ(cumulet_render(raw, &frame, nullptr), CUMULET_OK);
  }
  EXPECT_EQ(difference(picture_of(raw, volume_.get(), target_), alone), "");
  // To another sky and back: a superseded sky is not displayed last.
  at(raw, 80.0F);
  at(raw, 45.0F);
  EXPECT_EQ(difference(picture_of(raw, volume_.get(), target_), alone), "");
  // A constant sky between two physical skies. cumulet_cancel and cumulet_wait do not affect physical skies.
  auto constant = make_desc<cumulet_sun_sky_desc>();
  constant.sky_radiance[0] = 1.0F;
  ASSERT_EQ(cumulet_set_sun_sky(raw, &constant), CUMULET_OK);
  EXPECT_NE(difference(picture_of(raw, volume_.get(), target_), alone), "");
  at(raw, 45.0F);
  cumulet_cancel(raw);
  ASSERT_EQ(cumulet_wait(raw, -1.0), CUMULET_OK) << "a sky is no load";
  EXPECT_EQ(difference(picture_of(raw, volume_.get(), target_), alone), "");

  dragged.reset();
  EXPECT_FALSE(told.threads.empty());
  EXPECT_LE(told.threads.size(), std::size_t{steps} + 4);
  EXPECT_EQ(std::ranges::count(told.threads, std::this_thread::get_id()), 0);
}

// Context loss at each call: ContextLossAt in robustness_test.cpp.
TEST_F(Contract, Contract21ContextIsReplaced) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  for (const bool lost : {false, true}) {
    ASSERT_EQ(lost ? cumulet_context_lost(v_) : cumulet_detach(v_), CUMULET_OK);
    const auto frame = target_.frame();
    EXPECT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_ERROR_DETACHED);
    ASSERT_EQ(cumulet_attach(v_, FakeGl::get_proc, &fake_), CUMULET_OK);
    EXPECT_EQ(cumulet_attach(v_, FakeGl::get_proc, &fake_), CUMULET_ERROR_INVALID_ARGUMENT) << "attached already";
    target_.clear({});
    converge(v_, frame);
    EXPECT_EQ(difference(target_.pixels(), picture), "");
  }
  ASSERT_EQ(cumulet_context_lost(v_), CUMULET_OK);
  const std::uint64_t calls = fake_.calls();
  viewer_.reset();
  EXPECT_EQ(fake_.calls(), calls);
}

// Threads and share groups: tests/embed/two_threads.cpp.
TEST_F(Contract, Contract22ViewersAreIndependent) {
  const VolumeRef other = make_ball(12);
  const Picture alone = picture_of(v_, volume_.get(), target_);
  const ViewerPtr second = viewer({.samples = 2});
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 5.0;
  ASSERT_EQ(cumulet_set_medium(second.get(), &medium), CUMULET_OK);
  picture_of(second.get(), other.get(), target_);
  EXPECT_NE(cumulet_load_volume(second.get(), nullptr, nullptr), CUMULET_OK);
  EXPECT_NE(std::string(cumulet_last_error(second.get())), "");
  EXPECT_EQ(std::string(cumulet_last_error(v_)), "");
  target_.clear({});
  ASSERT_EQ(cumulet_rebuild(v_), CUMULET_OK);
  converge(v_, target_.frame());
  EXPECT_EQ(difference(target_.pixels(), alone), "");
}

TEST_F(Contract, Contract22bTwoViewersInOneEnvironment) {
  const EnvironmentRef shared = cumulet::test::make_environment(64, 32);
  const auto turn = [](cumulet_viewer* v, float degrees) {
    auto settings = make_desc<cumulet_environment_settings_desc>();
    settings.rotation_degrees = degrees;
    ASSERT_EQ(cumulet_set_environment_settings(v, &settings), CUMULET_OK);
  };
  const Picture sky = picture_of(v_, volume_.get(), target_);
  ASSERT_EQ(cumulet_set_environment(v_, shared.get()), CUMULET_OK);
  turn(v_, 120.0F);
  const Picture alone = picture_of(v_, volume_.get(), target_);
  EXPECT_NE(difference(alone, sky), "");
  const ViewerPtr second = viewer();
  ASSERT_EQ(cumulet_set_environment(second.get(), shared.get()), CUMULET_OK);
  EXPECT_NE(difference(picture_of(second.get(), volume_.get(), target_), alone), "") << "turned otherwise";
  turn(second.get(), 120.0F);
  EXPECT_EQ(difference(picture_of(second.get(), volume_.get(), target_), alone), "");
  // Removing or loading an environment in one viewer does not affect the other.
  ASSERT_EQ(cumulet_set_environment(second.get(), nullptr), CUMULET_OK);
  EXPECT_EQ(difference(picture_of(second.get(), volume_.get(), target_), sky), "");
  ASSERT_EQ(cumulet_load_environment(second.get(), "none.hdr"), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(second.get(), -1.0), CUMULET_ERROR_FILE);
  ASSERT_EQ(cumulet_wait(v_, -1.0), CUMULET_OK);
  EXPECT_EQ(difference(picture_of(v_, volume_.get(), target_), alone), "");
}

TEST_F(Contract, Contract23EventsMoveTheCameraAndMatricesSetIt) {
  const Picture picture = picture_of(v_, volume_.get(), target_);
  cumulet_camera* camera = nullptr;
  ASSERT_EQ(cumulet_get_camera(v_, &camera), CUMULET_OK);
  const CameraRef owner(camera);
  std::array<double, 16> view{}, projection{}, moved{};
  ASSERT_EQ(cumulet_camera_get_matrices(camera, 1.0, CUMULET_CLIP_ZERO_TO_ONE, view.data(), projection.data()),
            CUMULET_OK);
  const auto feed = [&](cumulet_event_type type, double x, double y) {
    auto event = make_desc<cumulet_event>();
    event.type = type;
    event.x = x;
    event.y = y;
    std::int32_t handled = -1;
    EXPECT_EQ(cumulet_input(v_, &event, &handled), CUMULET_OK);
    return handled;
  };
  feed(CUMULET_EVENT_POINTER_MOVE, 10, 10);
  EXPECT_EQ(feed(CUMULET_EVENT_BUTTON_DOWN, 10, 10), 1);
  EXPECT_EQ(feed(CUMULET_EVENT_POINTER_MOVE, 22, 13), 1);
  EXPECT_EQ(feed(CUMULET_EVENT_BUTTON_UP, 22, 13), 1);
  ASSERT_EQ(cumulet_camera_get_matrices(camera, 1.0, CUMULET_CLIP_ZERO_TO_ONE, moved.data(), projection.data()),
            CUMULET_OK);
  EXPECT_NE(view, moved);
  target_.clear({});
  converge(v_, target_.frame());
  EXPECT_NE(difference(target_.pixels(), picture), "");
  ASSERT_EQ(cumulet_camera_set_matrices(camera, view.data(), projection.data(), CUMULET_CLIP_ZERO_TO_ONE), CUMULET_OK);
  target_.clear({});
  converge(v_, target_.frame());
  // Compares the mean, because the last bits of a matrix may change the noise.
  double sum = 0.0;
  const Picture back = target_.pixels();
  for (std::size_t i = 0; i < back.size(); ++i) sum += std::abs(back[i] - picture[i]);
  EXPECT_LT(sum / double(back.size()), 4.0);
  // Invalid events return an error.
  auto event = make_desc<cumulet_event>();
  event.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(cumulet_input(v_, &event, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(Contract, Contract24LogsErrorsAndNoExceptions) {
  std::vector<std::string> lines;
  const ViewerPtr logging =
      viewer({.log = [](void* user, cumulet_log_level,
                        const char* line) { static_cast<std::vector<std::string>*>(user)->emplace_back(line); },
              .log_user = &lines});
  cumulet_viewer* v = logging.get();
  EXPECT_STREQ(cumulet_last_error(v), "");
  EXPECT_EQ(cumulet_load_volume(v, "", nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(cumulet_last_error(v)), "");
  EXPECT_EQ(cumulet_load_volume(v, "/nowhere/cloud.vdb", nullptr), CUMULET_OK);
  EXPECT_EQ(cumulet_wait(v, -1.0), CUMULET_ERROR_FILE);
  const std::string error = cumulet_last_error(v);
  EXPECT_NE(error.find("/nowhere/cloud.vdb"), std::string::npos);
  EXPECT_EQ(error.find('\n'), std::string::npos);
  EXPECT_EQ(cumulet_set_volume(v, volume_.get()), CUMULET_OK);
  EXPECT_STREQ(cumulet_last_error(v), "") << "of the last call";
  // Arguments that would cause exceptions inside return errors: huge sizes, NULLs and bad numbers.
  auto dense = make_desc<cumulet_dense_desc>();
  const float one = 1.0F;
  dense.values = &one;
  dense.value_count = std::uint64_t{1} << 62U;
  for (int& length : dense.size) length = std::numeric_limits<int>::max();
  cumulet_volume* out = nullptr;
  std::array<char, 64> small{};
  EXPECT_NE(cumulet_volume_from_dense(&dense, &out, small.data(), small.size()), CUMULET_OK);
  EXPECT_EQ(out, nullptr);
  EXPECT_LT(std::strlen(small.data()), small.size());
  EXPECT_NE(cumulet_volume_open("/nowhere/cloud.vdb", nullptr, &out, nullptr, 0), CUMULET_OK);
  for (const cumulet_status status : {CUMULET_OK, CUMULET_ERROR_FILE, CUMULET_ERROR_TIMEOUT})
    EXPECT_NE(std::string(cumulet_status_text(status)), "");
}

/// Calls cumulet_warm_up until it is complete. Returns the reported progress.
std::vector<double> warm_up(cumulet_viewer* viewer, const cumulet_frame_desc& frame,
                            cumulet_warm_up_scope scope = CUMULET_WARM_UP_SCENE) {
  std::vector<double> told;
  auto result = make_desc<cumulet_warm_up_result>();
  do {
    EXPECT_EQ(cumulet_warm_up(viewer, &frame, scope, &result), CUMULET_OK) << cumulet_last_error(viewer);
    told.push_back(result.progress);
  } while (result.incomplete != 0 && told.size() < 10000);
  EXPECT_EQ(result.incomplete, 0);
  return told;
}

TEST_F(Contract, Contract26NothingIsCompiledInAFrameOnceWarm) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  const auto compiled = [&] { return fake_.calls("CompileShader") + fake_.calls("LinkProgram"); };
  struct Case {
    cumulet_preview preview;
    bool surfaces;
    bool texture;
    cumulet_denoise denoise;
  };
  for (const auto& [preview, surfaces, texture, denoise] :
       {Case{CUMULET_PREVIEW_AUTO, false, false, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_AUTO, true, true, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_OFF, true, false, CUMULET_DENOISE_OFF},
        Case{CUMULET_PREVIEW_OFF, false, false, CUMULET_DENOISE_FAST}}) {
    SCOPED_TRACE(std::to_string(preview) + (surfaces ? " surfaces" : "") + (texture ? " texture" : "") +
                 (denoise == CUMULET_DENOISE_FAST ? " denoised" : ""));
    const ViewerPtr own = viewer();
    auto display = make_desc<cumulet_display_desc>();
    display.denoise = denoise;
    ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
    ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
    if (surfaces) {
      ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
    }
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 2;
    sampling.preview = preview;
    sampling.separate_volume_aov = surfaces ? 1 : 0;
    ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    auto frame = target_.frame();
    frame.budget_ms = 5.0;
    frame.write_depth = 1;
    if (texture) {
      frame.target = CUMULET_TARGET_TEXTURE;
      frame.framebuffer = 0;
      frame.format = GL_RGBA16F;
    }
    const Picture before = target_.pixels();
    const std::vector<double> told = warm_up(own.get(), frame);
    EXPECT_TRUE(std::ranges::is_sorted(told));
    EXPECT_EQ(told.back(), 1.0);
    EXPECT_EQ(target_.pixels(), before) << "it draws nothing";
    auto stats = make_desc<cumulet_stats>();
    ASSERT_EQ(cumulet_get_stats(own.get(), &stats), CUMULET_OK);
    EXPECT_GT(stats.build_seconds_upload, 0.0);
    const auto programs = compiled();
    const auto uses = fake_.first_uses();
    converge(own.get(), frame);
    cumulet_camera* camera = nullptr;
    ASSERT_EQ(cumulet_get_camera(own.get(), &camera), CUMULET_OK);
    const cumulet::test::CameraRef owner(camera);
    ASSERT_EQ(cumulet_camera_orbit(camera, 0.1, 0.0), CUMULET_OK);
    converge(own.get(), frame);
    auto pick = make_desc<cumulet_pick>();
    ASSERT_EQ(cumulet_pick_at(own.get(), 16.0, 16.0, &pick), CUMULET_OK);
    EXPECT_EQ(compiled(), programs);
    EXPECT_EQ(fake_.first_uses(), uses);
    EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
    // A second warm-up compiles nothing.
    warm_up(own.get(), frame);
    EXPECT_EQ(compiled(), programs);
  }
}

TEST_F(Contract, Contract26bFramesDoNotWaitForParallelCompilation) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  fake_.compile_in_parallel();
  const ViewerPtr own = viewer();
  const auto frame = target_.frame();
  auto result = make_desc<cumulet_frame_result>();
  // Without a warm-up, the first frame waits for programs that draw, because there is no image to show instead.
  ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK);
  EXPECT_EQ(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
  EXPECT_GT(fake_.waits(), 0U);
  fake_.finish_compiling(true);
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  const auto stalls = [&](const char* what) {
    SCOPED_TRACE(what);
    fake_.finish_compiling(false);
    const auto waited = fake_.waits();
    const auto linked = fake_.calls("LinkProgram");
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(own.get());
      EXPECT_NE(result.flags & CUMULET_RENDER_INCOMPLETE, 0U);
      EXPECT_EQ(result.flags & CUMULET_RENDER_CONVERGED, 0U);
    }
    EXPECT_EQ(fake_.waits(), waited);
    EXPECT_GT(fake_.calls("LinkProgram"), linked);
    fake_.finish_compiling(true);
  };
  stalls("the first picture");
  converge(own.get(), frame);
  const Picture separate_volume_aov = target_.pixels();
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  stalls("surfaces");
  EXPECT_EQ(difference(target_.pixels(), separate_volume_aov), "") << "the last picture shows until then";
  converge(own.get(), frame);
  EXPECT_NE(difference(target_.pixels(), separate_volume_aov), "");
  // Another tone map: meanwhile, the old program is used.
  auto display = make_desc<cumulet_display_desc>();
  display.tone_map = CUMULET_TONE_MAP_CLIP;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  stalls("a tone map");
  converge(own.get(), frame);
  display.denoise = CUMULET_DENOISE_FAST;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  stalls("the filter");
  // Another encoding is for another target: only its own program fits, and the frame waits for it.
  converge(own.get(), frame);
  target_.clear({0.2F, 0.4F, 0.6F, 1.0F});
  const Picture cleared = target_.pixels();
  auto linear = frame;
  linear.color = CUMULET_COLOR_LINEAR;
  fake_.finish_compiling(false);
  ASSERT_EQ(cumulet_render(own.get(), &linear, &result), CUMULET_OK);
  EXPECT_NE(difference(target_.pixels(), cleared), "");
  fake_.finish_compiling(true);
  // A warm-up does not wait either, and ends when the driver is done.
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.view = CUMULET_VIEW_STEPS;
  ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
  fake_.finish_compiling(false);
  const auto waited = fake_.waits();
  auto warm = make_desc<cumulet_warm_up_result>();
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_SCENE, &warm), CUMULET_OK);
    EXPECT_EQ(warm.incomplete, 1);
  }
  EXPECT_EQ(fake_.waits(), waited);
  fake_.finish_compiling(true);
  warm_up(own.get(), frame);
}

TEST_F(Contract, Contract26cReadBackWaitsForCompilation) {
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  fake_.compile_in_parallel();
  fake_.finish_compiling(true);
  const ViewerPtr own = viewer();
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  auto frame = target_.frame();
  converge(own.get(), frame);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.density_scale = 2.0;
  ASSERT_EQ(cumulet_set_medium(own.get(), &medium), CUMULET_OK);
  frame.budget_ms = 0.01;
  auto result = make_desc<cumulet_frame_result>();
  for (int i = 0; i < 1000 && (result.flags & CUMULET_RENDER_PREVIEW) == 0; ++i) {
    ASSERT_EQ(cumulet_render(own.get(), &frame, &result), CUMULET_OK) << cumulet_last_error(own.get());
  }
  ASSERT_NE(result.flags & CUMULET_RENDER_PREVIEW, 0U) << "with surfaces beneath, which the compositor reads back";
  std::vector<float> first(std::size_t{side} * side * 4);
  std::vector<float> later(first.size());
  fake_.finish_compiling(false);
  ASSERT_EQ(cumulet_read_linear(own.get(), first.data(), first.size()), CUMULET_OK);
  fake_.finish_compiling(true);
  ASSERT_EQ(cumulet_read_linear(own.get(), later.data(), later.size()), CUMULET_OK);
  EXPECT_EQ(first, later);
}

// On GPUs, the depth query of each call is still pending when the call returns.
TEST_F(Contract, Contract26dWarmUpWithHostDepthEnds) {
  const HostTarget large(gl_, 2048, 2048);
  const ViewerPtr own = viewer();
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  auto frame = large.frame();
  frame.target = CUMULET_TARGET_NONE;
  frame.depth_source = CUMULET_DEPTH_SOURCE_FRAMEBUFFER;
  frame.depth_name = large.framebuffer();
  auto result = make_desc<cumulet_warm_up_result>();
  result.incomplete = 1;
  for (int i = 0; i < 200 && result.incomplete != 0; ++i) {
    ASSERT_EQ(cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_SCENE, &result), CUMULET_OK);
  }
  EXPECT_EQ(result.incomplete, 0);
}

// Checks that the warm-up proceeds under any budget, and that a program that does not build does not stop the others.
// One test, because it builds all programs: a minute and gigabytes if the driver has not cached them.
TEST_F(Contract, Contract26eWarmUpOfAllEndsAndCoversEveryScene) {
  // The scenes below use only a few of the hundreds of kernels. The others take a driver many minutes, so they are
  // compiled only in the long tier.
  if (std::getenv("CUMULET_WHOLE_KERNELS") == nullptr) {
    fake_.hollow_kernels({"#define CM_CHANNELS 1", "#define CM_ENVIRONMENT 1", "#define CM_EQUIANGULAR 1",
                          "#define CM_GROUPS 1", "#define CM_HOLDOUT 1", "#define CM_INSTANCES 1",
                          "#define CM_ANALYTIC_LIGHTS 1", "#define CM_MOTION 1", "#define CM_EXTENDED_BSDF 1",
                          "#define CM_SECOND_LOBE 1"});
  }
  const cumulet::test::SurfacesRef panes = cumulet::test::make_panes(5.0F);
  const auto linked = [&] { return fake_.calls("LinkProgram"); };
  const auto compiled = [&] { return fake_.calls("CompileShader") + linked(); };
  const ViewerPtr own = viewer();
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
  auto frame = target_.frame();
  auto result = make_desc<cumulet_warm_up_result>();
  std::vector<double> told;
  const auto step = [&](double budget_ms) {
    frame.budget_ms = budget_ms;
    const cumulet_status status = cumulet_warm_up(own.get(), &frame, CUMULET_WARM_UP_ALL, &result);
    told.push_back(result.progress);
    return status;
  };
  const auto run = [&](double budget_ms) {
    cumulet_status status = CUMULET_OK;
    for (int i = 0; i < 10000; ++i) {
      status = step(budget_ms);
      if (status != CUMULET_OK || result.incomplete == 0) return status;
    }
    ADD_FAILURE() << "it never ends";
    return status;
  };
  ASSERT_EQ(step(1e-3), CUMULET_OK) << cumulet_last_error(own.get());
  EXPECT_EQ(result.incomplete, 1) << "piece by piece";
  EXPECT_LT(result.progress, 0.5);
  for (int i = 0; i < 10000 && result.progress < 0.2; ++i) {
    ASSERT_EQ(step(1e-3), CUMULET_OK) << cumulet_last_error(own.get());
    ASSERT_EQ(result.incomplete, 1);
  }
  ASSERT_GE(result.progress, 0.2);
  fake_.fail_linking(true);
  for (const auto begun = linked(); linked() == begun;) ASSERT_EQ(step(1e-3), CUMULET_OK);
  fake_.fail_linking(false);
  EXPECT_EQ(run(5.0), CUMULET_ERROR_GL) << "told in the end";
  EXPECT_NE(std::string(cumulet_last_error(own.get())).find("does not build"), std::string::npos);
  EXPECT_GT(result.progress, 0.9);
  EXPECT_TRUE(std::ranges::is_sorted(told));
  // The error is returned again without another build. A changed setting allows one.
  const auto before = linked();
  EXPECT_EQ(run(5.0), CUMULET_ERROR_GL);
  EXPECT_EQ(linked(), before);
  auto display = make_desc<cumulet_display_desc>();
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  EXPECT_EQ(run(5.0), CUMULET_OK) << cumulet_last_error(own.get());
  EXPECT_EQ(result.progress, 1.0);
  EXPECT_EQ(linked(), before + 1);

  const auto programs = compiled();
  EXPECT_EQ(run(5.0), CUMULET_OK);
  EXPECT_EQ(compiled(), programs) << "once more has nothing to do";
  const auto expect_nothing_compiled = [&](const char* what) {
    SCOPED_TRACE(what);
    ASSERT_EQ(cumulet_wait(own.get(), -1.0), CUMULET_OK);
    converge(own.get(), frame);
    EXPECT_EQ(compiled(), programs);
  };
  expect_nothing_compiled("the volume");
  auto grid = make_desc<cumulet_grid_desc>();
  for (const cumulet_grid_type march : {CUMULET_GRID_DENSE, CUMULET_GRID_BRICKS, CUMULET_GRID_TETRAHEDRAL}) {
    grid.type = march;
    ASSERT_EQ(cumulet_set_grid(own.get(), &grid), CUMULET_OK);
    expect_nothing_compiled("another march");
  }
  ASSERT_EQ(cumulet_set_surfaces(own.get(), panes.get()), CUMULET_OK);
  expect_nothing_compiled("surfaces");
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  for (const cumulet_view_mode view : {CUMULET_VIEW_CELLS, CUMULET_VIEW_STEPS, CUMULET_VIEW_SHADED}) {
    sampling.view = view;
    ASSERT_EQ(cumulet_set_sampling(own.get(), &sampling), CUMULET_OK);
    expect_nothing_compiled("another view");
  }
}

TEST_F(Contract, Contract26fFailedProgramIsReportedOnceAndNotRebuilt) {
  const ViewerPtr own = viewer();
  const auto frame = target_.frame();
  auto none = frame;
  none.target = CUMULET_TARGET_NONE;
  ASSERT_EQ(cumulet_set_volume(own.get(), volume_.get()), CUMULET_OK);
  converge(own.get(), none);
  fake_.fail_linking(true);
  EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_ERROR_GL);
  const auto linked = fake_.calls("LinkProgram");
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cumulet_render(own.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(own.get());
  }
  EXPECT_EQ(fake_.calls("LinkProgram"), linked);
  fake_.fail_linking(false);
  auto display = make_desc<cumulet_display_desc>();
  display.exposure_stops = 1.0F;
  ASSERT_EQ(cumulet_set_display(own.get(), &display), CUMULET_OK);
  const Picture before = target_.pixels();
  converge(own.get(), frame);
  EXPECT_NE(difference(target_.pixels(), before), "");
}

// tests/embed runs all example hosts. This test runs the smallest one, if it is built.
TEST(ContractHosts, Contract25TheSmallestHostRuns) {
  namespace fs = std::filesystem;
  const fs::path host = fs::read_symlink("/proc/self/exe").parent_path() / "cumulet-embed-egl";
  if (!fs::exists(host)) GTEST_SKIP() << "cumulet-embed-egl is not built";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    execl(host.c_str(), host.c_str(), "--volume", "/nowhere/cloud.vdb", nullptr);
    _exit(127);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1) << "a file that is not there is told in a line";
}

}  // namespace
