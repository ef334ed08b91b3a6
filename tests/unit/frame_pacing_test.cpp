// Scheduling: the work of a frame within its budget, bounds of dispatches, and images shown meanwhile.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/milliseconds.hpp"
#include "render/pacing/dispatch_pacer.hpp"
#include "support/busy_host.hpp"
#include "support/c_host.hpp"
#include "support/fake_gl.hpp"
#include "support/gl_viewer.hpp"
#include "support/osmesa_leaks.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using glm::ivec3;
using glm::vec3;

using Clock = std::chrono::steady_clock;

constexpr double no_bound = std::numeric_limits<double>::infinity();

TEST(DispatchCostTest, IsUnknownWithoutMeasuredTraversal) {
  render::RoundCost cost;
  EXPECT_FALSE(cost.most(1.0));
  cost.learn(100.0, 500.0, 500.0);  // ignored: the driver compiled in it
  EXPECT_FALSE(cost.most(1.0));
  cost.learn(100.0, 0.001, no_bound);  // ignored: only sky, no traversal
  EXPECT_FALSE(cost.most(1.0));
}

TEST(DispatchCostTest, ExtrapolatesConservatively) {
  render::RoundCost cost;
  cost.learn(128.0, 1.0, 1.0);
  cost.learn(128.0, 1.0, 1.0);
  EXPECT_DOUBLE_EQ(*cost.most(128.0), 1.0);
  EXPECT_DOUBLE_EQ(*cost.most(1024.0), 8.0);  // assumes no more parallel lanes than seen
  EXPECT_DOUBLE_EQ(*cost.most(2.0), 1.0);     // assumes that one lane takes as long
}

TEST(DispatchCostTest, CheapSkyTilesDoNotLowerTheEstimateForClouds) {
  render::RoundCost cost;
  for (int i = 0; i < 2; ++i) cost.learn(128.0, 1.0, 1.0);
  for (int i = 0; i < 1000; ++i) cost.learn(128.0, 1e-4, no_bound);  // sky
  EXPECT_DOUBLE_EQ(*cost.most(128.0), 1.0);
  // Half of the lanes traverse the cloud in some of the rounds: the known cost is between the two bounds.
  cost.learn(128.0, 0.3, 3.0);
  EXPECT_DOUBLE_EQ(*cost.most(128.0), 1.0);
}

TEST(DispatchCostTest, SingleSlowOutlierIsIgnored) {
  render::RoundCost cost;
  for (int i = 0; i < 2; ++i) cost.learn(128.0, 1.0, 1.0);
  cost.learn(128.0, 50.0, 50.0);
  EXPECT_NEAR(*cost.most(128.0), 1.0, 0.01);
  cost.learn(128.0, 3.0, 3.0);  // the second time in a row it counts
  EXPECT_NEAR(*cost.most(128.0), 3.0, 0.1);
  // On a busy machine, the estimate is limited to a small multiple of the best cost, so that work continues.
  for (int i = 0; i < 20; ++i) cost.learn(128.0, 1000.0, 1000.0);
  EXPECT_LT(*cost.most(128.0), 5.0);
  EXPECT_LT(*cost.most(128.0, true), 2.0);
}

TEST(DispatchCostTest, LearnsHowManyLanesTheDeviceRunsAtOnce) {
  render::RoundCost cost;
  cost.learn_groups(64, 64);  // all ran at once
  cost.learn_groups(256, 2);  // a driver on two cores
  EXPECT_FALSE(cost.resident_lanes());
  cost.learn_groups(256, 100);
  EXPECT_EQ(cost.resident_lanes(), 6400U);
  cost.learn_groups(256, 80);  // beside another program
  EXPECT_EQ(cost.resident_lanes(), 6400U);
}

TEST(DispatchPacerTest, DispatchesTakePartOfTheTimeThatIsLeft) {
  const render::DispatchPacer pacer(deadline_after(1000.0));
  EXPECT_FALSE(pacer.is_over());
  // A busy machine may leave less.
  EXPECT_LE(pacer.left_ms(0.0), 900.0);
  EXPECT_LE(pacer.left_ms(100.0), 800.0);
  EXPECT_LE(pacer.max_ms(), render::dispatch_ms);
  EXPECT_GE(pacer.max_ms(), render::min_ms);
}

TEST(DispatchPacerTest, ACallWithoutTimeSendsOneDispatch) {
  const render::InFlightDispatches none(nullptr);
  render::DispatchPacer pacer(deadline_after(0.0));
  EXPECT_TRUE(pacer.is_over());
  EXPECT_LE(pacer.left_ms(0.0), 0.0);
  EXPECT_EQ(pacer.max_ms(), render::min_ms);
  EXPECT_TRUE(pacer.must_send(none));
  pacer.note_sent();
  EXPECT_FALSE(pacer.must_send(none));
  EXPECT_FALSE(pacer.wait(none));
}

TEST(DispatchPacerTest, NothingInFlightIsNotWaitedFor) {
  const render::InFlightDispatches none(nullptr);
  EXPECT_FALSE(render::DispatchPacer(deadline_after(1e6)).wait(none));
}

TEST(TimeReserveTest, OneCallInTwentyMayExceedItsBudget) {
  render::Reserve reserve;
  EXPECT_EQ(reserve.of(10.0), 0.0);
  // Other programs take 0 to 4 ms of each 10 ms call, uniformly distributed.
  int late = 0;
  for (int i = 0; i < 2000; ++i) {
    const double others = double((i * 7) % 41) * 0.1;
    const double taken = 10.0 - reserve.of(10.0) + others;
    late += i >= 1000 && taken > 11.5 ? 1 : 0;
    reserve.learn(10.0, taken);
  }
  EXPECT_NEAR(late, 50, 10);
  // A part of the budget always remains. After the disturbance, the whole budget is used again.
  for (int i = 0; i < 100; ++i) reserve.learn(10.0, 14.0);
  EXPECT_GE(10.0 - reserve.of(10.0), 5.0);
  for (int i = 0; i < 100; ++i) reserve.learn(10.0, 1.0);
  EXPECT_EQ(reserve.of(10.0), 0.0);
  // If the driver compiles or draws inside the call, a reserve would not have helped.
  for (int i = 0; i < 100; ++i) reserve.learn(10.0, 1000.0);
  EXPECT_EQ(reserve.of(10.0), 0.0);
}

/// A simulated device with its own clock. Its lanes trace sky, a cloud or the cloud's rim, so the cost of a dispatch is
/// known exactly. A round takes as long as its most expensive lane, or as all lanes if more are active than run at
/// once.
class MadeDevice {
 public:
  enum class Lane : std::uint8_t { sky, rim, cloud };
  struct Speed {
    double at_once = 0.0;   // lanes
    double cloud_ms = 0.0;  // a full round of one lane, in the cheapest part of the cloud
    double launch_ms = 0.0;
  };
  static constexpr double dearer = 1000.0;  // cost of a cloud lane relative to a sky lane, per round

  MadeDevice(const Speed& speed, std::size_t count, double sky) : blocks(count), speed_(speed), lanes_(count) {
    const auto rows = static_cast<std::size_t>(sky * static_cast<double>(count));
    for (std::size_t i = 0; i < count; ++i) {
      for (std::uint32_t lane = 0; lane < a_block; ++lane)
        lanes_[i].push_back({i < rows ? Lane::sky : i == rows && lane % 2 == 0 ? Lane::rim : Lane::cloud, i, 0});
    }
  }

  render::Blocks blocks;

  /// Starts another pass with this number of samples per pixel.
  void begin_pass(std::uint32_t samples) {
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      blocks[i].unfinished = a_block;
      for (Pixel& pixel : lanes_[i]) pixel.rounds_left = samples * (pixel.lane == Lane::cloud ? 24 : 1);
    }
  }

  struct Ran {
    double ms = 0.0;
    double full_rounds = 0.0;
    std::vector<std::uint32_t> unfinished;  // of each block of the dispatch
  };
  Ran run(const render::Dispatched& what) {
    std::vector<Pixel*> alive;
    for (const std::uint32_t block : what.blocks) {
      for (Pixel& pixel : lanes_[block])
        if (pixel.rounds_left > 0) alive.push_back(&pixel);
    }
    Ran ran;
    ran.ms = speed_.launch_ms;
    for (std::uint32_t round = 0; round < what.rounds && !alive.empty(); ++round) {
      double sum = 0.0;
      double dearest = 0.0;
      for (Pixel* pixel : alive) {
        // The depth of a cloud costs up to three times as much as its edge.
        const double part = pixel->lane == Lane::cloud ? 1.0 + 2.0 * double(pixel->block) / double(lanes_.size())
                            : pixel->lane == Lane::rim ? 0.1
                                                       : 1.0 / dearer;
        sum += part * speed_.cloud_ms;
        dearest = std::max(dearest, part * speed_.cloud_ms);
        ran.full_rounds += pixel->lane == Lane::cloud ? 1.0 : pixel->lane == Lane::rim ? 0.1 : 0.0;
        --pixel->rounds_left;
      }
      ran.ms += std::max(dearest, sum / speed_.at_once);
      std::erase_if(alive, [](const Pixel* pixel) { return pixel->rounds_left == 0; });
    }
    for (const std::uint32_t block : what.blocks)
      ran.unfinished.push_back(static_cast<std::uint32_t>(
          std::ranges::count_if(lanes_[block], [](const Pixel& pixel) { return pixel.rounds_left > 0; })));
    return ran;
  }

 private:
  static constexpr std::uint32_t a_block = 1024;
  struct Pixel {
    Lane lane;
    std::size_t block;
    std::uint32_t rounds_left;
  };
  Speed speed_;
  std::vector<std::vector<Pixel>> lanes_;
};

/// Traces a pass as Tracer does, with in-flight dispatches whose completion is known late.
void trace_pass(MadeDevice& device, const std::shared_ptr<render::RoundCost>& cost, double aim_ms,
                std::vector<render::DispatchRecord>& log) {
  constexpr std::uint32_t max_rounds = 65536;
  struct InFlightDispatch {
    render::Dispatched what;
    MadeDevice::Ran ran;
  };
  std::deque<InFlightDispatch> flying;
  std::size_t from = 0;
  const auto land = [&] {
    InFlightDispatch& flight = flying.front();
    render::learn(flight.what, flight.ran.ms, flight.ran.ms, flight.ran.full_rounds);
    log.push_back({flight.what.aim_ms, flight.ran.ms, static_cast<std::uint32_t>(flight.what.blocks.size() * 1024),
                   static_cast<std::uint32_t>(flight.what.lanes), flight.what.rounds, flight.what.max_ms > 0.0});
    for (std::size_t i = 0; i < flight.what.blocks.size(); ++i) {
      device.blocks[flight.what.blocks[i]].unfinished = flight.ran.unfinished[i];
      --device.blocks[flight.what.blocks[i]].under_way;
    }
    flying.pop_front();
  };
  while (std::ranges::any_of(device.blocks, [](const render::Block& block) { return block.unfinished > 0; })) {
    auto what = flying.size() < render::InFlightDispatches::most
                    ? render::choose(device.blocks, from, cost, aim_ms, max_rounds)
                    : std::nullopt;
    if (!what && flying.empty()) what = render::choose_minimum(device.blocks, from, cost, max_rounds);
    if (!what) {
      land();
      continue;
    }
    from = (what->blocks.back() + 1) % device.blocks.size();
    for (const std::uint32_t block : what->blocks) ++device.blocks[block].under_way;
    MadeDevice::Ran ran = device.run(*what);
    flying.push_back({std::move(*what), std::move(ran)});
  }
  while (!flying.empty()) land();
}

constexpr MadeDevice::Speed slow_device{16.0, 0.02, 0.01};
constexpr MadeDevice::Speed fast_device{20000.0, 0.02, 0.01};

TEST(DispatchDurations, CloudDispatchesStayWithinFourTimesTheirTarget) {
  for (const MadeDevice::Speed& speed : {slow_device, fast_device}) {
    for (const double aim_ms : {3.5, 11.0, 100.0, 500.0}) {
      const auto cost = std::make_shared<render::RoundCost>();
      std::vector<render::DispatchRecord> log;
      // Tiles of sky, one with a cloud in its lower half, and one that is all cloud, repeatedly.
      std::vector<MadeDevice> tiles;
      for (const double sky : {1.0, 1.0, 0.5, 0.0}) tiles.emplace_back(speed, 48, sky);
      for (const std::uint32_t samples : {1U, 4U, 16U}) {
        for (MadeDevice& tile : tiles) {
          tile.begin_pass(samples);
          trace_pass(tile, cost, aim_ms, log);
        }
      }
      std::size_t known = 0;
      for (const render::DispatchRecord& dispatch : log) {
        if (!dispatch.known) continue;
        ++known;
        ASSERT_LE(dispatch.ms, 4.0 * dispatch.aim_ms)
            << dispatch.lanes << " lanes, " << dispatch.rounds << " rounds; " << speed.at_once << " at once";
      }
      EXPECT_GT(known, 20U);
    }
  }
}

TEST(DispatchDurations, FastDevicesGetLargeTiles) {
  const auto cost = std::make_shared<render::RoundCost>();
  MadeDevice tile(fast_device, 256, 0.25);  // 512 x 512
  std::vector<render::DispatchRecord> log;
  for (int pass = 0; pass < 2; ++pass) {
    log.clear();
    tile.begin_pass(4);
    trace_pass(tile, cost, 11.0, log);
  }
  const auto largest = std::ranges::max(log, {}, &render::DispatchRecord::lanes);
  EXPECT_GE(largest.lanes, 128U * 1024U);
  // Most of the work is done in such large dispatches.
  double in_large = 0.0;
  double all = 0.0;
  for (const render::DispatchRecord& dispatch : log) {
    all += dispatch.alive;
    if (dispatch.lanes >= 128U * 1024U) in_large += dispatch.alive;
  }
  EXPECT_GT(in_large, 0.5 * all);
}

class FrameBudget : public test::StillTest {
 protected:
  void SetUp() override {
    StillTest::SetUp();
    if (IsSkipped()) return;
    still_->set_volume(test::noise_volume({40, 40, 40}, ivec3(0), 2));
    still_->set_medium({1.0, vec3(1.0F), {0.3F}, 0});
    // A cloud in the lower half, sky in the upper.
    still_->set_camera(test::camera_at({20.0, 40.0, 120.0}, {20.0, 40.0, 0.0}, 36.0));
  }
};

TEST_P(FrameBudget, DispatchDurationIsBoundedForCloudsNextToSky) {
  std::vector<render::DispatchRecord> log;
  viewer().wait(-1.0);
  // Sky tiles and passes come first. Their lanes end at once, so thousands of rounds take no time.
  viewer().set_sampling({8, 1, {render::View::shaded, false}});
  viewer().set_dispatch_log(&log);
  viewer::FrameResult result;
  for (int i = 0; i < 4000 && !result.converged; ++i) result = viewer().render(frame(600, 96, 40.0));
  ASSERT_TRUE(result.converged);
  std::vector<double> over;
  for (const render::DispatchRecord& dispatch : log) {
    if (dispatch.known) over.push_back(dispatch.ms / std::max(dispatch.aim_ms, 1.0));
  }
  ASSERT_GT(over.size(), 20U);
  std::ranges::sort(over);
  // Other programs may delay a few.
  EXPECT_LT(over[over.size() * 95 / 100], 4.0);
  EXPECT_LT(over.back(), 40.0);
}

TEST_P(FrameBudget, SmallBudgetsConvergeToTheSameImage) {
  viewer().wait(-1.0);
  std::vector<std::vector<float>> pictures;
  for (const double budget_ms : {1e6, 3.0}) {
    viewer().set_sampling({2, 3, {render::View::shaded, false}});
    viewer().render(frame(16, 16, 1.0));  // another image between
    viewer().set_sampling({1, 3, {render::View::shaded, false}});
    viewer::FrameResult result;
    double last = 0.0;
    for (int i = 0; i < 20000 && !result.converged; ++i) {
      result = viewer().render(frame(320, 180, budget_ms));
      EXPECT_GE(result.progress, last);
      last = result.progress;
    }
    ASSERT_TRUE(result.converged) << budget_ms << " ms: " << last;
    EXPECT_EQ(viewer().stats().samples, 320U * 180U);
    pictures.emplace_back(std::size_t{320} * 180 * 4);
    viewer().read_linear(pictures.back().data(), pictures.back().size());
  }
  EXPECT_EQ(pictures[0], pictures[1]);
}

TEST_P(FrameBudget, CoarseImagesAreUsefulAndProgressCountsRequestedSamples) {
  viewer().wait(-1.0);
  viewer().set_sampling({4, 3, {render::View::shaded, true}});
  const viewer::Frame f = frame(512, 256, 2.0);
  viewer::FrameResult result;
  // A drag, then rest.
  for (int i = 0; i < 12; ++i) {
    viewer().set_light({static_cast<float>(i), 30.0F, vec3(3.0F), vec3(0.3F)});
    result = viewer().render(f);
  }
  double last = 0.0;
  bool told_early = false;
  glm::uvec2 size = result.size;
  std::uint64_t samples = 0;
  bool settled = false;
  int changes = 0;
  int checked = 0;
  for (int i = 0; i < 20000 && !result.converged; ++i) {
    result = viewer().render(f);
    // The drag's last image may be finished first. Its progress is not that of the new settings.
    settled = settled || result.progress > 0.0;
    if (settled) {
      EXPECT_GE(result.progress, last);
      last = result.progress;
    }
    told_early = told_early || (result.preview && result.progress > 0.0);
    // The first image may be the drag's.
    if (settled && result.size != size && ++changes > 1 && size.x > 0) {
      ++checked;
      // The previous, coarser image: it had almost as many samples as a quarter of the full image's pixels.
      const double divisor = 512.0 / size.x;
      const double each = std::clamp(divisor * divisor / 4.0, 1.0, 4.0);
      EXPECT_GE(double(samples), 0.85 * each * size.x * size.y) << size.x;
    }
    if (result.size != size) samples = 0;
    size = result.size;
    if (result.preview) samples = std::max(samples, viewer().stats().samples);
  }
  ASSERT_TRUE(result.converged);
  EXPECT_TRUE(told_early);
  EXPECT_GT(checked, 0);
  EXPECT_EQ(result.progress, 1.0);
}

CUMULET_ON_BACKENDS(FrameBudget);

// Number of calls that wait for the GPU.
std::uint64_t waits(const test::FakeGl& gl) {
  std::uint64_t sum = 0;
  for (const char* name :
       {"Finish", "GetNamedBufferSubData", "GetBufferSubData", "ReadPixels", "ReadnPixels", "GetTextureImage",
        "GetTexImage", "GetnTexImage", "GetTextureSubImage", "MapBuffer", "MapNamedBuffer", "GetQueryObjectiv",
        "GetQueryObjectuiv", "GetQueryObjecti64v", "GetQueryObjectui64v"})
    sum += gl.calls(name);
  return sum;
}

TEST(FrameCallDurations, RenderNeverBlocksOnTheGpu) {
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  test::FakeGl fake(headless::Context::get_proc, &context);
  const test::HostTarget target(fake.real(), 200, 120);
  const auto volume = test::make_ball(16);
  for (const bool preview : {false, true}) {
    const auto viewer = test::make_viewer({.get_proc = test::FakeGl::get_proc, .user = &fake, .samples = 4});
    auto sampling = test::make_desc<cumulet_sampling_desc>();
    sampling.samples = 4;
    sampling.preview = preview ? CUMULET_PREVIEW_AUTO : CUMULET_PREVIEW_OFF;
    ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
    ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
    cumulet_frame_desc frame = target.frame();
    frame.budget_ms = 4.0;
    frame.depth_source = CUMULET_DEPTH_SOURCE_TEXTURE;
    frame.depth_name = target.depth_texture();
    const std::uint64_t before = waits(fake);
    const std::uint64_t dispatches = fake.calls("DispatchCompute");
    const cumulet_frame_result result = test::converge(viewer.get(), frame);
    EXPECT_EQ(waits(fake), before) << preview;
    EXPECT_EQ(result.progress, 1.0);
    EXPECT_GT(fake.calls("DispatchCompute"), dispatches + 2);
    std::vector<float> rgba(std::size_t{200} * 120 * 4);
    EXPECT_EQ(cumulet_read_linear(viewer.get(), rgba.data(), rgba.size()), CUMULET_OK);
    EXPECT_GT(waits(fake), before);  // this call waits, so the counter works
  }
}

bool is_done(const GladGLContext& gl, GLsync sync) {
  return gl.ClientWaitSync(sync, 0, 0) != GLenum{GL_TIMEOUT_EXPIRED};
}

// A host that queues much GPU work before each frame and never waits. The viewer does not wait either.
TEST(FrameCallDurations, RenderNeverBlocksOnTheHostsQueuedWork) {
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  const GladGLContext gl = test::load_gl(headless::Context::get_proc, &context);
  const test::HostTarget target(gl, 320, 180);
  const auto volume = test::make_ball(32);
  for (const cumulet_preview preview : {CUMULET_PREVIEW_OFF, CUMULET_PREVIEW_AUTO}) {
    const auto viewer = test::make_viewer({.get_proc = headless::Context::get_proc, .user = &context, .samples = 64});
    auto sampling = test::make_desc<cumulet_sampling_desc>();
    sampling.samples = 4096;
    sampling.preview = preview;
    ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
    ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
    ASSERT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
    cumulet_frame_desc frame = target.frame();
    frame.budget_ms = 5.0;
    auto result = test::make_desc<cumulet_frame_result>();
    // Compiles all programs first, for every size that is drawn.
    for (int i = 0; i < 60; ++i) ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
    gl.Finish();
    const test::BusyHost host(gl, 1000.0);
    const double before = result.progress;
    const auto begun = Clock::now();
    host.queue();
    const GLsync queued = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.Flush();
    if (is_done(gl, queued)) GTEST_SKIP() << "the driver executes within the call (LP_NUM_THREADS=0)";
    std::vector<double> calls;
    for (int i = 0; i < 8; ++i) {
      const auto called = Clock::now();
      ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
      calls.push_back(milliseconds(Clock::now() - called));
    }
    EXPECT_FALSE(is_done(gl, queued)) << "preview " << preview;
    EXPECT_GT(result.progress, before) << "preview " << preview;
    gl.DeleteSync(queued);
    gl.Finish();
    // The queued work takes longer on a busy machine too. A call should take its budget, 1 / 200 of that time.
    const double whole = milliseconds(Clock::now() - begun);
    std::ranges::sort(calls);
    RecordProperty("median_call_ms", std::to_string(calls[4]));
    EXPECT_LT(calls[4], 0.25 * whole) << "preview " << preview;
    EXPECT_TRUE((result.flags & CUMULET_RENDER_INCOMPLETE) != 0);
  }
}

// The same during a drag, frame by frame. The library must not wait for old frames, although llvmpipe may treat their
// buffers as still in use.
TEST(FrameCallDurations, RenderDuringADragNeverBlocksOnTheHostsQueuedWork) {
  headless::Context context = headless::Context::create(headless::Backend::automatic);
  const GladGLContext gl = test::load_gl(headless::Context::get_proc, &context);
  const test::HostTarget target(gl, 1280, 720);
  const auto volume = test::make_ball(32);
  const auto viewer = test::make_viewer({.get_proc = headless::Context::get_proc, .user = &context, .samples = 4096});
  auto sampling = test::make_desc<cumulet_sampling_desc>();
  sampling.samples = 4096;
  sampling.preview = CUMULET_PREVIEW_AUTO;
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_volume(viewer.get(), volume.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_OK);
  cumulet_frame_desc frame = target.frame();
  auto light = test::make_desc<cumulet_sun_sky_desc>();
  light.sun_irradiance[0] = 3.0F;
  light.sun_elevation_degrees = 30.0F;
  const auto render = [&](bool drags) {
    light.sun_azimuth_degrees += drags ? 1.0F : 0.0F;
    ASSERT_EQ(cumulet_set_sun_sky(viewer.get(), &light), CUMULET_OK);
    ASSERT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
  };
  for (const double budget_ms : {1.0, 4.0, 16.0, 64.0, 256.0}) {  // compiles all programs
    frame.budget_ms = budget_ms;
    for (int i = 0; i < 8; ++i) render(true);
  }
  const test::BusyHost host(gl, 250.0);
  frame.budget_ms = 16.0;
  for (int i = 0; i < 24; ++i) {
    gl.Finish();
    host.queue();
    const GLsync queued = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.Flush();
    if (i == 0 && is_done(gl, queued)) GTEST_SKIP() << "the driver executes within the call (LP_NUM_THREADS=0)";
    const bool rests = i < 6;
    for (int frames = 0; frames < (rests ? 5 : 1); ++frames) render(!rests);
    EXPECT_FALSE(is_done(gl, queued)) << "frame " << i;
    gl.DeleteSync(queued);
  }
}

}  // namespace
