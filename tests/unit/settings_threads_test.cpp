// Settings and input from other threads while one thread renders.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/fair_mutex.hpp"
#include "support/c_host.hpp"

namespace {

using cumulet::FairMutex;
using cumulet::headless::Backend;
using cumulet::headless::Context;
using cumulet::test::at;
using cumulet::test::converge;
using cumulet::test::HostTarget;
using cumulet::test::InstanceRef;
using cumulet::test::load_gl;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_viewer;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

constexpr auto patience = std::chrono::seconds(30);

TEST(FairMutexTest, GivesTurnsInOrder) {
  FairMutex mutex;
  std::vector<int> order;
  mutex.lock();
  EXPECT_TRUE(mutex.is_mine());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      EXPECT_FALSE(mutex.is_mine());
      mutex.lock();
      order.push_back(i);
      mutex.unlock();
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // until it waits
  }
  mutex.unlock();
  mutex.lock();  // after the others, although they have to wake up first
  order.push_back(4);
  mutex.unlock();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order, (std::vector{0, 1, 2, 3, 4}));
}

// A callback runs this function once, on its own thread.
struct Interruption {
  std::mutex mutex;
  std::function<void()> then;
  void run() {
    std::function<void()> once;
    {
      const std::scoped_lock lock(mutex);
      once.swap(then);
    }
    if (once) once();
  }
  void set(std::function<void()> what) {
    const std::scoped_lock lock(mutex);
    then = std::move(what);
  }
};

class SettingsThreads : public testing::Test {
 protected:
  [[nodiscard]] ViewerPtr make() {
    auto desc = make_desc<cumulet_create_desc>();
    desc.get_proc = Context::get_proc;
    desc.get_proc_user = &context_;
    desc.trace = [](void* user, const char* name, double, double) {
      if (std::string_view(name) == "cumulet: trace") static_cast<SettingsThreads*>(user)->in_trace_.run();
    };
    desc.trace_user = this;
    desc.update = [](void* user) {
      static_cast<SettingsThreads*>(user)->in_update_.run();
      ++static_cast<SettingsThreads*>(user)->updates_;
    };
    desc.update_user = this;
    return cumulet::test::make_plain_viewer(desc);
  }
  // Settings that an image depends on.
  static void set_scene(cumulet_viewer* v, cumulet_volume* volume) {
    auto light = make_desc<cumulet_sun_sky_desc>();
    light.sun_elevation_degrees = 40.0F;
    for (float& value : light.sun_irradiance) value = 2.5F;
    for (float& value : light.sky_radiance) value = 0.3F;
    auto sampling = make_desc<cumulet_sampling_desc>();
    sampling.samples = 4;
    sampling.preview = CUMULET_PREVIEW_OFF;
    auto medium = make_desc<cumulet_medium_desc>();
    medium.coalbedo[0] = medium.coalbedo[1] = medium.coalbedo[2] = 0.7F;
    const auto grid = make_desc<cumulet_grid_desc>();
    const auto display = make_desc<cumulet_display_desc>();
    const auto ground = make_desc<cumulet_ground_desc>();
    EXPECT_EQ(cumulet_set_sun_sky(v, &light), CUMULET_OK);
    EXPECT_EQ(cumulet_set_lights(v, nullptr, 0), CUMULET_OK);
    EXPECT_EQ(cumulet_set_sampling(v, &sampling), CUMULET_OK);
    EXPECT_EQ(cumulet_set_medium(v, &medium), CUMULET_OK);
    EXPECT_EQ(cumulet_set_grid(v, &grid), CUMULET_OK);
    EXPECT_EQ(cumulet_set_display(v, &display), CUMULET_OK);
    EXPECT_EQ(cumulet_set_ground(v, &ground), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume_transforms(v, nullptr, 0), CUMULET_OK);
    EXPECT_EQ(cumulet_set_volume(v, volume), CUMULET_OK);
    auto stand = make_desc<cumulet_camera_desc>();
    stand.eye[1] = 6.0;
    stand.eye[2] = 32.0;
    cumulet::test::look(v, stand);
  }
  Picture picture_of(cumulet_viewer* v) {
    EXPECT_EQ(cumulet_wait(v, -1.0), CUMULET_OK) << cumulet_last_error(v);
    converge(v, target_.frame());
    return target_.pixels();
  }

  Interruption in_trace_, in_update_;
  std::atomic<int> updates_ = 0;
  Context context_ = Context::create(Backend::automatic);
  GladGLContext gl_ = load_gl(Context::get_proc, &context_);
  HostTarget target_{gl_, 32, 32};
  VolumeRef ball_ = make_ball(16, 2.0F);
  VolumeRef small_ = make_ball(10, 4.0F);
};

// A thread that repeats its calls.
class Hammer {
 public:
  template <class Call>
  Hammer(std::atomic<bool>& stop, Call&& call)
      : thread_([&stop, call] {
          for (unsigned i = 0; !stop; ++i) call(i);
        }) {}
  ~Hammer() { thread_.join(); }
  Hammer(const Hammer&) = delete;
  Hammer& operator=(const Hammer&) = delete;

 private:
  std::thread thread_;
};

TEST_F(SettingsThreads, ImageIsThatOfTheLastSettingsAfterManyThreadsSetOthers) {
  const ViewerPtr viewer = make();
  cumulet_viewer* const v = viewer.get();
  set_scene(v, ball_.get());
  auto instance_desc = make_desc<cumulet_instance_desc>();
  instance_desc.volume = small_.get();
  std::ranges::copy(at(4.0, 0.0, 0.0), instance_desc.to_world);
  const InstanceRef instance = cumulet::test::make_instance(instance_desc);
  std::atomic<bool> stop = false;
  const auto ok = [&](cumulet_status status) { EXPECT_EQ(status, CUMULET_OK) << cumulet_last_error(v); };
  {
    const Hammer settings(stop, [&](unsigned i) {
      auto medium = make_desc<cumulet_medium_desc>();
      medium.anisotropy = i % 2 == 0 ? 0.5F : -0.5F;
      ok(cumulet_set_medium(v, &medium));
      auto light = make_desc<cumulet_sun_sky_desc>();
      light.sun_azimuth_degrees = static_cast<float>(i % 360);
      light.sun_irradiance[0] = 3.0F;
      ok(cumulet_set_sun_sky(v, &light));
      auto sampling = make_desc<cumulet_sampling_desc>();
      sampling.seed = i;
      ok(cumulet_set_sampling(v, &sampling));
      auto display = make_desc<cumulet_display_desc>();
      display.exposure_stops = static_cast<float>(i % 3);
      ok(cumulet_set_display(v, &display));
      auto lamp = make_desc<cumulet_light_desc>();
      lamp.color[0] = lamp.power = 1.0F;
      lamp.position[1] = 20.0;
      ok(cumulet_set_lights(v, &lamp, i % 2));
      auto ground = make_desc<cumulet_ground_desc>();
      ground.mode = i % 2 == 0 ? CUMULET_GROUND_AT_HEIGHT : CUMULET_GROUND_NONE;
      ok(cumulet_set_ground(v, &ground));
    });
    const Hammer content(stop, [&](unsigned i) {
      ok(cumulet_set_volume(v, i % 2 == 0 ? ball_.get() : small_.get()));
      ok(cumulet_add_instance(v, instance.get()));
      const auto transform = at(0.1 * (i % 10), 0.0, 0.0);
      ok(cumulet_set_volume_transforms(v, transform.data(), 1));
      cumulet_volume* shown = nullptr;
      ok(cumulet_get_volume(v, &shown));
      cumulet_volume_release(shown);
      ok(cumulet_remove_instance(v, instance.get()));
      auto stats = make_desc<cumulet_stats>();
      ok(cumulet_get_stats(v, &stats));
      auto progress = make_desc<cumulet_progress>();
      ok(cumulet_get_progress(v, &progress));
    });
    const Hammer input(stop, [&](unsigned i) {
      auto event = make_desc<cumulet_event>();
      event.type = CUMULET_EVENT_POINTER_MOVE;
      if (i % 8 == 0) event.type = CUMULET_EVENT_BUTTON_DOWN;
      if (i % 8 == 7) event.type = CUMULET_EVENT_BUTTON_UP;
      event.button = CUMULET_BUTTON_LEFT;
      event.x = i % 32;
      event.y = i % 17;
      std::int32_t handled = 0;
      ok(cumulet_input(v, &event, &handled));
      std::array<double, 3> low{}, high{};
      cumulet_get_bounds(v, low.data(), high.data());
      // Each thread has its own last error.
      EXPECT_EQ(cumulet_set_camera(v, nullptr), CUMULET_ERROR_INVALID_ARGUMENT);
      EXPECT_STREQ(cumulet_last_error(v), "camera is NULL");
    });
    auto frame = target_.frame();
    frame.budget_ms = 5.0;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
    for (int i = 0; i < 40 || std::chrono::steady_clock::now() < end; ++i) {
      ok(cumulet_render(v, &frame, nullptr));
      EXPECT_STREQ(cumulet_last_error(v), "");
    }
    stop = true;
  }
  // A viewer without that past makes the same image.
  set_scene(v, ball_.get());
  const Picture after = picture_of(v);
  const ViewerPtr fresh = make();
  set_scene(fresh.get(), ball_.get());
  EXPECT_EQ(picture_of(fresh.get()), after);
  EXPECT_GT(std::ranges::max(after), 100);
}

TEST_F(SettingsThreads, CallsOfOtherThreadsEndWhileAFrameRuns) {
  const ViewerPtr viewer = make();
  cumulet_viewer* const v = viewer.get();
  set_scene(v, ball_.get());
  const Picture before = picture_of(v);
  auto medium = make_desc<cumulet_medium_desc>();
  medium.coalbedo[0] = 0.5F;
  medium.density_scale = 1.0;
  const auto frame = target_.frame();
  const int updates = updates_;
  bool ended = false;
  in_trace_.set([&] {
    auto done = std::async(std::launch::async, [&] {
      std::int32_t handled = 0;
      auto event = make_desc<cumulet_event>();
      event.type = CUMULET_EVENT_FOCUS_LOST;
      EXPECT_EQ(cumulet_set_medium(v, &medium), CUMULET_OK);
      EXPECT_EQ(cumulet_input(v, &event, &handled), CUMULET_OK);
      EXPECT_EQ(cumulet_set_volume(v, small_.get()), CUMULET_OK);
      EXPECT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
    });
    ended = done.wait_for(patience) == std::future_status::ready;
    if (!ended) std::abort();  // the call waits for the frame, and the frame for the call
  });
  ASSERT_EQ(cumulet_render(v, &frame, nullptr), CUMULET_OK);
  ASSERT_TRUE(ended);
  EXPECT_GT(updates_, updates);  // there is something to render
  // The running frame shows the state that it found, and later frames show the new one.
  EXPECT_EQ(target_.pixels(), before);
  const Picture after = picture_of(v);
  EXPECT_NE(after, before);
  const ViewerPtr fresh = make();
  set_scene(fresh.get(), small_.get());
  ASSERT_EQ(cumulet_set_medium(fresh.get(), &medium), CUMULET_OK);
  EXPECT_EQ(picture_of(fresh.get()), after);
}

TEST_F(SettingsThreads, UpdateCallbackHoldsUpNoOtherThread) {
  const ViewerPtr viewer = make();
  cumulet_viewer* const v = viewer.get();
  const auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(v, &frame, nullptr), CUMULET_OK);  // the next change notifies
  bool ended = false;
  in_update_.set([&] {
    auto done = std::async(std::launch::async, [&] {
      const auto display = make_desc<cumulet_display_desc>();
      EXPECT_EQ(cumulet_set_display(v, &display), CUMULET_OK);
    });
    ended = done.wait_for(patience) == std::future_status::ready;
    if (!ended) std::abort();
  });
  const auto medium = make_desc<cumulet_medium_desc>();
  ASSERT_EQ(cumulet_set_medium(v, &medium), CUMULET_OK);
  EXPECT_TRUE(ended);
}

TEST_F(SettingsThreads, CallsInsideACallbackAreRefusedAndKeepTheLastError) {
  const ViewerPtr viewer = make();
  cumulet_viewer* const v = viewer.get();
  set_scene(v, ball_.get());
  ASSERT_EQ(cumulet_wait(v, -1.0), CUMULET_OK);
  cumulet_status status = CUMULET_OK;
  in_trace_.set([&] {
    const auto medium = make_desc<cumulet_medium_desc>();
    status = cumulet_set_medium(v, &medium);
  });
  const auto frame = target_.frame();
  ASSERT_EQ(cumulet_render(v, &frame, nullptr), CUMULET_OK);
  EXPECT_EQ(status, CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(v), "");
}

}  // namespace
