// cumulet.hpp: viewers.

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
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
using test::CppViewer;

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

TEST_F(CppViewer, SetsColorRamps) {
  Viewer viewer = Viewer::create({.get_proc = get_proc()}).value();
  viewer.set_color_ramp(Ramp::density, std::to_array<std::array<float, 4>>({{0, 0, 0, 0}, {1, 1, 1, 1}})).value();
  viewer.set_color_ramp(Ramp::density, {}).value();
  EXPECT_EQ(viewer.set_color_ramp(Ramp::flame, std::to_array<std::array<float, 4>>({{0, 0, 0, 0}})).error().status,
            StatusCode::invalid_argument);
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
  EXPECT_EQ(suits.get_interpolation().value(), Interpolation::linear) << "the default";
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

}  // namespace
