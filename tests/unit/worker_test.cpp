// The worker thread of loads, builds and poses.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "jobs/worker.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::Progress;
using cumulet::viewer::Worker;
using Stage = Progress::Stage;

class WorkerTest : public testing::Test {
 protected:
  /// Runs until it is released or cancelled. If released, records its name.
  Worker::Job job(const std::string& name) {
    return {name, Stage::refining, [this, name](Progress& progress) {
              started_ = true;
              started_.notify_all();
              while (!let_go_) progress.check();
              const std::scoped_lock lock(mutex_);
              progress.check();
              done_.push_back(name);
            }};
  }
  void begin(const std::string& name) {
    worker_.post(job(name));
    started_.wait(false);
  }
  std::vector<std::string> done() {
    let_go_ = true;
    EXPECT_TRUE(worker_.wait(std::nullopt));
    return done_;
  }

  std::atomic<bool> started_ = false;
  std::atomic<bool> let_go_ = false;
  std::atomic<int> notified_ = 0;
  std::mutex mutex_;
  std::vector<std::string> done_;
  Worker worker_{[this] { ++notified_; }};
};

TEST_F(WorkerTest, OnlyTheNewestPendingJobRuns) {
  begin("first");
  worker_.post(job("second"));
  worker_.post(job("third"));
  EXPECT_EQ(done(), (std::vector<std::string>{"first", "third"}));
  EXPECT_FALSE(worker_.status().failure);
}

TEST_F(WorkerTest, ReplacingCancelsTheRunningJobSilently) {
  begin("first");
  worker_.replace(job("second"));
  EXPECT_EQ(done(), (std::vector<std::string>{"second"}));
  EXPECT_FALSE(worker_.status().failure);
}

// For any rate of requests, at least every second job is finished.
TEST_F(WorkerTest, EverySecondJobFinishes) {
  begin("first");
  started_ = false;
  worker_.replace(job("second"));  // this cancels "first"
  started_.wait(false);
  worker_.replace(job("third"));
  worker_.replace(job("fourth"));
  EXPECT_EQ(done(), (std::vector<std::string>{"second", "fourth"}));
  EXPECT_FALSE(worker_.status().failure);
  // After a finished job, the next one may be replaced again.
  let_go_ = false;
  started_ = false;
  done_.clear();
  begin("fifth");
  worker_.replace(job("sixth"));
  EXPECT_EQ(done(), (std::vector<std::string>{"sixth"}));
  // A job cancelled by cancel() does not count as replaced.
  let_go_ = false;
  started_ = false;
  done_.clear();
  begin("seventh");
  worker_.cancel();
  EXPECT_TRUE(worker_.wait(std::nullopt));
  started_ = false;
  begin("eighth");
  worker_.replace(job("ninth"));
  EXPECT_EQ(done(), (std::vector<std::string>{"ninth"}));
}

TEST_F(WorkerTest, CancelLoadsCancelsOnlyLoads) {
  begin("first");
  Worker::Job load = job("second");
  load.load = true;
  worker_.post(load);
  worker_.cancel_loads();
  ASSERT_TRUE(worker_.status().failure);
  EXPECT_EQ(worker_.status().failure->code(), ErrorCode::cancelled);
  EXPECT_EQ(done(), (std::vector<std::string>{"first"}));
  let_go_ = false;
  started_ = false;
  done_.clear();
  worker_.post(load);
  started_.wait(false);
  worker_.cancel_loads();
  EXPECT_TRUE(worker_.wait(std::nullopt));
  EXPECT_TRUE(done_.empty());
}

TEST_F(WorkerTest, CancelEndsRunningAndPendingJobs) {
  begin("first");
  worker_.post(job("second"));
  worker_.cancel();
  EXPECT_TRUE(worker_.wait(std::nullopt));
  EXPECT_TRUE(done_.empty());
  ASSERT_TRUE(worker_.status().failure);
  EXPECT_EQ(worker_.status().failure->code(), ErrorCode::cancelled);
  // A new request clears the failure.
  worker_.post(job("third"));
  EXPECT_FALSE(worker_.status().failure);
  EXPECT_EQ(done(), (std::vector<std::string>{"third"}));
}

TEST_F(WorkerTest, WaitingEndsIfNobodyNeedsTheResult) {
  begin("first");
  std::thread waiting([&] { EXPECT_TRUE(worker_.wait(std::nullopt)); });
  worker_.set_awaited(false);
  waiting.join();
  EXPECT_TRUE(worker_.busy());
  worker_.set_awaited(true);
  EXPECT_FALSE(worker_.wait(std::chrono::steady_clock::now()));
  EXPECT_EQ(done(), (std::vector<std::string>{"first"}));
}

TEST_F(WorkerTest, ReportsStageFailureAndEnd) {
  EXPECT_EQ(worker_.status().stage, Stage::idle);
  EXPECT_FALSE(worker_.busy());
  begin("first");
  EXPECT_TRUE(worker_.busy());
  EXPECT_EQ(worker_.status().stage, Stage::refining);
  EXPECT_FALSE(worker_.wait(std::chrono::steady_clock::now() + std::chrono::milliseconds(5)));
  EXPECT_EQ(done().size(), 1U);
  EXPECT_EQ(worker_.status().stage, Stage::idle);

  const auto failure = [this](void (*fail)()) {
    worker_.post({"cloud.vdb", Stage::loading, [fail](Progress&) { fail(); }});
    worker_.wait(std::nullopt);
    return worker_.status().failure.value_or(Error(ErrorCode::internal, "none"));
  };
  EXPECT_EQ(failure([] { throw Error(ErrorCode::file, "no such file"); }).code(), ErrorCode::file);
  EXPECT_EQ(failure([] { throw std::bad_alloc(); }).code(), ErrorCode::out_of_memory);
  EXPECT_STREQ(failure([] { throw std::bad_alloc(); }).what(), "cloud.vdb: out of memory");
  EXPECT_EQ(failure([] { throw std::runtime_error("?"); }).code(), ErrorCode::internal);
}

TEST_F(WorkerTest, DestructorCancels) {
  {
    Worker worker([this] { ++notified_; });
    worker.post({"one", Stage::loading, [](Progress&) {}});
    worker.wait(std::nullopt);
    worker.post({"two", Stage::loading, [](Progress& progress) {
                   for (;;) progress.check();
                 }});
    while (worker.status().stage != Stage::loading) {
    }
  }
  EXPECT_GE(notified_, 1);
  EXPECT_LE(notified_, 2);  // the second may not have started when the worker was destroyed
}

}  // namespace
