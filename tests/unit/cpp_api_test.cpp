// cumulet.hpp: it passes all values through, and ownership transfers lose nothing.

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "headless.hpp"
#include "support/cpp_api.hpp"
#include "support/folder.hpp"

namespace {

using namespace cumulet;  // NOLINT(google-build-using-namespace)
using test::ball;
using test::ball_volume;
using test::BallFile;

static_assert(!std::is_copy_constructible_v<Viewer> && std::is_nothrow_move_constructible_v<Viewer> &&
              std::is_nothrow_move_assignable_v<Viewer>);
static_assert(!std::is_copy_constructible_v<Camera> && std::is_nothrow_move_constructible_v<Camera>);
static_assert(std::is_nothrow_copy_constructible_v<Volume> && std::is_nothrow_move_constructible_v<Volume>);
static_assert(std::is_nothrow_copy_constructible_v<Surfaces> && std::is_nothrow_move_constructible_v<Surfaces>);
static_assert(!std::is_convertible_v<Viewer, bool> && !std::is_convertible_v<Result<>, bool>);

TEST(CppResult, HoldsAValueOrAnError) {
  Result<std::string> good = std::string("here");
  EXPECT_TRUE(good);
  EXPECT_EQ(*good, "here");
  EXPECT_EQ(good->size(), 4U);
  EXPECT_EQ(good.error().status, StatusCode::ok);
  EXPECT_EQ(std::move(good).value(), "here");

  const Result<std::string> bad = Error{StatusCode::file, Text<512>("cloud.vdb: no such file")};
  EXPECT_FALSE(bad.has_value());
  EXPECT_EQ(bad.error().status, StatusCode::file);
  EXPECT_EQ(bad.error().message.view(), "cloud.vdb: no such file");
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH((void)bad.value(), "");
  EXPECT_DEATH(Result<>(bad.error()).value(), "");
  EXPECT_NO_FATAL_FAILURE(Result<>().value());
}

TEST(CppResult, TextIsCutToFit) {
  EXPECT_EQ(Text<4>("abcdef").view(), "abc");
  EXPECT_EQ(Text<4>("abc").view(), "abc");
  EXPECT_TRUE(Text<4>().empty());
}

TEST(CppLibrary, ReportsVersionAndStatus) {
  EXPECT_EQ(version(), cumulet_version());
  EXPECT_STREQ(status_text(StatusCode::cancelled), cumulet_status_text(CUMULET_ERROR_CANCELLED));
}

TEST(CppVolume, IsSharedByCopies) {
  Volume copy;
  EXPECT_FALSE(copy);
  {
    Volume first = ball_volume();
    copy = first;
    EXPECT_EQ(copy.handle(), first.handle());
    const Volume moved = std::move(first);
    EXPECT_FALSE(first);  // NOLINT(bugprone-use-after-move): that is what is tested
    EXPECT_EQ(moved.handle(), copy.handle());
  }
  const VolumeInfo info = copy.info().value();  // still alive
  const std::vector<float> values = ball();
  EXPECT_EQ(info.name.view(), "ball");
  EXPECT_EQ(info.active_voxels, static_cast<std::uint64_t>(std::ranges::count(values, 1.0F)));
  EXPECT_EQ(info.bounds.min, (Vector{0.5, 0.5, 0.5}));
  EXPECT_EQ(info.bounds.max, (Vector{15.5, 15.5, 15.5}));
  EXPECT_EQ(info.max_value, 1.0F);
  const HistogramInfo density = copy.histogram(Ramp::density).value();
  EXPECT_EQ(density.max_value, 1.0F);
  EXPECT_EQ(density.histogram.back(), info.active_voxels);
  EXPECT_EQ(density.histogram.front(), 0U);
  EXPECT_EQ(copy.histogram(Ramp::flame).value().max_value, 0.0F);
  EXPECT_EQ(copy.histogram(static_cast<Ramp>(7)).error().status, StatusCode::invalid_argument);

  cumulet_volume* raw = copy.release();
  EXPECT_FALSE(copy);
  EXPECT_TRUE(Volume::adopt(raw));
  EXPECT_EQ(Volume().info().error().status, StatusCode::invalid_argument);
}

TEST(CppInstance, IsSharedByCopies) {
  const std::vector<float> values = ball();
  const Volume volume = Volume::from_dense({.values = values, .size = {16, 16, 16}}).value();
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 2, 1, 1};
  auto made = Instance::create({.volume = volume, .to_world = transform, .tag = 5});
  ASSERT_TRUE(made.has_value());
  const Instance instance = made.value();
  transform[0] = 0.0;
  EXPECT_FALSE(instance.set_to_world(transform).has_value());
  EXPECT_FALSE(Instance::create({.volume = volume, .to_world = transform}).has_value());
  transform[0] = 2.0;
  EXPECT_TRUE(instance.set_to_world(transform).has_value());
  constexpr std::array<std::array<float, 2>, 2> same{{{0.0F, 0.0F}, {1.0F, 1.0F}}};
  EXPECT_TRUE(instance.set_ramp(Ramp::density, same).has_value());
  constexpr std::array<std::array<float, 4>, 2> gray{{{0.0F, 0.5F, 0.5F, 0.5F}, {1.0F, 1.0F, 1.0F, 1.0F}}};
  EXPECT_TRUE(instance.set_color_ramp(Ramp::density, gray).has_value());
  constexpr std::array<std::array<double, 4>, 1> plane{{{0.0, 1.0, 0.0, -2.0}}};
  EXPECT_TRUE(instance.set_clip({.box = Bounds{{0.0, 0.0, 0.0}, {1.0, 2.0, 3.0}}, .planes = plane}).has_value());
  EXPECT_FALSE(instance.set_clip({.box = Bounds{{0.0, 0.0, 0.0}, {1.0, 0.0, 3.0}}}).has_value());
  EXPECT_TRUE(instance.set_clip({}).has_value());
  EXPECT_TRUE(instance.set({.volume = volume, .medium = {.density_scale = 2.0}, .hidden = true}).has_value());
  EXPECT_FALSE(Instance().set({}).has_value());
}

TEST(CppSequence, IsSharedByCopies) {
  const BallFile ball;
  const std::string path = ball.path();
  const std::array<const char*, 3> paths{path.c_str(), "not-there.vdb", path.c_str()};
  EXPECT_FALSE(Sequence::create({}).has_value());
  const auto made = Sequence::create({.paths = paths, .file = {.suggested_density_scale = true}});
  ASSERT_TRUE(made.has_value()) << made.error().message.c_str();
  const Sequence sequence = *made;
  EXPECT_TRUE(sequence.set_playback({.frames_per_second = 10.0, .repeat = Repeat::loop}));
  EXPECT_FALSE(sequence.set_playback({.first_frame = 3}).has_value());
  EXPECT_EQ(sequence.get_frame_at(0.4).value(), 1U);
  EXPECT_EQ(sequence.get_time_of(2).value(), 0.2);
  EXPECT_TRUE(sequence.set_time(0.1));
  Viewer viewer = Viewer::create({}).value();
  EXPECT_FALSE(viewer.get_sequence_info().has_value());
  EXPECT_TRUE(viewer.set_sequence(sequence));
  EXPECT_TRUE(viewer.wait());
  std::array<std::uint8_t, 3> states{};
  const SequenceInfo info = viewer.get_sequence_info(states).value();
  EXPECT_EQ(info.frames, 3U);
  EXPECT_EQ(info.requested_frame, 1U);
  EXPECT_FALSE(info.is_displayed);
  EXPECT_EQ(states[1], static_cast<std::uint8_t>(FrameState::failed));
  EXPECT_EQ(viewer.get_sequence_frame(1)->view(), "not-there.vdb: no such file");
  EXPECT_TRUE(sequence.set_frame(2.5 - 0.5));
  EXPECT_TRUE(viewer.set_sequence({}));
  EXPECT_FALSE(Sequence().set_time(0.0).has_value());
}

TEST(CppVolume, FromBricksAndTiles) {
  const std::array<std::int32_t, 3> origin{8, 0, 0};
  const std::vector<float> values(512, 2.0F);
  const std::vector<std::uint64_t> active(8, ~std::uint64_t{0});
  const std::array tiles{cumulet_tile{.min = {0, 0, 0}, .max = {7, 7, 7}, .value = 3.0F, .active = 1}};
  const auto volume =
      Volume::from_sparse({.brick_origins = origin, .brick_values = values, .brick_active = active, .tiles = tiles});
  ASSERT_TRUE(volume) << volume.error().message.c_str();
  EXPECT_EQ(volume->info()->active_voxels, 1024U);
  EXPECT_EQ(volume->info()->max_value, 3.0F);

  const std::span<const float> few(values.data(), 511);
  EXPECT_EQ(Volume::from_sparse({.brick_origins = origin, .brick_values = few}).error().status,
            StatusCode::invalid_argument);
  EXPECT_EQ(Volume::from_sparse({.brick_values = values}).error().status, StatusCode::invalid_argument);
}

TEST(CppVolume, FromAFile) {
  const BallFile file;
  const auto volume = Volume::open(file.path());
  ASSERT_TRUE(volume) << volume.error().message.c_str();
  EXPECT_EQ(volume->info()->name.view(), "density");

  const auto absent = Volume::open("no such cloud.vdb");
  EXPECT_EQ(absent.error().status, StatusCode::file);
  EXPECT_NE(absent.error().message.view().find("no such cloud.vdb"), std::string_view::npos);
  const auto unnamed = Volume::open(file.path(), "temperature");
  EXPECT_NE(unnamed.error().message.view().find("temperature"), std::string_view::npos);

  std::string seen;
  EXPECT_TRUE(list_grids(file.path(), [&seen](const char* name, const char* type, const char* refusal) {
    seen += std::string(name) + " " + type + " " + refusal + ";";
  }));
  EXPECT_EQ(seen.substr(0, 8), "density ");
  EXPECT_EQ(std::ranges::count(seen, ';'), 1);
  EXPECT_EQ(list_grids("no such cloud.vdb", [](auto...) {}).error().status, StatusCode::file);
}

TEST(CppCamera, IsSetAndMoved) {
  Camera camera = Camera::create({.eye = {0, 0, 10}, .fovy_degrees = 30}).value();
  const CameraDesc desc = camera.get().value();
  EXPECT_EQ(desc.eye, (Vector{0, 0, 10}));
  EXPECT_EQ(desc.fovy_degrees, 30.0);
  const CameraMatrices matrices = camera.get_matrices(1.0, ClipSpace::zero_to_one).value();
  EXPECT_NEAR(matrices.view[14], -10.0, 1e-12);

  // Each method moves the camera as documented.
  camera.dolly(0.5).value();
  EXPECT_NEAR(camera.get()->eye[2], 5.0, 1e-12);
  camera.fly(1.0, 0.0, 0.0).value();
  EXPECT_NEAR(camera.get()->target[0], 1.0, 1e-12);
  camera.fly(-1.0, 2.0, 1.0).value();
  EXPECT_NEAR(camera.get()->eye[1], 2.0, 1e-12);
  EXPECT_NEAR(camera.get()->eye[2], 4.0, 1e-12);
  camera.set(desc).value();
  EXPECT_EQ(camera.get()->eye, desc.eye);
  camera.orbit(0.5, 0.25).value();
  EXPECT_NE(camera.get()->eye, desc.eye);
  EXPECT_EQ(camera.get()->target, desc.target);
  camera.set(desc).value();
  camera.look(0.5, 0.25).value();
  EXPECT_EQ(camera.get()->eye, desc.eye);
  EXPECT_NE(camera.get()->target, desc.target);
  camera.set(desc).value();
  camera.roll(0.5).value();
  EXPECT_EQ(camera.get()->eye, desc.eye);
  EXPECT_NE(camera.get()->up, desc.up);
  camera.set(desc).value();
  camera.pan(0.5, 0.0).value();
  EXPECT_NE(camera.get()->target[0], 0.0);
  camera.frame({.min = {9, 9, 9}, .max = {11, 11, 11}}, 1.0).value();
  EXPECT_NEAR(camera.get()->target[0], 10.0, 1e-9);

  camera.set_matrices(matrices, ClipSpace::zero_to_one).value();
  const CameraMatrices again = camera.get_matrices(1.0, ClipSpace::zero_to_one).value();
  for (int i = 0; i < 16; ++i) {
    EXPECT_NEAR(again.view[i], matrices.view[i], 1e-9) << i;
    EXPECT_NEAR(again.projection[i], matrices.projection[i], 1e-9) << i;
  }

  EXPECT_EQ(camera.dolly(-1.0).error().status, StatusCode::invalid_argument);
  cumulet_camera* raw = camera.release();
  EXPECT_FALSE(camera);
  EXPECT_TRUE(Camera::adopt(raw));
  EXPECT_EQ(Camera().orbit(1, 1).error().status, StatusCode::invalid_argument);
}

TEST(CppDisplayLut, IsSetAndRemoved) {
  Viewer viewer = Viewer::create({}).value();
  const std::vector<float> values(24, 0.5F);
  viewer.set_display_lut({.values = values, .size = 2, .shaper = LutShaper::log2, .domain_min = -8, .domain_max = 8})
      .value();
  const std::array<float, 4> linear{0.1F, 0.2F, 0.3F, 1.0F};
  std::array<std::uint8_t, 4> bytes{};
  viewer.encode_display(linear, bytes).value();
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 4>{128, 128, 128, 255}));
  viewer.remove_display_lut().value();
  viewer.encode_display(linear, bytes).value();
  EXPECT_LT(bytes[0], bytes[2]);
  EXPECT_EQ(viewer.set_display_lut({.size = 2}).error().status, StatusCode::invalid_argument);
}

TEST(CppSurfaces, FromFilesAndMemory) {
  const std::string json = R"({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"byteLength": 36, "uri": "corners.bin"}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "animations": [{"name": "still", "channels": [], "samplers": []}]})";
  const auto bytes = std::as_bytes(std::span(json));
  const auto nowhere = Surfaces::from_memory(bytes, nullptr, "json");
  EXPECT_EQ(nowhere.error().status, StatusCode::file);
  EXPECT_STREQ(nowhere.error().message.c_str(),
               "json: mesh 0, primitive 0, POSITION: buffer 0: \"corners.bin\" is an external file, but the glTF "
               "data has no folder");
  const auto missing = Surfaces::from_memory(bytes, "/nowhere");
  EXPECT_STREQ(missing.error().message.c_str(),
               "memory: mesh 0, primitive 0, POSITION: buffer 0: corners.bin: no such file");
  EXPECT_EQ(Surfaces::open("no such model.glb").error().status, StatusCode::file);
  EXPECT_EQ(Surfaces().info().error().status, StatusCode::invalid_argument);
}

TEST(CppModel, IsSharedByCopies) {
  const std::array<float, 9> positions = {0, 0, 0, 2, 0, 0, 0, 1, 0};
  const std::array<MeshDesc, 1> meshes = {MeshDesc{.positions = positions}};
  const Surfaces surfaces = Surfaces::from_triangles({.meshes = meshes}).value();
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 2, 1, 1};
  Model model = Model::create({.surfaces = surfaces, .to_world = transform, .tag = 5}).value();
  const Model copy = model;
  EXPECT_EQ(copy.handle(), model.handle());
  Model moved = std::move(model);
  EXPECT_FALSE(model);  // NOLINT(bugprone-use-after-move): that is what is tested
  model = Model::adopt(moved.release());
  EXPECT_EQ(model.handle(), copy.handle());
  EXPECT_FALSE(moved);  // NOLINT(bugprone-use-after-move)
  EXPECT_TRUE(model.set_time(0.5));
  EXPECT_FALSE(model.set_time(std::numeric_limits<double>::quiet_NaN()));
  transform[0] = 0.0;
  EXPECT_FALSE(model.set_to_world(transform)) << "flat";
  const auto flat = Model::create({.surfaces = surfaces, .to_world = transform});
  ASSERT_FALSE(flat);
  EXPECT_EQ(flat.error().status, StatusCode::invalid_argument);
  EXPECT_FALSE(flat.error().message.empty());
  transform[0] = 2.0;
  EXPECT_TRUE(copy.set_to_world(transform));
  EXPECT_TRUE(model.set({.surfaces = surfaces, .hidden = true}));
  EXPECT_EQ(Model().set({}).error().status, StatusCode::invalid_argument);
  EXPECT_EQ(Model().set_time(0.0).error().status, StatusCode::invalid_argument);
}

TEST(CppDynamicVolume, IsSharedByCopies) {
  DynamicVolume live = DynamicVolume::create({.bounds_min = {0, 0, 0}, .bounds_max = {4, 4, 4}}).value();
  const DynamicVolume copy = live;
  DynamicVolume moved = std::move(live);
  EXPECT_FALSE(live);  // NOLINT(bugprone-use-after-move): that is what is tested
  live = DynamicVolume::adopt(moved.release());
  EXPECT_EQ(live.handle(), copy.handle());
  EXPECT_EQ(DynamicVolume().get_volume().error().status, StatusCode::invalid_argument);
  Viewer viewer = Viewer::create({}).value();
  EXPECT_FALSE(viewer.get_dynamic_volume_info()) << "none is shown";
  viewer.set_dynamic_volume(copy).value();
  const std::vector<float> values(4 * 4 * 4, 0.5F);
  const Field field(Channel::density, DenseDesc{.values = values, .size = {4, 4, 4}});
  live.set({.fields = {&field, 1}}).value();
  viewer.wait().value();
  EXPECT_EQ(viewer.get_dynamic_volume_info()->submitted_update, 1U);
  viewer.set_dynamic_volume({}).value();
  EXPECT_FALSE(viewer.get_dynamic_volume_info());
}

TEST(CppDynamicVolume, StatesAreSubmitted) {
  const std::vector<float> values(8 * 8 * 8, 0.5F);
  const cumulet::DenseDesc dense{.values = values, .size = {8, 8, 8}};
  const std::array<cumulet::Field, 2> fields{cumulet::Field(cumulet::Channel::density, dense),
                                             cumulet::Field(cumulet::Channel::flame, dense)};
  const auto volume = cumulet::volume_from_fields({.fields = fields, .name = "fire"});
  ASSERT_TRUE(volume);
  EXPECT_EQ(volume.value().info().value().active_voxels, 512U);
  const auto live = cumulet::DynamicVolume::create();
  ASSERT_TRUE(live);
  EXPECT_FALSE(live.value().get_volume().value());
  ASSERT_TRUE(live.value().set({.fields = fields}));
  const std::array<std::int32_t, 3> origin{8, 0, 0};
  const cumulet::Field brick(cumulet::Channel::density,
                             cumulet::SparseDesc{.brick_origins = origin, .brick_values = values});
  ASSERT_TRUE(live.value().update({.fields = {&brick, 1}}));
  EXPECT_EQ(live.value().get_volume().value().info().value().active_voxels, 1024U);
  const auto twice = live.value().set({.fields = std::vector<cumulet::Field>(40, fields[0]), .name = "fire"});
  ASSERT_FALSE(twice);
  EXPECT_STREQ(twice.error().message.c_str(), "fire: has density twice");
  const cumulet::Field unknown(Channel{99}, dense);
  const auto lines = live.value().set({.fields = {&unknown, 1}, .name = "a fire\nof lines"});
  ASSERT_FALSE(lines);
  EXPECT_EQ(lines.error().message.view().find('\n'), std::string_view::npos) << lines.error().message.c_str();
}

}  // namespace
