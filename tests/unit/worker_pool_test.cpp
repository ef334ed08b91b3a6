// The threads that workers share.
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "jobs/worker.hpp"

namespace {

using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::Progress;
using cumulet::viewer::Worker;
using cumulet::viewer::WorkerPool;

Worker::Job job(std::function<void(Progress&)> work) { return {"job", Progress::Stage::refining, std::move(work)}; }

// Counts how many jobs run at a time.
struct Counted {
  std::atomic<int> now = 0;
  std::atomic<int> most = 0;

  void run() {
    const int running = ++now;
    int before = most;
    while (before < running && !most.compare_exchange_weak(before, running)) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    --now;
  }
};

TEST(WorkerPoolTest, ManyWorkersRunOnFewThreads) {
  const auto pool = std::make_shared<WorkerPool>(3);
  Counted counted;
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < 64; ++i) workers.push_back(std::make_unique<Worker>([] {}, cumulet::Trace(), nullptr, pool));
  std::atomic<int> done = 0;
  for (int round = 0; round < 3; ++round) {
    for (const auto& worker : workers) {
      worker->post(job([&](Progress&) {
        counted.run();
        ++done;
      }));
    }
    for (const auto& worker : workers) EXPECT_TRUE(worker->wait(std::nullopt));
  }
  EXPECT_EQ(done, 3 * 64);
  EXPECT_LE(counted.most, 3);
  EXPECT_GE(counted.most, 2);
}

TEST(WorkerPoolTest, QueuedWorkerEndsAlthoughAllThreadsAreBusy) {
  const auto pool = std::make_shared<WorkerPool>(1);
  std::atomic<bool> let_go = false;
  std::atomic<bool> begun = false;
  Worker busy([] {}, {}, nullptr, pool);
  busy.post(job([&](Progress&) {
    begun = true;
    begun.notify_all();
    let_go.wait(false);
  }));
  begun.wait(false);
  bool ran = false;
  {
    Worker queued([] {}, {}, nullptr, pool);
    queued.post(job([&](Progress&) { ran = true; }));
    EXPECT_FALSE(queued.wait(std::chrono::steady_clock::now() + std::chrono::milliseconds(20)));
    queued.cancel();
    EXPECT_TRUE(queued.wait(std::nullopt));
    EXPECT_EQ(queued.status().failure->code(), ErrorCode::cancelled);
    queued.post(job([&](Progress&) { ran = true; }));
  }
  EXPECT_FALSE(ran);
  let_go = true;
  let_go.notify_all();
  EXPECT_TRUE(busy.wait(std::nullopt));
}

// A worker with one job after the other must not keep another worker from its only thread.
TEST(WorkerPoolTest, StreamOfJobsStarvesNobody) {
  const auto pool = std::make_shared<WorkerPool>(1);
  std::atomic<bool> stopped = false;
  std::atomic<int> jobs = 0;
  Worker stream([] {}, {}, nullptr, pool);
  std::function<void(Progress&)> work = [&](Progress&) {
    ++jobs;
    if (!stopped) stream.post(job(work));
  };
  stream.post(job(work));
  Worker other([] {}, {}, nullptr, pool);
  for (int i = 0; i < 5; ++i) {
    other.post(job([](Progress&) {}));
    EXPECT_TRUE(other.wait(std::chrono::steady_clock::now() + std::chrono::seconds(60)));
  }
  stopped = true;
  EXPECT_TRUE(stream.wait(std::nullopt));
  EXPECT_GE(jobs, 5);
}

// A long job of many parts makes way between two of them, and goes on later.
TEST(WorkerPoolTest, LongJobMakesWay) {
  const auto pool = std::make_shared<WorkerPool>(1);
  Worker large([] {}, {}, nullptr, pool);
  Worker small([] {}, {}, nullptr, pool);
  std::atomic<bool> small_ran = false;
  int parts = 0;
  int parts_before = 0;
  std::function<void(Progress&)> rest = [&](Progress&) {
    while (parts < 4) {
      if (++parts == 2) {
        EXPECT_FALSE(large.continue_later(job(rest)));  // no worker waits
        small.post(job([&](Progress&) {
          parts_before = parts;
          small_ran = true;
        }));
      }
      if (parts == 2 && large.continue_later(job(rest))) return;
    }
    EXPECT_TRUE(small_ran);
  };
  large.post(job(rest));
  EXPECT_TRUE(large.wait(std::nullopt));
  EXPECT_TRUE(small.wait(std::nullopt));
  EXPECT_EQ(parts, 4);
  EXPECT_EQ(parts_before, 2);
}

TEST(WorkerPoolTest, NewerJobIsNotReplacedByTheRest) {
  const auto pool = std::make_shared<WorkerPool>(1);
  Worker worker([] {}, {}, nullptr, pool);
  Worker waiting([] {}, {}, nullptr, pool);
  std::string order;
  worker.post(job([&](Progress&) {
    waiting.post(job([&](Progress&) { order += 'w'; }));
    worker.post(job([&](Progress&) { order += 'n'; }));
    EXPECT_TRUE(worker.continue_later(job([&](Progress&) { order += 'r'; })));
  }));
  EXPECT_TRUE(worker.wait(std::nullopt));
  EXPECT_EQ(order, "wn");
}

// A callback of the host may wait for a job that has no thread yet.
TEST(WorkerPoolTest, CallbackMayWaitForAQueuedJob) {
  const auto pool = std::make_shared<WorkerPool>(2);
  Worker awaited([] {}, {}, nullptr, pool);
  std::atomic<int> waiting = 0;
  std::atomic<bool> ran = false;
  std::vector<std::unique_ptr<Worker>> workers;
  for (int i = 0; i < 2; ++i) {
    workers.push_back(std::make_unique<Worker>([] {}, cumulet::Trace(), nullptr, pool));
    workers.back()->post(job([&](Progress&) {
      const WorkerPool::InCallback callback;
      const WorkerPool::InCallback nested;
      ++waiting;
      waiting.notify_all();
      ran.wait(false);
    }));
  }
  for (int seen = waiting; seen < 2; seen = waiting) waiting.wait(seen);
  awaited.post(job([&](Progress&) {
    ran = true;
    ran.notify_all();
  }));
  EXPECT_TRUE(awaited.wait(std::chrono::steady_clock::now() + std::chrono::seconds(60)));
  ran = true;
  ran.notify_all();
  for (const auto& worker : workers) EXPECT_TRUE(worker->wait(std::nullopt));
  // Afterwards the limit holds again.
  Counted counted;
  for (int i = 0; i < 8; ++i) workers.push_back(std::make_unique<Worker>([] {}, cumulet::Trace(), nullptr, pool));
  for (const auto& worker : workers) worker->post(job([&](Progress&) { counted.run(); }));
  for (const auto& worker : workers) EXPECT_TRUE(worker->wait(std::nullopt));
  EXPECT_LE(counted.most, 3);  // the additional thread may have one task before it ends
}

// The pool of the process lives as long as a worker, and a forked child has another one.
TEST(WorkerPoolTest, PoolOfTheProcessIsShared) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "ThreadSanitizer refuses new threads in a forked child";
#endif
  std::weak_ptr<WorkerPool> weak;
  {
    const auto one = WorkerPool::of_process();
    EXPECT_EQ(WorkerPool::of_process(), one);
    weak = one;
    Worker worker([] {});
    worker.post(job([](Progress&) {}));
    EXPECT_TRUE(worker.wait(std::nullopt));
    const pid_t child = fork();
    if (child == 0) {
      Worker own([] {});
      bool ran = false;
      own.post(job([&](Progress&) { ran = true; }));
      std::_Exit(own.wait(std::chrono::steady_clock::now() + std::chrono::seconds(60)) && ran &&
                         WorkerPool::of_process() != one
                     ? 0
                     : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  EXPECT_TRUE(weak.expired());
}

TEST(WorkerPoolTest, IdleThreadsEndAndOthersBegin) {
  const auto pool = std::make_shared<WorkerPool>(2);
  Worker worker([] {}, {}, nullptr, pool);
  for (int i = 0; i < 2; ++i) {
    std::thread::id before;
    worker.post(job([&](Progress&) { before = std::this_thread::get_id(); }));
    EXPECT_TRUE(worker.wait(std::nullopt));
    EXPECT_NE(before, std::thread::id());
    std::this_thread::sleep_for(std::chrono::milliseconds(i == 0 ? 1500 : 0));
  }
}

// Workers that come and go while others work, as viewers of thumbnails do.
TEST(WorkerPoolTest, EveryJobRunsOrIsCancelled) {
  const auto pool = std::make_shared<WorkerPool>(4);
  std::atomic<int> ran = 0;
  std::vector<std::thread> hosts;
  for (int host = 0; host < 4; ++host) {
    hosts.emplace_back([&] {
      for (int i = 0; i < 300; ++i) {
        Worker worker([] {}, {}, nullptr, pool);
        worker.post(job([&](Progress&) { ++ran; }));
        if (i % 3 == 0) continue;  // destroyed with the job queued or running
        EXPECT_TRUE(worker.wait(std::nullopt));
        worker.post(job([&](Progress&) { ++ran; }));
        EXPECT_TRUE(worker.wait(std::nullopt));
      }
    });
  }
  for (std::thread& host : hosts) host.join();
  EXPECT_GE(ran, 4 * 200 * 2);
}

}  // namespace
