// The points of the embedding contract about jobs, threads, several viewers, input and errors.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "cumulet/cumulet.hpp"
#include "support/c_host.hpp"
#include "support/contract.hpp"
#include "support/fake_gl.hpp"
#include "support/folder.hpp"
#include "support/radiance.hpp"

namespace {

using cumulet::test::CameraRef;
using cumulet::test::Contract;
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

// Coalescing and errors: UpdateCallback in robustness_test.cpp.
TEST_F(Contract, Contract17UpdateCallbackReportsFinishedJobs) {
  std::atomic<int> updates = 0;
  const ViewerPtr notified =
      viewer({.update = [](void* user) { ++*static_cast<std::atomic<int>*>(user); }, .update_user = &updates});
  auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(notified.get(), &frame, nullptr), CUMULET_OK);
  updates = 0;
  ASSERT_EQ(cumulet_set_volume(notified.get(), volume_.get()), CUMULET_OK);
  EXPECT_GE(updates, 1);
  ASSERT_EQ(cumulet_render(notified.get(), &frame, nullptr), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(notified.get(), -1.0), CUMULET_OK);
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
  } trace;
  auto desc = make_desc<cumulet_create_desc>();
  desc.trace = [](void* user, const char* name, double, double) {
    auto& t = *static_cast<Told*>(user);
    const std::scoped_lock lock(t.mutex);
    if (std::string(name) == "computing the sky") t.threads.push_back(std::this_thread::get_id());
  };
  desc.trace_user = &trace;
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
  EXPECT_FALSE(trace.threads.empty());
  EXPECT_LE(trace.threads.size(), std::size_t{steps} + 4);
  EXPECT_EQ(std::ranges::count(trace.threads, std::this_thread::get_id()), 0);
}

// Context loss at each call: ContextLossAt in context_loss_test.cpp.
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

}  // namespace
