// Threads of the library end before the process' statics are destroyed.

#include "base/library_thread.hpp"

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <thread>

#include "base/error.hpp"
#include "jobs/worker.hpp"

namespace {

using namespace cumulet;
using std::chrono::milliseconds;

constexpr int left_well = 7;
constexpr int read_destroyed = 8;
constexpr int was_not_refused = 9;

// A static that is created by its first use, as in other libraries.
class Table {
 public:
  Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  ~Table() { there_ = false; }
  void read() const {
    if (!there_) std::_Exit(read_destroyed);
  }

 private:
  std::atomic<bool> there_ = true;
};
const Table& table() {
  static const Table only;
  return only;
}

class LibraryThreadDeathTest : public testing::Test {
 protected:
  void SetUp() override { testing::GTEST_FLAG(death_test_style) = "threadsafe"; }
};

// A thread that reads the table until it is stopped.
struct Reader {
  std::atomic<bool> stopped = false;
  std::atomic<bool> reads = false;
  LibraryThread thread{[this] {
                         while (!stopped) {
                           if (reads) table().read();
                         }
                       },
                       [this] { stopped = true; }};
};

TEST(LibraryThread, ExitWaitsForItsWork) {
  std::atomic<bool> done = false;
  {
    const LibraryThread thread([&] {
      std::this_thread::sleep_for(milliseconds(5));
      done = true;
    });
  }
  EXPECT_TRUE(done);
  std::atomic<bool> stopped = false;
  LibraryThread ended([] {}, [&] { stopped = true; });
  while (!ended.ended()) std::this_thread::yield();
  EXPECT_FALSE(stopped) << "its owner has to say so";
  EXPECT_FALSE(process_is_ending());
}

// Without LibraryThread, the table is destroyed while the thread reads: the exit status is 8 in nearly every run.
TEST_F(LibraryThreadDeathTest, EndsBeforeEarlierStaticsAreDestroyed) {
  const auto leave = [] {
    table().read();
    auto* const reader = new Reader;  // never destroyed
    reader->reads = true;
    std::this_thread::sleep_for(milliseconds(2));
    std::exit(left_well);
  };
  EXPECT_EXIT(leave(), testing::ExitedWithCode(left_well), "");
}

TEST_F(LibraryThreadDeathTest, EndsBeforeStaticsOfJobsAndCallbacksAreDestroyed) {
  const auto leave = [](StaticsOf of) {
    auto* const reader = new Reader;
    std::this_thread::sleep_for(milliseconds(2));
    if (of == StaticsOf::callback) {
      const CallbackScope callback;
      table().read();
    } else {
      viewer::Worker worker([] {});
      worker.post({"a job", Progress::Stage::loading, [](Progress& /*progress*/) { table().read(); }});
      static_cast<void>(worker.wait(std::nullopt));
    }
    reader->reads = true;
    std::this_thread::sleep_for(milliseconds(2));
    std::exit(left_well);
  };
  EXPECT_EXIT(leave(StaticsOf::callback), testing::ExitedWithCode(left_well), "");
  EXPECT_EXIT(leave(StaticsOf::job), testing::ExitedWithCode(left_well), "");
}

// The thread that calls exit() cannot wait for itself.
TEST_F(LibraryThreadDeathTest, JobsMayCallExit) {
  const auto leave = [] {
    auto* const worker = new viewer::Worker([] {
      const CallbackScope callback;
      std::exit(left_well);
    });
    worker->post({"a job", Progress::Stage::loading, [](Progress& /*progress*/) {}});
    for (;;) std::this_thread::sleep_for(milliseconds(1));
  };
  EXPECT_EXIT(leave(), testing::ExitedWithCode(left_well), "");
}

// A queued job is never started during exit. A thread that waits for it returns, and later jobs are rejected.
TEST_F(LibraryThreadDeathTest, WaitersReturnDuringExit) {
  const auto leave = [] {
    auto* const worker = new viewer::Worker([] {});
    const auto job = [](Progress& progress) {
      for (;;) progress.check();
    };
    worker->post({"one", Progress::Stage::loading, job});
    worker->post({"another", Progress::Stage::loading, job});
    std::thread([] {
      std::this_thread::sleep_for(milliseconds(2));
      std::exit(left_well);
    }).detach();
    const HostCall call;
    static_cast<void>(worker->wait(std::nullopt));
    try {
      worker->post({"a third", Progress::Stage::loading, job});
      std::_Exit(was_not_refused);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::cancelled) std::_Exit(was_not_refused);
    }
  };
  EXPECT_EXIT((leave(), std::this_thread::sleep_for(std::chrono::minutes(1))), testing::ExitedWithCode(left_well), "");
}

// Calls in progress on other threads end first. New calls are rejected on other threads, but not on the exiting one.
TEST_F(LibraryThreadDeathTest, ExitWaitsForCallsOfOtherThreads) {
  const auto leave = [] {
    struct Last {
      Last() = default;
      Last(const Last&) = delete;
      Last& operator=(const Last&) = delete;
      ~Last() {
        if (HostCall().refused()) std::_Exit(was_not_refused);
      }
    };
    static const Last last;
    table().read();
    const auto* const reader = new Reader;
    static_cast<void>(reader);
    std::thread([] {
      for (;;) {
        const HostCall call;
        if (call.refused()) continue;
        table().read();
        std::this_thread::sleep_for(milliseconds(1));
        table().read();
      }
    }).detach();
    std::this_thread::sleep_for(milliseconds(3));
    std::exit(left_well);
  };
  EXPECT_EXIT(leave(), testing::ExitedWithCode(left_well), "");
}

// A forked child does not have the thread, so waiting for it would never end. log4cplus, which OpenVDB may link, has
// the same problem with its own thread. Therefore the child exits in the destructor of the first static.
TEST(LibraryThread, AForkedChildDoesNotWait) {
  struct Last {
    Last() = default;
    Last(const Last&) = delete;
    Last& operator=(const Last&) = delete;
    ~Last() {
      if (is_child) std::_Exit(left_well);
    }
    bool is_child = false;
  };
  static Last last;
  auto reader = std::make_unique<Reader>();
  const pid_t child = fork();
  if (child == 0) {
    reader.reset();
    last.is_child = true;
    std::exit(was_not_refused);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), left_well);
  reader->stopped = true;
}

}  // namespace
