#include "render/pacing/schedule.hpp"

#include <gtest/gtest.h>

#include <array>
#include <functional>

namespace {

using cumulet::render::Schedule;
using cumulet::render::Stillness;
using State = Schedule::State;

Schedule in(State state) {
  Schedule schedule;
  if (state == State::idle) return schedule;
  schedule.change(false);
  if (state == State::due) return schedule;
  if (state == State::failed) {
    schedule.fail();
    return schedule;
  }
  schedule.begin();
  if (state == State::overtaken) schedule.change(true);
  if (state == State::refining || state == State::done) schedule.complete();
  if (state == State::done) schedule.finish();
  return schedule;
}

// The complete table of schedule.hpp.
TEST(SamplingSchedule, FollowsItsTransitionTable) {
  struct Row {
    State from;
    State change;
    State change_that_keeps;
    State begun;
    State complete;
    State finished;
    State extended;
    State dropped;
    State failed;
  };
  using enum Schedule::State;
  const std::array<Row, 7> table{{
      {idle, due, due, idle, idle, idle, idle, idle, idle},
      {due, due, due, answering, due, due, due, due, failed},
      {answering, due, overtaken, answering, refining, answering, answering, due, failed},
      {overtaken, due, overtaken, overtaken, due, overtaken, overtaken, due, failed},
      {refining, due, due, refining, refining, done, refining, due, failed},
      {done, due, due, done, done, done, refining, due, failed},
      {failed, due, due, failed, failed, failed, failed, failed, failed},
  }};
  const auto after = [](State from, const std::function<void(Schedule&)>& what) {
    Schedule schedule = in(from);
    what(schedule);
    return schedule.state();
  };
  for (const Row& row : table) {
    SCOPED_TRACE(static_cast<int>(row.from));
    ASSERT_EQ(in(row.from).state(), row.from);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.change(false); }), row.change);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.change(true); }), row.change_that_keeps);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.begin(); }), row.begun);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.complete(); }), row.complete);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.finish(); }), row.finished);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.extend(); }), row.extended);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.drop(); }), row.dropped);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.fail(); }), row.failed);
    EXPECT_EQ(after(row.from, [](Schedule& s) { s.reset(); }), idle);
  }
}

TEST(CameraRestDetection, IsFasterWithoutAHeldButton) {
  using std::chrono::milliseconds;
  const Stillness::Clock::time_point start{};
  Stillness still;
  still.see(true, false, start);
  EXPECT_FALSE(still.rests(start + milliseconds(90)));
  EXPECT_TRUE(still.rests(start + milliseconds(110)));
  Stillness held;
  held.see(true, true, start);
  EXPECT_FALSE(held.rests(start + milliseconds(290)));
  EXPECT_TRUE(held.rests(start + milliseconds(310)));
}

TEST(CameraRestDetection, IsImmediateOnButtonRelease) {
  const Stillness::Clock::time_point start{};
  Stillness still;
  still.see(true, true, start);
  still.see(false, false, start);
  EXPECT_TRUE(still.rests(start));
  still.see(false, false, start);
  EXPECT_TRUE(still.rests(start));
  still.see(true, false, start);  // changed by something else than the user
  EXPECT_FALSE(still.rests(start));
  still.see(true, true, start);
  still.see(true, false, start);  // released with the last change
  EXPECT_TRUE(still.rests(start));
}

}  // namespace
