// Time until a deadline.

#include "base/milliseconds.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace {

using namespace cumulet;
using Clock = std::chrono::steady_clock;

// UndefinedBehaviorSanitizer found an overflow at the clock's minimum, which means that there is no time.
TEST(Milliseconds, UntilTheEndsOfTheClock) {
  EXPECT_LT(milliseconds_until(Clock::time_point::min()), -1e12);
  EXPECT_GT(milliseconds_until(Clock::time_point::max()), 1e12);
}

TEST(Milliseconds, UntilADeadline) {
  EXPECT_LE(milliseconds_until(deadline_after(0.0)), 0.0);
  const double left = milliseconds_until(deadline_after(1e6));
  EXPECT_LE(left, 1e6);
  EXPECT_GT(left, 0.9e6);
}

}  // namespace
