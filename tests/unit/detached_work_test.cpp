// run_cancellable() and run_detached(): calls on detached threads, which cannot be interrupted.

#include "base/detached_work.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <latch>
#include <memory>
#include <thread>

#include "base/error.hpp"

namespace {

using namespace cumulet;

TEST(DetachedWork, ReturnsTheResult) {
  Progress progress;
  const auto here = std::this_thread::get_id();
  EXPECT_NE(run_cancellable(&progress, [] { return std::this_thread::get_id(); }), here);
  EXPECT_EQ(run_cancellable(nullptr, [] { return std::this_thread::get_id(); }), here);
  EXPECT_EQ(*run_cancellable(&progress, [n = std::make_unique<int>(7)] { return std::make_unique<int>(*n + 1); }), 8);
  try {
    run_cancellable(&progress, []() -> int { throw Error(ErrorCode::file, "no such thing"); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::file);
    EXPECT_STREQ(error.what(), "no such thing");
  }
}

TEST(DetachedWork, CancelledCallerDoesNotWait) {
  Progress progress;
  std::latch begun(1);
  std::latch seen(1);
  std::atomic<bool> freed = false;
  std::thread canceller([&] {
    begun.wait();
    progress.cancel();
  });
  bool cancelled = false;
  try {
    // The call ends only after run_cancellable() has returned. If it waited for it, the test would hang.
    run_cancellable(&progress, [&begun, &seen, owned = std::shared_ptr<int>(new int(0), [&freed](const int* last) {
                                                 delete last;
                                                 freed = true;
                                               })] {
      begun.count_down();
      seen.wait();
      return *owned;
    });
  } catch (const Error& error) {
    cancelled = error.code() == ErrorCode::cancelled;
  }
  EXPECT_TRUE(cancelled);
  EXPECT_FALSE(freed);  // owned by the call, which is still running
  seen.count_down();
  while (!freed) std::this_thread::yield();
  canceller.join();
}

TEST(DetachedWork, DoesNotStartIfCancelled) {
  Progress progress;
  progress.cancel();
  EXPECT_THROW(run_cancellable(&progress,
                               [] {
                                 ADD_FAILURE();
                                 return 0;
                               }),
               Error);
}

TEST(DetachedWork, DataIsFreedOnAnotherThread) {
  struct Tree {
    explicit Tree(std::atomic<std::thread::id>& to) : by(to) {}
    ~Tree() { by = std::this_thread::get_id(); }
    std::atomic<std::thread::id>& by;
  };
  std::atomic<std::thread::id> by;
  make_deferred_delete<Tree>(by).reset();
  while (by.load() == std::thread::id()) std::this_thread::yield();
  EXPECT_NE(by.load(), std::this_thread::get_id());
}

TEST(DetachedWork, ExcessWorkRunsOnTheCallersThread) {
  std::latch open(1);
  std::atomic<int> done = 0;
  int at_once = 0;
  int left = 0;
  for (; at_once == 0 && left < 1000; ++left) {
    const auto here = std::this_thread::get_id();
    auto on_this_thread = std::make_shared<std::atomic<bool>>(false);
    run_detached([&open, &done, on_this_thread, here] {
      if (std::this_thread::get_id() == here) {
        *on_this_thread = true;
      } else {
        open.wait();
      }
      ++done;
    });
    if (*on_this_thread) ++at_once;
  }
  EXPECT_EQ(at_once, 1);
  EXPECT_GT(left, 2);
  open.count_down();
  while (done < left) std::this_thread::yield();
}

// The detached work starts more detached work while the process exits.
TEST(DetachedWorkDeathTest, ExitWaitsForNestedDetachedWork) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto left_and_exit = [] {
    for (int i = 0; i < 12; ++i) {
      run_detached([i] {
        std::this_thread::sleep_for(std::chrono::microseconds(100 * i));
        for (int k = 0; k < 20; ++k) run_detached([] { std::this_thread::sleep_for(std::chrono::microseconds(50)); });
      });
    }
    std::exit(0);
  };
  for (int i = 0; i < 5; ++i) EXPECT_EXIT(left_and_exit(), testing::ExitedWithCode(0), "");
}

}  // namespace
