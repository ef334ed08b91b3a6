// cumulet.hpp: it passes all values through, and ownership transfers lose nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "headless.hpp"
#include "support/folder.hpp"
#include "support/openvdb.hpp"
#include "support/osmesa_leaks.hpp"

namespace {

using namespace cumulet;  // NOLINT(google-build-using-namespace)

// A ball of density in 16^3 voxels.
std::vector<float> ball() {
  std::vector<float> values;
  for (int z = 0; z < 16; ++z) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        values.push_back((x - 8) * (x - 8) + (y - 8) * (y - 8) + (z - 8) * (z - 8) < 50 ? 1.0F : 0.0F);
      }
    }
  }
  return values;
}

Volume ball_volume() {
  const std::vector<float> values = ball();
  return Volume::from_dense({.values = values, .size = {16, 16, 16}, .name = "ball"}).value();
}

// A temporary file with the ball as grid "density". corner: value of one more voxel, unless 0.
class BallFile {
 public:
  explicit BallFile(float corner = 0.0F) {
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create();
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    const std::vector<float> values = ball();
    for (int i = 0; i < 4096; ++i) {
      if (values[i] > 0.0F) grid->tree().setValue({i % 16, i / 16 % 16, i / 256}, values[i]);
    }
    if (corner != 0.0F) grid->tree().setValue({0, 0, 0}, corner);
    openvdb::io::File(path()).write(openvdb::GridCPtrVec{grid});
  }

  [[nodiscard]] std::string path() const { return (folder_ / "ball.vdb").string(); }

 private:
  test::Folder folder_;
};

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

class CppViewer : public testing::Test {
 protected:
  [[nodiscard]] GetProc get_proc() { return {headless::Context::get_proc, &context_}; }

  static FrameResult converge(Viewer& viewer, std::uint32_t width, std::uint32_t height) {
    viewer.wait().value();
    FrameResult frame;
    do {
      frame = viewer.render({.budget_ms = 1000, .target = FrameTarget::none, .width = width, .height = height}).value();
    } while (frame.has(RenderFlags::incomplete | RenderFlags::loading));
    return frame;
  }

  headless::Context context_ = headless::Context::create(headless::Backend::automatic);
};

TEST_F(CppViewer, ReadsWithoutWaiting) {
  Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
  viewer.set_volume(ball_volume()).value();
  viewer.set_sampling({.samples = 4, .preview = Preview::off}).value();
  viewer.frame_all().value();
  converge(viewer, 24, 16);
  const std::uint64_t read = viewer.begin_read({.source = ReadSource::linear}).value();
  EXPECT_EQ(viewer.finish_read(read, {})->width, 24U);
  std::vector<float> linear(24 * 16 * 4);
  std::vector<float> copied(linear.size());
  viewer.read_linear(linear).value();
  while (!viewer.finish_read(read, copied)->ready) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(copied, linear);
  EXPECT_EQ(viewer.finish_read(read, copied).error().status, StatusCode::invalid_argument);
  EXPECT_TRUE(viewer.cancel_read(viewer.begin_read({.source = ReadSource::aov, .aov = Aov::error}).value()));
}

TEST_F(CppViewer, ShowsAVolume) {
  const BallFile file;
  Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
  viewer.set_sampling({.samples = 8, .preview = Preview::off}).value();
  viewer.set_grid({.threshold = 0.1}).value();
  viewer.set_medium({.density_scale = 2, .anisotropy = 0.3F}).value();
  viewer.set_ramp(Ramp::density, std::to_array<std::array<float, 2>>({{0, 0}, {1, 1}})).value();
  viewer.set_ramp(Ramp::flame, {}).value();
  EXPECT_EQ(viewer.set_ramp(Ramp::flame, std::to_array<std::array<float, 2>>({{0, 0}})).error().status,
            StatusCode::invalid_argument);
  viewer.set_sun_sky({.sun_elevation_degrees = 45, .sun_irradiance = {2, 2, 2}, .sky_radiance = {1, 0.5F, 0.25F}})
      .value();
  viewer.set_display({.exposure_stops = 1, .tone_map = ToneMap::clip}).value();
  viewer.load_volume(file.path(), "density").value();

  const FrameResult frame = converge(viewer, 24, 16);
  EXPECT_TRUE(frame.has(RenderFlags::converged));
  EXPECT_FALSE(frame.has(RenderFlags::failed | RenderFlags::preview));
  EXPECT_EQ(frame.progress, 1.0);
  EXPECT_EQ(frame.width, 24U);
  EXPECT_EQ(frame.height, 16U);

  std::vector<float> linear(24 * 16 * 4);
  viewer.read_linear(linear).value();
  EXPECT_EQ(linear[0], 1.0F);  // the sky, at the corner
  EXPECT_EQ(linear[2], 0.25F);
  EXPECT_EQ(linear[3], 0.0F);
  EXPECT_GT(linear[(8 * 24 + 12) * 4 + 3], 0.9F);  // the ball's alpha, in the middle
  std::vector<float> mattes(24 * 16 * 2);
  int asked = 0;
  const auto name = [&](ObjectKind kind, std::uint64_t tag, std::uint32_t transform_index) -> const char* {
    asked += kind == ObjectKind::volume && tag == 0 && transform_index == 0 ? 1 : 100;
    return "ball";
  };
  viewer.read_cryptomatte(name, 1, mattes).value();
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(std::bit_cast<std::uint32_t>(mattes[(8 * 24 + 12) * 2]), Viewer::cryptomatte_id("ball"));
  EXPECT_GT(mattes[(8 * 24 + 12) * 2 + 1], 0.9F);
  EXPECT_EQ(viewer.read_cryptomatte(name, 17, mattes).error().status, StatusCode::invalid_argument);
  std::vector<std::uint8_t> display(linear.size());
  viewer.read_display(display).value();
  EXPECT_EQ(display[0], 255);  // 1 x 2^1, clipped
  EXPECT_EQ(display[3], 255);
  std::vector<std::uint8_t> encoded(linear.size());
  viewer.encode_display(linear, encoded).value();
  EXPECT_EQ(encoded, display);
  EXPECT_EQ(viewer.read_denoised({.network = "none.tza"}, linear).error().status, StatusCode::file);
  EXPECT_EQ(viewer.read_display(std::span(display).first(4)).error().status, StatusCode::invalid_argument);
  EXPECT_GT(viewer.measure_noise().value(), 0.0);

  const Pick pick = viewer.pick_at(12, 8).value();
  EXPECT_TRUE(pick.hit);
  EXPECT_NEAR(pick.position[0], 8.0, 2.0);
  EXPECT_GT(pick.distance, 0.0);
  EXPECT_FALSE(viewer.pick_at(0, 0)->hit);
  EXPECT_EQ(viewer.get_bounds()->min, viewer.get_volume()->info()->bounds.min);
  EXPECT_EQ(viewer.get_bounds()->max, viewer.get_volume()->info()->bounds.max);

  const Stats stats = viewer.get_stats().value();
  EXPECT_GT(stats.cells, 24U);
  EXPECT_GT(stats.levels, 0U);
  EXPECT_GT(stats.cell_bytes, 0U);
  EXPECT_GE(stats.gl_bytes, stats.cell_bytes);
  EXPECT_EQ(stats.active_voxels, viewer.get_volume()->info()->active_voxels);
  EXPECT_GT(stats.build_seconds_total, 0.0);
  EXPECT_GT(stats.trace_seconds, 0.0);
  EXPECT_EQ(stats.samples, 8U * 24 * 16);
  EXPECT_GT(stats.steps, 0U);
  EXPECT_EQ(stats.bounds.max, viewer.get_bounds()->max);
  EXPECT_FALSE(stats.gl_vendor.empty());
  EXPECT_FALSE(stats.gl_renderer.empty());
  EXPECT_EQ(stats.gl_version.view().substr(0, 2), "4.");
  EXPECT_FALSE(stats.limited);

  const Progress progress = viewer.get_progress().value();
  EXPECT_EQ(progress.stage, Stage::idle);
  EXPECT_EQ(progress.status, StatusCode::ok);
  EXPECT_TRUE(progress.message.empty());
  viewer.rebuild().value();
  EXPECT_TRUE(converge(viewer, 24, 16).has(RenderFlags::converged));

  const FrameResult textured =
      viewer.render({.target = FrameTarget::texture, .width = 24, .height = 16, .write_depth = true}).value();
  EXPECT_NE(textured.texture, 0U);
  EXPECT_NE(textured.depth_texture, 0U);
}

TEST_F(CppViewer, ReportsWhyACallFailed) {
  const auto context_of_nothing = Viewer::create({.get_proc = [](const char*) -> void* { return nullptr; }});
  EXPECT_EQ(context_of_nothing.error().status, StatusCode::unsupported);
  EXPECT_FALSE(context_of_nothing.error().message.empty());

  Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
  EXPECT_EQ(viewer.set_grid({.type = GridType{77}}).error().status, StatusCode::invalid_argument);
  const auto refused = viewer.set_medium({.anisotropy = 1.0F});
  EXPECT_EQ(refused.error().message.view(), cumulet_last_error(viewer.handle()));
  EXPECT_NE(refused.error().message.view().find("anisotropy"), std::string_view::npos);
  EXPECT_FALSE(viewer.get_bounds());
  EXPECT_FALSE(viewer.get_volume().value());

  viewer.load_volume("no such cloud.vdb").value();
  EXPECT_EQ(viewer.wait().error().status, StatusCode::file);
  EXPECT_NE(viewer.get_progress()->message.view().find("no such cloud.vdb"), std::string_view::npos);

  const Viewer moved = std::move(viewer);
  EXPECT_TRUE(moved);
  EXPECT_FALSE(viewer);  // NOLINT(bugprone-use-after-move): that is what is tested
  EXPECT_EQ(viewer.rebuild().error().status, StatusCode::invalid_argument);
  viewer.cancel();
}

TEST_F(CppViewer, CallbacksSurviveMoves) {
  std::atomic<int> updates = 0;
  std::vector<std::string> warnings;  // written while this thread is in wait()
  auto holder = std::make_unique<Viewer>(Viewer::create({.log =
                                                             [&](LogLevel level, std::string_view message) {
                                                               if (level == LogLevel::warning)
                                                                 warnings.emplace_back(message);
                                                             },
                                                         .update = [&] { ++updates; }})
                                             .value());
  Viewer viewer = std::move(*holder);
  holder.reset();
  const BallFile file(-1.0F);  // triggers a warning
  viewer.load_volume(file.path()).value();
  viewer.wait().value();
  EXPECT_GT(updates, 0);
  EXPECT_EQ(warnings.size(), 1U) << testing::PrintToString(warnings);
}

TEST_F(CppViewer, LoadsAVolumeWithItsSuggestedDensityScale) {
  const BallFile file;
  const auto loaded = [&](double density_scale, bool suggested) {
    Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
    viewer.set_sampling({.samples = 1, .preview = Preview::off}).value();
    viewer.set_medium({.density_scale = density_scale, .coalbedo = {1, 1, 1}}).value();
    const std::string path = file.path();
    viewer.load_volume(VolumeFileDesc{.path = path.c_str(), .suggested_density_scale = suggested}).value();
    converge(viewer, 24, 16);
    return viewer;
  };
  const auto picture = [](Viewer& viewer) {
    std::vector<float> linear(24 * 16 * 4);
    viewer.read_linear(linear).value();
    return linear;
  };
  Viewer suits = loaded(100.0, true);
  const double scale = suits.get_volume()->suggest_density_scale().value();
  Viewer same = loaded(scale, false);
  Viewer denser = loaded(100.0, false);
  EXPECT_EQ(suits.get_stats()->cells, same.get_stats()->cells);
  EXPECT_EQ(picture(suits), picture(same));
  EXPECT_NE(picture(suits), picture(denser));
  // The grid is already built for this density scale.
  suits.set_medium({.density_scale = scale, .coalbedo = {1, 1, 1}}).value();
  EXPECT_EQ(suits.get_progress()->stage, Stage::idle);
  // A medium set between the end of the load and the next frame applies either to the loaded volume or to none.
  const auto loading = [&] {
    Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
    viewer.set_sampling({.samples = 1, .preview = Preview::off}).value();
    viewer.set_medium({.density_scale = 100.0, .coalbedo = {1, 1, 1}}).value();
    const std::string path = file.path();
    viewer.load_volume(VolumeFileDesc{.path = path.c_str(), .suggested_density_scale = true}).value();
    while (viewer.get_progress()->stage != Stage::idle) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return viewer;
  };
  std::array<std::uint64_t, 2> cells{};
  for (std::size_t waits = 0; waits < 2; ++waits) {
    Viewer viewer = loading();
    if (waits != 0) viewer.wait().value();
    viewer.set_grid({.threshold = 0.05}).value();
    converge(viewer, 24, 16);
    cells[waits] = viewer.get_stats()->cells;
  }
  EXPECT_EQ(cells[0], cells[1]);
  Viewer other = loading();
  other.set_volume(Volume::open(file.path()).value()).value();
  converge(other, 24, 16);
  EXPECT_EQ(picture(other), picture(denser));

  cumulet_volume_file_desc neither = VolumeFileDesc{.path = "no such cloud.vdb"};
  neither.suggested_density_scale = 2;
  EXPECT_EQ(cumulet_load_volume_file(suits.handle(), &neither), CUMULET_ERROR_INVALID_ARGUMENT);
}

// A worker thread may be in a callback while the viewer is replaced.
TEST_F(CppViewer, NoCallbackAfterDestruction) {
  struct Captured {
    std::atomic<bool>& gone;
    ~Captured() { gone = true; }
  };
  std::atomic<bool> gone = false;
  std::atomic<bool> in_log = false;
  std::atomic<bool> gone_in_log = false;
  std::shared_ptr<Captured> captured(new Captured{gone});
  Viewer viewer = Viewer::create({.log = [&in_log, &gone, &gone_in_log, captured](LogLevel, std::string_view) {
                    in_log = true;
                    in_log.notify_one();
                    std::this_thread::sleep_for(std::chrono::milliseconds(50));
                    gone_in_log = gone.load();
                  }}).value();
  captured.reset();
  const BallFile file(-1.0F);
  viewer.load_volume(file.path()).value();
  in_log.wait(false);
  viewer = Viewer();
  EXPECT_TRUE(gone);
  EXPECT_FALSE(gone_in_log);
}

TEST_F(CppViewer, AttachesAndDetachesContexts) {
  Viewer viewer = Viewer::create().value();  // detached
  EXPECT_EQ(viewer.render({.width = 8, .height = 8}).error().status, StatusCode::detached);
  viewer.set_volume(ball_volume()).value();
  viewer.set_sampling({.samples = 1}).value();
  viewer.attach(get_proc()).value();
  EXPECT_TRUE(converge(viewer, 8, 8).has(RenderFlags::converged));
  viewer.detach().value();
  EXPECT_EQ(viewer.measure_noise().error().status, StatusCode::detached);
  viewer.attach([this](const char* name) { return headless::Context::get_proc(&context_, name); }).value();
  EXPECT_TRUE(converge(viewer, 8, 8).has(RenderFlags::converged));
  {
    headless::Context other = headless::Context::create(headless::Backend::automatic);
    viewer.context_lost().value();
    viewer.attach({headless::Context::get_proc, &other}).value();
    EXPECT_TRUE(converge(viewer, 8, 8).has(RenderFlags::converged));
    viewer.detach().value();
  }
  EXPECT_EQ(viewer.attach({}).error().status, StatusCode::invalid_argument);
}

TEST_F(CppViewer, UsesASharedCamera) {
  Viewer viewer = Viewer::create({.get_proc = get_proc(), .gl_state = GlStatePolicy::host_resets}).value();
  viewer.set_volume(ball_volume()).value();
  Camera camera = Camera::create({.eye = {8, 8, 50}, .target = {8, 8, 8}}).value();
  viewer.set_camera(camera).value();
  EXPECT_EQ(viewer.get_camera()->get()->eye, (Vector{8, 8, 50}));
  camera = Camera();  // the viewer keeps a reference
  viewer.set_navigation({.style = NavigationStyle::maya}).value();
  (void)converge(viewer, 32, 32);

  const auto drag = [&](Modifiers modifiers) {
    const auto down = viewer.input({.type = EventType::button_down, .x = 4, .y = 4, .modifiers = modifiers});
    const auto move = viewer.input({.type = EventType::pointer_move, .x = 12, .y = 4, .modifiers = modifiers});
    const auto up = viewer.input({.type = EventType::button_up, .x = 12, .y = 4, .modifiers = modifiers});
    return down.has_value() && move.has_value() && up.has_value() && *move;
  };
  EXPECT_FALSE(drag(Modifiers::none));
  EXPECT_EQ(viewer.get_camera()->get()->eye, (Vector{8, 8, 50}));
  EXPECT_TRUE(drag(Modifiers::alt));
  EXPECT_NE(viewer.get_camera()->get()->eye, (Vector{8, 8, 50}));
  viewer.frame_all().value();
  EXPECT_NEAR(viewer.get_camera()->get()->target[0], 8.0, 1e-6);
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

TEST_F(CppViewer, SharesSurfaces) {
  const std::array<float, 9> positions = {0, 0, 0, 2, 0, 0, 0, 1, 0};
  const std::array<MeshDesc, 1> meshes = {MeshDesc{.positions = positions, .emission = {1, 0, 0}}};
  Surfaces surfaces = Surfaces::from_triangles({.meshes = meshes}).value();
  Viewer one = Viewer::create({.get_proc = get_proc()}).value();
  Viewer two = Viewer::create({.get_proc = get_proc()}).value();
  EXPECT_FALSE(one.get_surfaces().value());
  for (Viewer* viewer : {&one, &two}) {
    viewer->set_sampling({.samples = 4}).value();
    viewer->set_surface_settings({.time = 1.0, .lighting = SurfaceLighting::direct}).value();
    viewer->set_surfaces(surfaces).value();
    EXPECT_EQ(viewer->get_surfaces()->handle(), surfaces.handle());
    EXPECT_TRUE(converge(*viewer, 8, 8).has(RenderFlags::converged));
  }
  const Surfaces copy = surfaces;
  EXPECT_EQ(copy.handle(), surfaces.handle());
  Surfaces moved = std::move(surfaces);
  EXPECT_FALSE(surfaces);  // NOLINT(bugprone-use-after-move): that is what is tested
  surfaces = Surfaces::adopt(moved.release());
  EXPECT_EQ(surfaces.handle(), copy.handle());
  two.set_surfaces({}).value();
  EXPECT_FALSE(two.get_surfaces().value());
  EXPECT_EQ(two.get_bounds().error().status, StatusCode::invalid_argument);
  EXPECT_EQ(one.get_bounds()->max, (Vector{2, 1, 0}));
  EXPECT_EQ(one.use_surface_camera(0).error().status, StatusCode::invalid_argument);
  EXPECT_EQ(one.load_surfaces({}).error().status, StatusCode::invalid_argument);
  EXPECT_EQ(one.load_environment({}).error().status, StatusCode::invalid_argument);
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

TEST_F(CppViewer, ShowsModels) {
  const std::array<float, 12> positions = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  const std::array<std::uint32_t, 6> indices = {0, 1, 2, 0, 2, 3};
  const std::array<MeshDesc, 1> meshes = {MeshDesc{.positions = positions, .indices = indices, .emission = {1, 0, 0}}};
  const Surfaces surfaces = Surfaces::from_triangles({.meshes = meshes}).value();
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  Model model = Model::create({.surfaces = surfaces, .to_world = transform, .tag = 7}).value();
  Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
  viewer.set_sampling({.samples = 4, .preview = Preview::off}).value();
  viewer.get_camera()->set({.eye = {0, 0, 5}, .target = {0, 0, 0}}).value();
  EXPECT_FALSE(viewer.remove_model(model)) << "it is not shown yet";
  viewer.add_model(model).value();
  EXPECT_FALSE(viewer.add_model(model)) << "it is shown already";
  const auto picked = [&] {
    EXPECT_TRUE(converge(viewer, 16, 16).has(RenderFlags::converged));
    return viewer.pick_at(8, 8).value();
  };
  const Pick pick = picked();
  EXPECT_TRUE(pick.hit);
  EXPECT_TRUE(pick.hit_surface);
  EXPECT_EQ(pick.tag, 7U);
  EXPECT_NEAR(pick.distance, 5.0, 1e-2);
  EXPECT_EQ(viewer.get_bounds()->max, (Vector{1, 1, 0}));
  transform[14] = 2.0;
  model.set_to_world(transform).value();
  EXPECT_NEAR(picked().distance, 3.0, 1e-2);
  EXPECT_EQ(viewer.get_bounds()->max, (Vector{1, 1, 2}));
  model.set({.surfaces = surfaces, .to_world = transform, .shadow_only = true}).value();
  EXPECT_FALSE(picked().hit) << "cameras do not see it";
  // The viewer keeps its own reference.
  model = Model();
  EXPECT_TRUE(viewer.get_bounds());
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
