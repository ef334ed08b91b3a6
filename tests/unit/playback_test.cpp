// Maps clock times to frames of a sequence, and orders the next ones.

#include "scene/playback.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using cumulet::scene::Between;
using cumulet::scene::frame_of;
using cumulet::scene::Moment;
using cumulet::scene::moment_at;
using cumulet::scene::Playback;
using cumulet::scene::Repeat;
using cumulet::scene::step_of;
using cumulet::scene::time_of;
using cumulet::scene::upcoming;
using Frames = std::vector<std::uint32_t>;

std::uint32_t frame_at(const Playback& playback, double seconds) {
  return frame_of(playback, moment_at(playback, seconds));
}

// The frames of the next `count` frame durations, from the clock's frame `from` on.
Frames played(const Playback& playback, int from, int count) {
  Frames frames;
  for (int i = from; i < from + count; ++i)
    frames.push_back(frame_at(playback, playback.offset_seconds + i / playback.frames_per_second));
  return frames;
}

TEST(Playback, HoldClampsAtBothEnds) {
  const Playback hold{.first = 3, .count = 4};
  EXPECT_EQ(played(hold, -2, 9), (Frames{3, 3, 3, 4, 5, 6, 6, 6, 6}));
}

TEST(Playback, LoopWrapsAtBothEnds) {
  const Playback loop{.repeat = Repeat::loop, .first = 3, .count = 4};
  EXPECT_EQ(played(loop, -3, 10), (Frames{4, 5, 6, 3, 4, 5, 6, 3, 4, 5}));
}

TEST(Playback, PingPongDoesNotRepeatTheEnds) {
  const Playback back{.repeat = Repeat::ping_pong, .first = 3, .count = 4};
  EXPECT_EQ(played(back, -3, 14), (Frames{6, 5, 4, 3, 4, 5, 6, 5, 4, 3, 4, 5, 6, 5}));
}

TEST(Playback, SingleFrameIsAlwaysShown) {
  for (const Repeat repeat : {Repeat::hold, Repeat::loop, Repeat::ping_pong})
    EXPECT_EQ(played({.repeat = repeat, .first = 2, .count = 1}, -3, 7), Frames(7, 2));
}

// Each frame is displayed for a whole frame duration in both directions.
TEST(Playback, FramesHaveEqualDuration) {
  for (const Repeat repeat : {Repeat::loop, Repeat::ping_pong}) {
    const Playback playback{.frames_per_second = 10.0, .repeat = repeat, .count = 5};
    for (int i = 0; i < 40; ++i) {
      const auto frame = frame_at(playback, i / 10.0);
      for (const double part : {0.01, 0.5, 0.99})
        EXPECT_EQ(frame_at(playback, (i + part) / 10.0), frame) << i << " and " << part;
    }
  }
}

TEST(Playback, FrameTimeRoundTrips) {
  for (const double rate : {23.976, 24.0, 25.0, 29.97, 60.0, 1000.0 / 3.0}) {
    const Playback playback{.frames_per_second = rate, .offset_seconds = 1.0 / 3.0, .first = 7, .count = 5000};
    for (std::uint32_t frame = 7; frame < 5007; ++frame)
      ASSERT_EQ(frame_at(playback, time_of(playback, frame)), frame) << rate;
  }
}

TEST(Playback, SubframesAreFractionalPositions) {
  const Playback playback{.frames_per_second = 10.0, .offset_seconds = 2.0, .repeat = Repeat::ping_pong, .count = 5};
  EXPECT_NEAR(moment_at(playback, 2.125).position, 1.25, 1e-9);
  EXPECT_NEAR(moment_at(playback, 2.525).position, 2.75, 1e-9);  // on the way back
  EXPECT_FALSE(moment_at(playback, 2.525).forward);
  EXPECT_EQ(frame_at(playback, 2.525), 3U);
}

TEST(Playback, DistantTimesMapToAFrame) {
  for (const Repeat repeat : {Repeat::hold, Repeat::loop, Repeat::ping_pong}) {
    const Playback playback{.repeat = repeat, .first = 2, .count = 5};
    for (const double seconds : {-1e15, -1e-18, 1e15, 1e300, -1e300}) {
      const auto frame = frame_at(playback, seconds);
      EXPECT_GE(frame, 2U);
      EXPECT_LE(frame, 6U);
    }
  }
}

TEST(Upcoming, FollowThePlaybackOrder) {
  Playback playback{.repeat = Repeat::hold, .first = 2, .count = 5};
  EXPECT_EQ(upcoming(playback, {4.0, true}, true), (Frames{4, 5, 6, 3, 2}));
  EXPECT_EQ(upcoming(playback, {4.0, true}, false), (Frames{4, 3, 2, 5, 6}));
  playback.repeat = Repeat::loop;
  EXPECT_EQ(upcoming(playback, {4.0, true}, true), (Frames{4, 5, 6, 2, 3}));
  EXPECT_EQ(upcoming(playback, {4.0, true}, false), (Frames{4, 3, 2, 6, 5}));
  playback.repeat = Repeat::ping_pong;
  EXPECT_EQ(upcoming(playback, {4.0, true}, true), (Frames{4, 5, 6, 3, 2}));
  EXPECT_EQ(upcoming(playback, {4.0, false}, true), (Frames{4, 3, 2, 5, 6}));
}

TEST(Upcoming, ContinueIntoTheRangeFromOutside) {
  const Playback playback{.repeat = Repeat::loop, .first = 2, .count = 3};
  EXPECT_EQ(upcoming(playback, {0.0, true}, true), (Frames{0, 2, 3, 4}));
  EXPECT_EQ(upcoming(playback, {5.0, true}, true), (Frames{5, 4, 2, 3}));
}

TEST(Upcoming, ContainEachPlayedFrameOnce) {
  for (const Repeat repeat : {Repeat::hold, Repeat::loop, Repeat::ping_pong}) {
    for (std::uint32_t now = 3; now < 7; ++now) {
      for (const bool forward : {false, true}) {
        const Playback playback{.repeat = repeat, .first = 3, .count = 4};
        Frames order = upcoming(playback, {double(now), true}, forward);
        EXPECT_EQ(order.front(), now);
        std::ranges::sort(order);
        EXPECT_EQ(order, (Frames{3, 4, 5, 6}));
      }
    }
  }
}

TEST(Playback, StepsBetweenFramesComeInTheirOrder) {
  const Playback hold{.first = 2, .count = 3, .between = Between::blend, .steps = 4};
  const auto at = [&](const Playback& playback, double frames) {
    return step_of(playback, moment_at(playback, frames / playback.frames_per_second));
  };
  EXPECT_EQ(at(hold, -1.0), 8U);
  EXPECT_EQ(at(hold, 0.0), 8U);
  EXPECT_EQ(at(hold, 0.24), 8U);
  EXPECT_EQ(at(hold, 0.25), 9U);
  EXPECT_EQ(at(hold, 1.99), 15U);
  EXPECT_EQ(at(hold, 5.0), 16U);
  EXPECT_EQ(upcoming(hold, moment_at(hold, 1.5 / 24.0), true), (Frames{14, 15, 16, 13, 12, 11, 10, 9, 8}));
  EXPECT_EQ(upcoming(hold, moment_at(hold, 1.5 / 24.0), false), (Frames{14, 13, 12, 11, 10, 9, 8, 15, 16}));
  // On the way back, each step lasts until the next one.
  Playback back = hold;
  back.repeat = Repeat::ping_pong;
  EXPECT_EQ(at(back, 2.25), 15U);
  EXPECT_EQ(at(back, 2.3), 15U);
  EXPECT_EQ(frame_of(back, moment_at(back, 2.3 / 24.0)), 3U) << "as the step that is shown";
  // There is no interpolation from the last frame of a loop to the first.
  Playback loop = hold;
  loop.repeat = Repeat::loop;
  EXPECT_EQ(at(loop, 2.0), 16U);
  EXPECT_EQ(at(loop, 2.75), 16U);
  EXPECT_EQ(at(loop, 3.0), 8U);
  // Each fraction of a frame maps to its own step.
  for (const std::uint32_t steps : {3U, 7U, 10U, 1000U}) {
    Playback fine{.count = 20, .between = Between::advect, .steps = steps};
    for (std::uint32_t step = 0; step < 19 * steps; ++step)
      ASSERT_EQ(step_of(fine, {static_cast<double>(step) / steps, true}), step) << steps;
  }
}

}  // namespace
