// The embedding contract of docs/architecture.md, one test per point, using only cumulet.h and cumulet.hpp. Points that
// need more than one test (all state, all allocations, threads, windows) are in robustness_test.cpp,
// out_of_memory_test.cpp and tests/embed.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "support/c_host.hpp"
#include "support/contract.hpp"
#include "support/fake_gl.hpp"
#include "viewer/c_fields.hpp"

namespace {

using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::CameraRef;
using cumulet::test::Contract;
using cumulet::test::converge;
using cumulet::test::difference;
using cumulet::test::FakeGl;
using cumulet::test::HostTarget;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::picture_of;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;

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
  check_enum("cells", &cumulet_grid_desc::cells, 3, grid);
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
  int messages = 0;
  const GLDEBUGPROC callback = [](GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar*, const void* user) {
    if (type == GL_DEBUG_TYPE_ERROR) ++*static_cast<int*>(const_cast<void*>(user));
  };
  gl_.Enable(GL_DEBUG_OUTPUT);
  gl_.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  gl_.DebugMessageCallback(callback, &messages);
  gl_.Enable(GL_FLOAT);  // pending: INVALID_ENUM
  const int own = messages;
  picture_of(v_, volume_.get(), target_);
  EXPECT_EQ(gl_.GetError(), GLenum{GL_NO_ERROR});
  EXPECT_EQ(messages, own) << "errors of ours went to the host";
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
  } trace;
  auto desc = make_desc<cumulet_create_desc>();
  desc.get_proc = FakeGl::get_proc;
  desc.get_proc_user = &fake_;
  desc.trace = [](void* user, const char* name, double begin, double end) {
    auto& t = *static_cast<Told*>(user);
    const std::scoped_lock lock(t.mutex);
    t.pieces[name].emplace_back(begin, end);
    EXPECT_EQ(cumulet_rebuild(nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
  };
  desc.trace_user = &trace;
  cumulet_viewer* raw = nullptr;
  ASSERT_EQ(cumulet_create(&desc, &raw, nullptr, 0), CUMULET_OK);
  ViewerPtr viewer(raw);
  picture_of(viewer.get(), volume_.get(), target_);
  viewer.reset();
  for (const char* name : {"frame", "cumulet: upload", "cumulet: trace", "cumulet: draw", "building the grid"})
    EXPECT_FALSE(trace.pieces[name].empty()) << name;
  // Passes are nested in their frame.
  const auto [begin, end] = trace.pieces["cumulet: draw"].back();
  EXPECT_LE(begin, end);
  EXPECT_TRUE(
      std::ranges::any_of(trace.pieces["frame"], [&](const auto& f) { return f.first <= begin && end <= f.second; }));
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
  EXPECT_EQ(WEXITSTATUS(status), 1) << "a file that is not there is reported in a line";
}

}  // namespace
