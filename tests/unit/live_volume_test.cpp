// Dynamic volumes in the C API: each state gives the same image as alone, the newest state is always displayed, and
// rejected states leave the last good one.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "support/c_live_volume.hpp"
#include "support/volumes.hpp"
#include "viewer/c_handles.hpp"

namespace {

using cumulet::test::alone;
using cumulet::test::at;
using cumulet::test::CLiveVolume;
using cumulet::test::difference;
using cumulet::test::expect_same_fields;
using cumulet::test::fire;
using cumulet::test::hand_over;
using cumulet::test::HandOver;
using cumulet::test::InstanceRef;
using cumulet::test::LiveRef;
using cumulet::test::make_ball;
using cumulet::test::make_desc;
using cumulet::test::make_live;
using cumulet::test::newest;
using cumulet::test::odd;
using cumulet::test::picture_of;
using cumulet::test::refusal;
using cumulet::test::Sides;
using cumulet::test::simulated;
using cumulet::test::small;
using cumulet::test::smoke;
using cumulet::test::State;
using cumulet::test::ViewerPtr;
using cumulet::test::VolumeRef;
using Picture = std::vector<std::uint8_t>;

TEST_F(CLiveVolume, InvalidInputGivesAOneLineError) {
  auto desc = make_desc<cumulet_dynamic_volume_desc>();
  desc.bounds_max[0] = 1.0;
  cumulet_dynamic_volume* out = nullptr;
  std::array<char, 256> error{};
  EXPECT_EQ(cumulet_dynamic_volume_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "cumulet_dynamic_volume_desc.bounds_min is not below bounds_max");
  EXPECT_EQ(out, nullptr);
  for (int i = 0; i < 3; ++i) {
    desc.bounds_min[i] = -1e308;
    desc.bounds_max[i] = 1e308;
  }
  EXPECT_EQ(cumulet_dynamic_volume_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "cumulet_dynamic_volume_desc's bounds are not from -1e15 to 1e15");
  desc = make_desc<cumulet_dynamic_volume_desc>();
  desc.gpu_resident = 2;
  EXPECT_EQ(cumulet_dynamic_volume_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "cumulet_dynamic_volume_desc.gpu_resident is neither 0 nor 1");

  const LiveRef live = make_live();
  const auto refused = [&](const State& state, const char* cause) {
    EXPECT_EQ(refusal(live, state.desc(), CUMULET_ERROR_INVALID_ARGUMENT), cause);
  };
  refused(State(), "smoke: has no density, temperature or flame");
  refused(State().dense(CUMULET_CHANNEL_RED, small, 0), "smoke: has only some of red, green and blue");
  refused(smoke(small, 0).dense(CUMULET_CHANNEL_VELOCITY_X, small, 0),
          "smoke: has only some of velocity_x, velocity_y and velocity_z");
  refused(smoke(small, 0).dense(CUMULET_CHANNEL_DENSITY, small, 0), "smoke: has density twice");
  refused(State().dense(CUMULET_CHANNEL_DENSITY, {3, 3, 3}, std::vector<float>(26)),
          "smoke: density: has 26 values for a size of (3, 3, 3)");
  State unknown = smoke(small, 0);
  const int none_such = 77;
  std::memcpy(&unknown.fields()[0].channel, &none_such, sizeof none_such);
  refused(unknown, "smoke: field 0: its channel is unknown");
  State neither = smoke(small, 0);
  neither.fields()[0].dense = nullptr;
  refused(neither, "smoke: field 0: exactly one of dense and sparse must be set");
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, small, 0);
  State twice;
  twice.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}, {0, 8, 8}, {8, 8, 8}});
  EXPECT_EQ(refusal(live, twice.desc(), CUMULET_ERROR_FILE), "smoke: density: has two bricks at (8, 8, 8)");
  State astray;
  astray.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{4, 8, 8}});
  EXPECT_EQ(refusal(live, astray.desc(), CUMULET_ERROR_FILE),
            "smoke: density: its brick origin (4, 8, 8) is not a multiple of 8");
  EXPECT_EQ(cumulet_dynamic_volume_set(nullptr, nullptr, nullptr, 0), CUMULET_ERROR_INVALID_ARGUMENT);
  // No state was submitted.
  EXPECT_EQ(newest(live), nullptr);

  // Partial updates.
  State bricks;
  bricks.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}});
  const auto no_update = [&](const State& state, const char* cause) {
    EXPECT_EQ(refusal(live, state.desc(), CUMULET_ERROR_INVALID_ARGUMENT, cumulet_dynamic_volume_update), cause);
  };
  no_update(bricks, "smoke: there is no state to update");
  hand_over(live, smoke(small, 0));
  no_update(smoke(small, 0), "smoke: density is dense, but an update must consist of bricks");
  no_update(std::move(State().sparse(CUMULET_CHANNEL_FLAME, small, values, {{8, 8, 8}})), "smoke: no flame to update");
  hand_over(live, bricks, cumulet_dynamic_volume_update);

  const ViewerPtr viewer = make();
  auto info = make_desc<cumulet_dynamic_volume_info>();
  EXPECT_EQ(cumulet_get_dynamic_volume_info(viewer.get(), &info), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the viewer shows no dynamic volume");
}

// GPU-built grids of states with and without channels and of changing sizes. Each image equals that of the state alone.
TEST_F(CLiveVolume, StatesMatchWithGpuBuiltGrids) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make(CUMULET_BUILD_GPU);
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  Picture before;
  for (int step = 0; step < 4; ++step) {
    const Sides& size = step == 2 ? odd : small;
    const State state = step % 2 == 1 ? fire(size, step) : smoke(size, step);
    hand_over(live, state);
    const Picture found = picture(viewer.get());
    EXPECT_NE(found, std::exchange(before, found)) << step;
    const ViewerPtr single = make(CUMULET_BUILD_GPU);
    EXPECT_EQ(difference(found, picture_of(single.get(), alone(state).get(), target_)), "") << step;
  }
}

// Odd sizes, and changing sizes and channels. Voxels and image are bit-identical to those of the state alone.
TEST_F(CLiveVolume, StateDoesNotDependOnEarlierStates) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  std::uint64_t number = 0;
  Picture before;
  const auto check = [&](const State& state, const char* what) {
    SCOPED_TRACE(what);
    hand_over(live, state);
    ++number;
    const Picture found = picture(viewer.get());
    EXPECT_NE(found, std::exchange(before, found));
    EXPECT_EQ(difference(found, picture_alone(state)), "");
    expect_same_fields(newest(live), alone(state));
    EXPECT_EQ(info_of(viewer).submitted_update, number);
    EXPECT_EQ(info_of(viewer).displayed_update, number);
  };
  check(smoke(small, 0), "smoke");
  check(smoke(odd, 1), "an odd size");
  check(fire(small, 2), "all channels");
  check(fire(odd, 3), "all channels of an odd size");
  check(std::move(State().dense(CUMULET_CHANNEL_FLAME, small, 4)), "a flame alone");
  State mixed = smoke(small, 5);
  mixed.dense(CUMULET_CHANNEL_TEMPERATURE, {12, 12, 12}, 5);
  check(mixed, "a coarser temperature");
  check(std::move(State().dense(CUMULET_CHANNEL_DENSITY, {1, 1, 1}, std::vector<float>{1.0F})), "a voxel");
  check(std::move(State().dense(CUMULET_CHANNEL_DENSITY, small, std::vector<float>(24 * 24 * 24))), "nothing");
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, odd, 6);
  check(std::move(State().sparse(CUMULET_CHANNEL_DENSITY, odd, values, State::bricks(odd, values))), "bricks");
  check(smoke(small, 7), "smoke again");
}

// Channels correspond to those of VDB files, field by field.
TEST_F(CLiveVolume, ChannelsMatchThoseOfFiles) {
  const VolumeRef volume = alone(fire(small, 0));
  const auto& frame = volume->asset->frame();
  EXPECT_TRUE(frame.temperature && frame.flame && frame.color && frame.anisotropy && frame.velocity);
  EXPECT_EQ(frame.beside_density().size(), 2U + 3U + 2U + 6U);
  const auto values = simulated(CUMULET_CHANNEL_ANISOTROPY, small, 0);
  const auto velocity = simulated(CUMULET_CHANNEL_VELOCITY_Y, small, 0);
  for (int i = 0; i < 24 * 24 * 24; i += 13) {
    const glm::ivec3 p(i % 24, i / 24 % 24, i / 576);
    const float found =
        cumulet::test::value_at((*frame.anisotropy)[0], p) - cumulet::test::value_at((*frame.anisotropy)[1], p);
    EXPECT_EQ(found, std::clamp(values[static_cast<std::size_t>(i)], -1.0F, 1.0F));
    const float up =
        cumulet::test::value_at(frame.velocity->parts[2], p) - cumulet::test::value_at(frame.velocity->parts[3], p);
    EXPECT_EQ(up, velocity[static_cast<std::size_t>(i)]);
  }
}

// Partial updates by bricks, with and without reads between them, on sparse and dense states. The result equals the
// whole state.
TEST_F(CLiveVolume, PartialUpdatesEqualAFullState) {
  for (const bool dense : {true, false}) {
    for (const bool read : {true, false}) {
      SCOPED_TRACE(dense ? "dense" : "bricks");
      const LiveRef live = make_live();
      auto before = simulated(CUMULET_CHANNEL_DENSITY, odd, 0);
      auto heat_before = simulated(CUMULET_CHANNEL_TEMPERATURE, odd, 0);
      const auto whole = [&](const std::vector<float>& density, const std::vector<float>& heat) {
        State state;
        if (dense) {
          state.dense(CUMULET_CHANNEL_DENSITY, odd, density).dense(CUMULET_CHANNEL_TEMPERATURE, odd, heat);
        } else {
          state.sparse(CUMULET_CHANNEL_DENSITY, odd, density, State::bricks(odd, density))
              .sparse(CUMULET_CHANNEL_TEMPERATURE, odd, heat, State::bricks(odd, heat));
        }
        return state;
      };
      hand_over(live, whole(before, heat_before));
      for (int step = 1; step < 6; ++step) {
        if (read) newest(live);
        const auto now = simulated(CUMULET_CHANNEL_DENSITY, odd, step);
        State changes;
        changes.sparse(CUMULET_CHANNEL_DENSITY, odd, now, State::bricks(odd, now, before));
        // Dense states have no active mask.
        if (dense) changes.last_sparse().brick_active = nullptr;
        if (step % 2 == 0) {
          const auto heat = simulated(CUMULET_CHANNEL_TEMPERATURE, odd, step);
          changes.sparse(CUMULET_CHANNEL_TEMPERATURE, odd, heat, State::bricks(odd, heat, heat_before));
          heat_before = heat;
        }
        hand_over(live, changes, cumulet_dynamic_volume_update);
        before = now;
      }
      expect_same_fields(newest(live), alone(whole(before, heat_before)));
      // The image is equal too.
      const ViewerPtr viewer = make();
      ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
      EXPECT_EQ(difference(picture(viewer.get()), picture_alone(whole(before, heat_before))), "");
    }
  }
}

TEST_F(CLiveVolume, RejectedStateKeepsTheLastValidState) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  hand_over(live, smoke(small, 0));
  const Picture good = picture(viewer.get());
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    auto values = simulated(CUMULET_CHANNEL_DENSITY, small, 1);
    values[State::at({3, 20, 11}, small)] = bad;
    State state;
    state.dense(CUMULET_CHANNEL_DENSITY, small, values);
    EXPECT_EQ(refusal(live, state.desc(), CUMULET_ERROR_FILE), "smoke: density: its voxel (3, 20, 11) is not finite");
    State bricks;
    bricks.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}, {0, 16, 8}});
    EXPECT_EQ(refusal(live, bricks.desc(), CUMULET_ERROR_FILE, cumulet_dynamic_volume_update),
              "smoke: density: its voxel (3, 20, 11) is not finite");
  }
  EXPECT_EQ(difference(picture(viewer.get()), good), "");
  EXPECT_EQ(info_of(viewer).submitted_update, 1U);
  // Errors that appear only when the grid is built: the voxels are too far from each other for one volume.
  State far;
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, small, 1);
  far.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}});
  const std::array<std::int32_t, 6> origins{0, 0, 0, 1 << 21, 0, 0};
  std::vector<float> ones(1024, 1.0F);
  far.last_sparse().brick_origins = origins.data();
  far.last_sparse().brick_values = ones.data();
  far.last_sparse().brick_active = nullptr;
  far.last_sparse().brick_count = 2;
  hand_over(live, far);
  EXPECT_EQ(cumulet_wait(viewer.get(), -1.0), CUMULET_ERROR_FILE);
  const std::string line = cumulet_last_error(viewer.get());
  EXPECT_EQ(line.rfind("smoke: density: its active voxels span ", 0), 0U) << line;
  ASSERT_EQ(warnings_.lines.size(), 1U);
  EXPECT_EQ(warnings_.lines[0], line + ": the previous state is kept");
  auto progress = make_desc<cumulet_progress>();
  ASSERT_EQ(cumulet_get_progress(viewer.get(), &progress), CUMULET_OK);
  EXPECT_EQ(progress.volume_message, line);
  auto result = make_desc<cumulet_frame_result>();
  const auto frame = target_.frame();
  target_.clear({0.0F, 0.0F, 0.0F, 0.0F});
  ASSERT_EQ(cumulet_render(viewer.get(), &frame, &result), CUMULET_OK);
  EXPECT_NE(result.flags & CUMULET_RENDER_FAILED, 0U);
  EXPECT_EQ(difference(target_.pixels(), good), "");
  EXPECT_EQ(info_of(viewer).displayed_update, 1U);
  // It cannot be updated; the next whole state works.
  State bricks;
  bricks.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}});
  EXPECT_EQ(refusal(live, bricks.desc(), CUMULET_ERROR_INVALID_ARGUMENT, cumulet_dynamic_volume_update),
            "smoke: there is no state to update");
  hand_over(live, smoke(small, 1));
  EXPECT_EQ(difference(picture(viewer.get()), picture_alone(smoke(small, 1))), "");
}

TEST_F(CLiveVolume, ViewersMayBeDestroyedDuringUpdates) {
  const LiveRef live = make_live();
  std::atomic<bool> stop = false;
  std::thread host([&] {
    const State state = smoke(small, 0);
    while (!stop) hand_over(live, state);
  });
  for (int i = 0; i < 30; ++i) {
    const ViewerPtr viewer = make();
    EXPECT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
    std::this_thread::sleep_for(std::chrono::milliseconds(i % 5));
  }
  stop = true;
  host.join();
}

// A host submits states much faster than they are built and drawn. States are displayed in order, each built state is
// displayed, and so is the last one.
TEST_F(CLiveVolume, NewestStateIsShownAndNoViewerStarves) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  std::vector<State> states;
  states.reserve(8);
  for (int step = 0; step < 8; ++step) states.push_back(smoke(small, step));
  hand_over(live, states[0]);
  show(viewer, 1);  // programs are compiled

  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> handed = 1;
  std::thread host([&] {
    for (std::size_t i = 1; !stop; ++i) {
      hand_over(live, states[i % states.size()]);
      ++handed;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  });
  const auto frame = target_.frame();
  std::vector<std::uint64_t> seen;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (seen.size() < 12 && std::chrono::steady_clock::now() < until) {
    EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK);
    const cumulet_dynamic_volume_info info = info_of(viewer);
    if (seen.empty() || seen.back() != info.displayed_update) seen.push_back(info.displayed_update);
    EXPECT_LE(info.ready_count - info.displayed_count, 1U);
  }
  stop = true;
  host.join();
  EXPECT_GE(seen.size(), 12U);
  EXPECT_TRUE(std::ranges::is_sorted(seen));
  const auto last = show(viewer, handed);
  EXPECT_TRUE(std::ranges::is_sorted(last));
  const cumulet_dynamic_volume_info info = info_of(viewer);
  EXPECT_EQ(info.displayed_count, info.ready_count);
  EXPECT_EQ(info.submitted_update, handed);
  // The final image is that of the last state.
  sampling.preview = CUMULET_PREVIEW_OFF;
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), picture_alone(states[(handed - 1) % states.size()])), "");
}

// At a slower rate, each state is displayed.
TEST_F(CLiveVolume, EachStateIsShownIfThereIsTime) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  auto sampling = make_desc<cumulet_sampling_desc>();
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  for (std::uint64_t state = 1; state < 8; ++state) {
    hand_over(live, smoke(odd, static_cast<int>(state)));
    show(viewer, state);
    EXPECT_EQ(info_of(viewer).displayed_count, state);
  }
}

InstanceRef stand(const ViewerPtr& viewer, const std::variant<cumulet_volume*, cumulet_dynamic_volume*>& of, double x) {
  auto desc = make_desc<cumulet_instance_desc>();
  if (of.index() == 0) {
    desc.volume = std::get<0>(of);
  } else {
    desc.dynamic_volume = std::get<1>(of);
  }
  std::ranges::copy(at(x, 0, 0), desc.to_world);
  InstanceRef made = cumulet::test::make_instance(desc);
  EXPECT_EQ(cumulet_add_instance(viewer.get(), made.get()), CUMULET_OK) << cumulet_last_error(viewer.get());
  return made;
}

cumulet_dynamic_volume_info told_of(const ViewerPtr& viewer, const InstanceRef& instance) {
  auto info = make_desc<cumulet_dynamic_volume_info>();
  EXPECT_EQ(cumulet_get_instance_dynamic_volume_info(viewer.get(), instance.get(), &info), CUMULET_OK)
      << cumulet_last_error(viewer.get());
  return info;
}

// Instances of a dynamic volume look like instances of the state's own volume, beside the viewer's own dynamic volume.
TEST_F(CLiveVolume, InstancesShowItsNewestState) {
  const LiveRef live = make_live();
  const LiveRef own = make_live();
  const ViewerPtr viewer = make();
  hand_over(own, smoke(small, 5));
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), own.get()), CUMULET_OK);
  const InstanceRef left = stand(viewer, live.get(), -20.0);
  const InstanceRef right = stand(viewer, live.get(), 30.0);
  EXPECT_EQ(told_of(viewer, left).ready_update, 0U);
  for (std::uint64_t number = 1; number < 4; ++number) {
    SCOPED_TRACE(number);
    const State state = fire(odd, static_cast<int>(number));
    hand_over(live, state);
    const Picture shown = picture(viewer.get());
    for (const InstanceRef* instance : {&left, &right}) {
      const cumulet_dynamic_volume_info info = told_of(viewer, *instance);
      EXPECT_EQ(info.submitted_update, number);
      EXPECT_EQ(info.displayed_update, number);
      EXPECT_EQ(info.displayed_count, number) << "one grid for both";
    }
    const ViewerPtr other = make();
    const VolumeRef beside = alone(smoke(small, 5));
    ASSERT_EQ(cumulet_set_volume(other.get(), beside.get()), CUMULET_OK);
    const VolumeRef volume = alone(state);
    const InstanceRef a = stand(other, volume.get(), -20.0);
    const InstanceRef b = stand(other, volume.get(), 30.0);
    EXPECT_EQ(difference(shown, picture(other.get())), "");
  }
  // After it was hidden, an instance shows the newest state.
  auto hidden = make_desc<cumulet_instance_desc>();
  hidden.dynamic_volume = live.get();
  std::ranges::copy(at(-20, 0, 0), hidden.to_world);
  hidden.hidden = 1;
  const Picture both = picture(viewer.get());
  ASSERT_EQ(cumulet_instance_set(left.get(), &hidden), CUMULET_OK);
  EXPECT_NE(difference(both, picture(viewer.get())), "");
  hidden.hidden = 0;
  ASSERT_EQ(cumulet_instance_set(left.get(), &hidden), CUMULET_OK);
  EXPECT_EQ(difference(both, picture(viewer.get())), "");
}

TEST_F(CLiveVolume, InvalidInstancesGiveAOneLineError) {
  const LiveRef live = make_live();
  hand_over(live, smoke(small, 1));
  const ViewerPtr viewer = make();
  auto desc = make_desc<cumulet_instance_desc>();
  const VolumeRef volume = alone(smoke(small, 1));
  desc.volume = volume.get();
  desc.dynamic_volume = live.get();
  std::array<char, 256> error{};
  cumulet_instance* out = nullptr;
  EXPECT_EQ(cumulet_instance_create(&desc, &out, error.data(), error.size()), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(error.data(), "cumulet_instance_desc has more than one of volume, sequence and dynamic_volume");
  const InstanceRef still = stand(viewer, volume.get(), 0.0);
  auto info = make_desc<cumulet_dynamic_volume_info>();
  EXPECT_EQ(cumulet_get_instance_dynamic_volume_info(viewer.get(), still.get(), &info), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the instance shows no dynamic volume");
  ASSERT_EQ(cumulet_remove_instance(viewer.get(), still.get()), CUMULET_OK);
  EXPECT_EQ(cumulet_get_instance_dynamic_volume_info(viewer.get(), still.get(), &info), CUMULET_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(cumulet_last_error(viewer.get()), "the instance is not in the viewer");
}

// States change quickly while the instance is added and removed. Each state that the instance builds is displayed, and
// the newest last.
TEST_F(CLiveVolume, InstanceShowsStatesDuringFastUpdates) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  auto sampling = make_desc<cumulet_sampling_desc>();
  sampling.samples = 2;
  ASSERT_EQ(cumulet_set_sampling(viewer.get(), &sampling), CUMULET_OK);
  InstanceRef instance = stand(viewer, live.get(), 0.0);
  std::atomic<bool> stop = false;
  std::thread host([&] {
    for (int i = 0; !stop; ++i) {
      hand_over(live, smoke(small, i % 8));
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
  });
  const auto frame = target_.frame();
  for (int round = 0; round < 3; ++round) {
    std::vector<std::uint64_t> seen;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (seen.size() < 4 && std::chrono::steady_clock::now() < until) {
      EXPECT_EQ(cumulet_render(viewer.get(), &frame, nullptr), CUMULET_OK) << cumulet_last_error(viewer.get());
      const cumulet_dynamic_volume_info info = told_of(viewer, instance);
      if (seen.empty() || seen.back() != info.displayed_update) seen.push_back(info.displayed_update);
      EXPECT_LE(info.ready_count - info.displayed_count, 1U);
    }
    EXPECT_GE(seen.size(), 4U);
    EXPECT_TRUE(std::ranges::is_sorted(seen));
    ASSERT_EQ(cumulet_remove_instance(viewer.get(), instance.get()), CUMULET_OK);
    instance = stand(viewer, live.get(), round);
  }
  stop = true;
  host.join();
  picture(viewer.get());
  const cumulet_dynamic_volume_info info = told_of(viewer, instance);
  EXPECT_EQ(info.displayed_update, info.submitted_update);
}

TEST_F(CLiveVolume, WorksWithSeveralViewersAndThreads) {
  const LiveRef live = make_live();
  const ViewerPtr first = make();
  const ViewerPtr second = make();
  ASSERT_EQ(cumulet_set_dynamic_volume(first.get(), live.get()), CUMULET_OK);
  ASSERT_EQ(cumulet_set_dynamic_volume(second.get(), live.get()), CUMULET_OK);
  const State whole = smoke(small, 0);
  const auto values = simulated(CUMULET_CHANNEL_DENSITY, small, 5);
  State bricks;
  bricks.sparse(CUMULET_CHANNEL_DENSITY, small, values, {{8, 8, 8}, {16, 8, 8}});
  std::atomic<bool> stop = false;
  const auto hands_over = [&](const State& state, HandOver how) {
    const cumulet_volume_fields_desc desc = state.desc();
    while (!stop) {
      how(live.get(), &desc, nullptr, 0);  // partial updates may precede the first state
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  std::thread a(hands_over, std::cref(whole), cumulet_dynamic_volume_set);
  std::thread b(hands_over, std::cref(bricks), cumulet_dynamic_volume_update);
  std::thread c([&] {
    while (!stop) {
      newest(live);
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
  });
  const auto frame = target_.frame();
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(cumulet_render(first.get(), &frame, nullptr), CUMULET_OK);
    EXPECT_EQ(cumulet_render(second.get(), &frame, nullptr), CUMULET_OK);
    if (i % 10 == 9) cumulet_cancel(second.get());
  }
  stop = true;
  a.join();
  b.join();
  c.join();
  hand_over(live, smoke(small, 3));
  const Picture wanted = picture_alone(smoke(small, 3));
  EXPECT_EQ(difference(picture(first.get()), wanted), "");
  EXPECT_EQ(difference(picture(second.get()), wanted), "");
  EXPECT_EQ(info_of(second).displayed_update, info_of(second).submitted_update);
}

TEST_F(CLiveVolume, VolumeAndLiveVolumeReplaceEachOther) {
  const ViewerPtr viewer = make();
  LiveRef live = make_live();
  const VolumeRef ball = make_ball(20);
  const Picture of_ball = picture_of(viewer.get(), ball.get(), target_);
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  // The previous volume stays until the first state arrives.
  EXPECT_EQ(difference(picture(viewer.get()), of_ball), "");
  hand_over(live, smoke(small, 1));
  const Picture of_smoke = picture_alone(smoke(small, 1));
  EXPECT_EQ(difference(picture(viewer.get()), of_smoke), "");
  cumulet_volume* shown = nullptr;
  ASSERT_EQ(cumulet_get_volume(viewer.get(), &shown), CUMULET_OK);
  expect_same_fields(VolumeRef(shown), newest(live));
  ASSERT_EQ(cumulet_set_volume(viewer.get(), ball.get()), CUMULET_OK);
  hand_over(live, smoke(small, 2));
  EXPECT_EQ(difference(picture(viewer.get()), of_ball), "");
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  EXPECT_EQ(difference(picture(viewer.get()), picture_alone(smoke(small, 2))), "");
  live.reset();  // the viewer keeps a reference
  EXPECT_EQ(difference(picture(viewer.get()), picture_alone(smoke(small, 2))), "");
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), nullptr), CUMULET_OK);
  double box[6];
  EXPECT_EQ(cumulet_get_bounds(viewer.get(), box, box + 3), CUMULET_ERROR_INVALID_ARGUMENT);
}

TEST_F(CLiveVolume, ChangedSettingsApplyToTheNewestState) {
  const LiveRef live = make_live();
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  hand_over(live, fire(small, 1));
  picture(viewer.get());
  auto grid = make_desc<cumulet_grid_desc>();
  grid.threshold = 0.02;
  grid.cells = CUMULET_CELLS_CONSTANT;
  for (int i = 0; i < 3; ++i) {
    if (i == 1) grid.camera_adaptive = 1;  // camera-adaptive grids need a camera
    if (i == 2) grid.type = CUMULET_GRID_BRICKS;
    ASSERT_EQ(cumulet_set_grid(viewer.get(), &grid), CUMULET_OK);
    hand_over(live, fire(small, 2 + i));
    const Picture found = picture(viewer.get());
    const ViewerPtr single = make();
    ASSERT_EQ(cumulet_set_grid(single.get(), &grid), CUMULET_OK);
    EXPECT_EQ(difference(found, picture_of(single.get(), alone(fire(small, 2 + i)).get(), target_)), "") << i;
  }
}

// Fitted cameras and the ground plane use the declared bounds, not those of the current state.
TEST_F(CLiveVolume, CameraAndGroundUseTheDeclaredBounds) {
  auto desc = make_desc<cumulet_dynamic_volume_desc>();
  for (double& x : desc.bounds_min) x = -8.0;
  for (double& x : desc.bounds_max) x = 8.0;
  const LiveRef live = make_live(desc);
  const ViewerPtr viewer = make();
  ASSERT_EQ(cumulet_set_dynamic_volume(viewer.get(), live.get()), CUMULET_OK);
  for (const int step : {0, 4}) {
    hand_over(live, smoke(small, step));
    picture(viewer.get());
    double box[6];
    ASSERT_EQ(cumulet_get_bounds(viewer.get(), box, box + 3), CUMULET_OK);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(box[axis], -8.0, 1e-9);
      EXPECT_NEAR(box[3 + axis], 8.0, 1e-9);
    }
  }
}

}  // namespace
