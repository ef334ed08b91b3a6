// GPU-resident dynamic volumes with the channels of a fire, and with all channels.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "support/c_playback.hpp"
#include "support/fake_gl.hpp"
#include "support/live_gl_states.hpp"
#include "support/live_volumes.hpp"
#include "support/simulated.hpp"

namespace {

using namespace cumulet;
using test::alone;
using test::Array;
using test::at;
using test::dense;
using test::difference;
using test::expect_same_fields;
using test::in_texture;
using test::LiveRef;
using test::LiveStatesOnGpu;
using test::make_desc;
using test::make_live;
using test::newest;
using test::odd;
using test::Sides;
using test::simulated;
using test::State;
using test::state_of;
using test::ViewerPtr;
using test::voxel_types;
using Picture = std::vector<std::uint8_t>;

const std::vector<cumulet_channel> of_fire{CUMULET_CHANNEL_DENSITY, CUMULET_CHANNEL_TEMPERATURE, CUMULET_CHANNEL_FLAME};

// Density, temperature and flame of a step, as halves; or other channels.
class LiveFireOnGpu : public LiveStatesOnGpu {
 protected:
  explicit LiveFireOnGpu(const std::vector<cumulet_channel>& channels = of_fire) : channels_(channels) {}
  struct Fire {
    std::vector<Array> arrays;
    std::vector<GLuint> textures;
    std::vector<cumulet_gl_field> fields;
  };
  Fire fire(int step) {
    Fire made;
    for (const cumulet_channel channel : channels_) {
      made.arrays.emplace_back(voxel_types[1].format, simulated(channel, odd, step));
      made.textures.push_back(objects_.texture(odd, voxel_types[1], made.arrays.back()));
      made.fields.push_back(in_texture(channel, odd, made.textures.back()));
    }
    return made;
  }
  // Returns the fire with one non-finite voxel in a channel.
  Fire spoilt(Fire fire, std::size_t channel) {
    auto values = fire.arrays[channel].values;
    values[State::at({3, 20, 11}, odd)] = std::numeric_limits<float>::infinity();
    const Array array(voxel_types[1].format, values);
    objects_.put(fire.textures[channel], odd, GL_RED, voxel_types[1].type, array.bytes.data());
    return fire;
  }
  [[nodiscard]] State in_memory(const Fire& fire) const {
    State state;
    for (std::size_t i = 0; i < channels_.size(); ++i) state.dense(channels_[i], odd, fire.arrays[i].values);
    return state;
  }
  static void burn(cumulet_viewer* viewer, float strength, float blackbody = 0.0F) {
    auto medium = make_desc<cumulet_medium_desc>();
    medium.flame_strength = strength;
    medium.blackbody = blackbody;
    ASSERT_EQ(cumulet_set_medium(viewer, &medium), CUMULET_OK) << cumulet_last_error(viewer);
  }
  // The image of the same fields from main memory, made by another viewer.
  Picture by_memory(const Fire& fire, float strength, float blackbody = 0.0F) {
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    burn(other.get(), strength, blackbody);
    return test::picture_of(other.get(), alone(in_memory(fire)).get(), target_);
  }
  // The image of the same GPU-resident fields, made by another viewer.
  Picture by_gl(const Fire& fire, float strength, float blackbody = 0.0F) {
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    const LiveRef live = make_live(desc);
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    burn(other.get(), strength, blackbody);
    const cumulet_gl_volume_desc state = state_of(fire.fields);
    EXPECT_EQ(cumulet_set_dynamic_volume(other.get(), live.get()), CUMULET_OK);
    EXPECT_EQ(cumulet_dynamic_volume_set_gl(other.get(), live.get(), &state), CUMULET_OK);
    return settled(other.get());
  }
  // Renders until nothing changes any more.
  Picture settled(cumulet_viewer* viewer) {
    cumulet_frame_desc frame = target_.frame();
    frame.target = CUMULET_TARGET_NONE;
    for (int quiet = 0; quiet < 5;) {
      auto result = make_desc<cumulet_frame_result>();
      cumulet_wait(viewer, 10.0);  // may time out; the loop continues
      if (cumulet_render(viewer, &frame, &result) != CUMULET_OK) {
        ADD_FAILURE() << cumulet_last_error(viewer);
        break;
      }
      quiet = (result.flags & CUMULET_RENDER_CONVERGED) != 0 ? quiet + 1 : 0;
    }
    return test::drawn_once(viewer, target_);
  }
  // Colors are computed in floats instead of doubles, so a few paths differ.
  static void expect_alike(const Picture& a, const Picture& b) {
    ASSERT_EQ(a.size(), b.size());
    std::size_t others = 0;
    for (std::size_t i = 0; i < a.size(); ++i) others += std::abs(int{a[i]} - int{b[i]}) > 1 ? 1U : 0U;
    EXPECT_LE(others, a.size() / 100);
  }

  std::vector<cumulet_channel> channels_;
};

// Fire channels, and all channels that a state may have.
class LiveChannelsOnGpu : public LiveFireOnGpu, public testing::WithParamInterface<std::vector<cumulet_channel>> {
 protected:
  LiveChannelsOnGpu() : LiveFireOnGpu(GetParam()) {}
};
const std::vector<cumulet_channel> all_channels = [] {
  std::vector<cumulet_channel> all;
  for (int channel = CUMULET_CHANNEL_DENSITY; channel <= CUMULET_CHANNEL_VELOCITY_Z; ++channel)
    all.push_back(static_cast<cumulet_channel>(channel));
  return all;
}();
INSTANTIATE_TEST_SUITE_P(Channels, LiveChannelsOnGpu, testing::Values(of_fire, all_channels),
                         [](const auto& channels) { return channels.param.size() == of_fire.size() ? "fire" : "all"; });

TEST_P(LiveChannelsOnGpu, ImageMatchesStatesFromMemory) {
  burn(v_, 2.0F, 0.5F);
  for (const int step : {0, 3}) {
    const Fire burning = fire(step);
    hand_over(burning.fields);
    const Picture found = settled(v_);
    EXPECT_FALSE(shows_voxels());
    expect_alike(found, by_memory(burning, 2.0F, 0.5F));
    EXPECT_EQ(difference(found, by_gl(burning, 2.0F, 0.5F)), "");
  }
}

// The emission is recomputed from the GPU-resident voxels.
TEST_F(LiveFireOnGpu, EmissionFollowsTheMedium) {
  const Fire burning = fire(1);
  hand_over(burning.fields);
  Picture before = settled(v_);
  EXPECT_EQ(difference(before, by_gl(burning, 1.0F)), "");
  for (const auto& [strength, blackbody] : {std::pair(5.0F, 0.0F), std::pair(0.5F, 1.0F), std::pair(1.0F, 0.0F)}) {
    burn(v_, strength, blackbody);
    const Picture now = settled(v_);
    EXPECT_NE(difference(now, before), "");
    EXPECT_EQ(difference(now, by_gl(burning, strength, blackbody)), "");
    EXPECT_FALSE(shows_voxels());
    before = now;
  }
  // The next state arrives with it.
  const std::uint64_t states = handed();
  hand_over(fire(2).fields);
  settled(v_);
  EXPECT_EQ(handed(), states + 1);
}

TEST_P(LiveChannelsOnGpu, PartialUpdatesEqualAFullState) {
  Fire burning = fire(1);
  burn(v_, 2.0F, 0.5F);
  hand_over(burning.fields);
  settled(v_);
  for (int step = 2; step < 5; ++step) {
    Fire next = fire(step);
    std::vector<cumulet_voxel_box> boxes;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      objects_.put(burning.textures[i], odd, GL_RED, voxel_types[1].type, next.arrays[i].bytes.data());
      for (const Sides& b : State::bricks(odd, next.arrays[i].values, burning.arrays[i].values))
        boxes.push_back({{b[0], b[1], b[2]}, {b[0] + 7, b[1] + 7, b[2] + 7}});
      burning.arrays[i] = next.arrays[i];
    }
    hand_over(burning.fields, boxes);
    const Picture found = settled(v_);
    EXPECT_FALSE(shows_voxels());
    EXPECT_EQ(difference(found, by_gl(next, 2.0F, 0.5F)), "");
  }
}

TEST_P(LiveChannelsOnGpu, IsReadBackWhenNeededInMemory) {
  const Fire burning = fire(2);
  burn(v_, 2.0F);
  hand_over(burning.fields);
  settled(v_);
  get_volume(CUMULET_ERROR_UNSUPPORTED);
  const Picture found = settled(v_);
  EXPECT_TRUE(shows_voxels());
  expect_same_fields(newest(live_), alone(in_memory(burning)));
  EXPECT_EQ(difference(found, by_memory(burning, 2.0F)), "");
}

// Viewers that share a dynamic volume each compute the emission for their own medium.
TEST_F(LiveFireOnGpu, EachViewerUsesItsOwnMedium) {
  cumulet_shader_cache* programs = nullptr;
  const auto programs_desc = make_desc<cumulet_shader_cache_desc>();
  ASSERT_EQ(cumulet_shader_cache_create(&programs_desc, &programs, nullptr, 0), CUMULET_OK);
  const test::ProgramsRef kept(programs);
  std::array<ViewerPtr, 2> viewers;
  for (std::size_t i = 0; i < viewers.size(); ++i) {
    viewers[i] = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                                    .user = &fake_,
                                    .samples = 2,
                                    .programs = programs,
                                    .build = CUMULET_BUILD_GPU});
    burn(viewers[i].get(), i == 0 ? 1.0F : 4.0F);
    ASSERT_EQ(cumulet_set_dynamic_volume(viewers[i].get(), live_.get()), CUMULET_OK);
  }
  for (const int step : {1, 2}) {
    const Fire burning = fire(step);
    const cumulet_gl_volume_desc state = state_of(burning.fields);
    ASSERT_EQ(cumulet_dynamic_volume_set_gl(viewers[0].get(), live_.get(), &state), CUMULET_OK);
    settled(viewers[0].get());
    settled(viewers[1].get());
    EXPECT_EQ(difference(settled(viewers[0].get()), by_gl(burning, 1.0F)), "");
    EXPECT_EQ(difference(settled(viewers[1].get()), by_gl(burning, 4.0F)), "");
  }
}

// Shaders do not evaluate color ramps. The fields are read back to main memory, where they are applied.
TEST_F(LiveFireOnGpu, ColorRampsBringItToMainMemory) {
  const Fire burning = fire(2);
  constexpr std::array<float, 8> stops{0.0F, 0.2F, 1.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.5F};
  for (const cumulet_ramp ramp : {CUMULET_RAMP_DENSITY, CUMULET_RAMP_TEMPERATURE, CUMULET_RAMP_FLAME}) {
    SCOPED_TRACE(ramp);
    SetUp();
    burn(v_, 2.0F, 1.0F);
    hand_over(burning.fields);
    const Picture before = settled(v_);
    EXPECT_FALSE(shows_voxels());
    ASSERT_EQ(cumulet_set_color_ramp(v_, ramp, stops.data(), 2), CUMULET_OK);
    const Picture found = settled(v_);
    EXPECT_TRUE(shows_voxels());
    EXPECT_NE(difference(found, before), "");
    const ViewerPtr other = make(CUMULET_BUILD_GPU);
    burn(other.get(), 2.0F, 1.0F);
    ASSERT_EQ(cumulet_set_color_ramp(other.get(), ramp, stops.data(), 2), CUMULET_OK);
    EXPECT_EQ(difference(found, test::picture_of(other.get(), alone(in_memory(burning)).get(), target_)), "");
  }
}

// If GL memory does not suffice for computing the emission, the fields are read back to main memory.
TEST_F(LiveFireOnGpu, FallsBackToMainMemoryWithoutGpuMemory) {
  const Fire burning = fire(2);
  burn(v_, 2.0F);
  hand_over(burning.fields);
  settled(v_);
  burn(v_, 3.0F);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  fake_.fail_storage(true);
  cumulet_status status = CUMULET_OK;
  for (int i = 0; i < 100 && status == CUMULET_OK; ++i) {
    cumulet_wait(v_, 10.0);
    status = cumulet_render(v_, &frame, nullptr);
  }
  EXPECT_EQ(status, CUMULET_ERROR_OUT_OF_MEMORY);
  fake_.fail_storage(false);
  const Picture found = settled(v_);
  EXPECT_TRUE(shows_voxels());
  EXPECT_EQ(difference(found, by_memory(burning, 3.0F)), "");
}

// Each allocation fails once. The error is returned, and the next state is displayed.
TEST_F(LiveFireOnGpu, AnyFailedAllocationKeepsTheState) {
  const Fire first = fire(1);
  const Fire second = fire(2);
  const Picture in_gl = by_gl(second, 2.0F);
  const Picture in_memory = by_memory(second, 2.0F);
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  int failures = 0;
  int in_main_memory = 0;
  int successes = 0;  // since the last failure; other allocations of a frame are among them
  for (int allocation = 0; successes < 8 && !HasFailure(); ++allocation) {
    SCOPED_TRACE(allocation);
    auto desc = make_desc<cumulet_dynamic_volume_desc>();
    desc.gpu_resident = 1;
    live_ = make_live(desc);
    viewer_ = make(CUMULET_BUILD_GPU);
    v_ = viewer_.get();
    burn(v_, 2.0F);
    ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
    hand_over(first.fields);
    settled(v_);
    const std::uint64_t before = handed();
    const cumulet_gl_volume_desc state = state_of(second.fields);
    fake_.fail_allocation(allocation);
    cumulet_status status = cumulet_dynamic_volume_set_gl(v_, live_.get(), &state);
    for (int i = 0; i < 1000 && status == CUMULET_OK && handed() == before; ++i)
      status = cumulet_render(v_, &frame, nullptr);
    fake_.fail_allocation(-1);
    const bool failed = status != CUMULET_OK;
    failures += failed ? 1 : 0;
    successes = failed ? 0 : successes + 1;
    if (failed) {
      EXPECT_EQ(status, CUMULET_ERROR_OUT_OF_MEMORY) << cumulet_last_error(v_);
      hand_over(second.fields);
    }
    const Picture found = settled(v_);
    in_main_memory += shows_voxels() ? 1 : 0;
    EXPECT_EQ(difference(found, shows_voxels() ? in_memory : in_gl), "");
  }
  EXPECT_GT(failures, 10);
  EXPECT_GT(in_main_memory, 3) << "what it gives off was not found";
}

// Boxes after a rejected state are rejected, even after the previous state's emission is recomputed.
TEST_F(LiveFireOnGpu, PartialUpdatesAfterARejectedStateAreRejected) {
  hand_over(fire(0).fields);
  settled(v_);
  const Fire bad = spoilt(fire(1), 0);
  hand_over(bad.fields);
  EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
  burn(v_, 4.0F);
  EXPECT_EQ(difference(settled(v_), by_gl(fire(0), 4.0F)), "");
  cumulet_gl_volume_desc boxes = state_of(bad.fields);
  const cumulet_voxel_box box{{0, 0, 0}, {9, 9, 9}};
  boxes.changed = &box;
  boxes.changed_count = 1;
  EXPECT_EQ(refusal(boxes, CUMULET_ERROR_INVALID_ARGUMENT), "smoke: there is no state to update");
}

// Hosts may call cumulet_cancel in any callback.
TEST_F(LiveFireOnGpu, CanBeCancelledFromCallbacks) {
  struct Host {
    std::atomic<cumulet_viewer*> viewer = nullptr;
    std::atomic<int> calls = 0;
  } host;
  viewer_ = test::make_viewer({.get_proc = test::FakeGl::get_proc,
                               .user = &fake_,
                               .update =
                                   [](void* user) {
                                     auto& of = *static_cast<Host*>(user);
                                     // Lets some of the work continue.
                                     if (of.viewer != nullptr && ++of.calls % 3 == 0) cumulet_cancel(of.viewer);
                                   },
                               .update_user = &host,
                               .samples = 2,
                               .build = CUMULET_BUILD_GPU});
  v_ = viewer_.get();
  ASSERT_EQ(cumulet_set_dynamic_volume(v_, live_.get()), CUMULET_OK);
  host.viewer = v_;
  cumulet_frame_desc frame = target_.frame();
  frame.target = CUMULET_TARGET_NONE;
  for (int step = 0; step < 6; ++step) {
    burn(v_, 1.0F + static_cast<float>(step));
    hand_over(fire(step).fields);
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(cumulet_render(v_, &frame, nullptr), CUMULET_OK) << cumulet_last_error(v_);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  host.viewer = nullptr;
  EXPECT_GT(host.calls, 6);
  const Fire last = fire(6);
  hand_over(last.fields);
  EXPECT_EQ(difference(settled(v_), by_gl(last, 6.0F)), "");
}

TEST_F(LiveFireOnGpu, NonFiniteValuesAreRejected) {
  const Fire good = fire(0);
  hand_over(good.fields);
  const Picture before = settled(v_);
  const Fire bad = spoilt(fire(0), 1);
  hand_over(bad.fields);
  EXPECT_EQ(frames_until_failure(), CUMULET_ERROR_FILE);
  EXPECT_STREQ(cumulet_last_error(v_), "smoke: temperature: non-finite value in the 8x8x8 brick at (0, 16, 8)");
  EXPECT_EQ(difference(settled(v_), before), "");
}

}  // namespace
