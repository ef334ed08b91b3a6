// Sources of jobs and their list: a viewer cancels, waits for and reports all workers without naming any.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "jobs/jobs.hpp"

namespace {

using namespace std::chrono_literals;
using cumulet::Error;
using cumulet::ErrorCode;
using cumulet::Progress;
using cumulet::viewer::ContentKind;
using cumulet::viewer::GridRequest;
using cumulet::viewer::JobContext;
using cumulet::viewer::JobList;
using cumulet::viewer::JobLog;
using cumulet::viewer::JobSource;
using cumulet::viewer::Worker;
using Calls = std::vector<std::string>;
using Stage = Progress::Stage;
using Time = std::optional<std::chrono::steady_clock::time_point>;

// Logs calls without arguments.
class CallLog : public JobLog {
 public:
  void load_volume(const cumulet::viewer::VolumeFile& /*file*/,
                   const std::optional<cumulet::viewer::BuildSettings>& /*settings*/,
                   const std::optional<cumulet::viewer::BuildSettings>& /*proxy*/) override {}
  void configure_volume(const std::optional<cumulet::viewer::BuildSettings>& /*settings*/) override {}
  void build_volume(const cumulet::viewer::VolumeAssetPtr& /*volume*/,
                    const cumulet::viewer::BuildSettings& /*settings*/,
                    const cumulet::scene::GridPlanPtr& /*before*/) override {}
  void load_surfaces(const cumulet::FilePath& /*path*/, const cumulet::viewer::SurfaceChoice& /*choice*/) override {}
  void configure_surfaces(const cumulet::viewer::SurfaceChoice& /*choice*/) override {}
  void pose_surfaces(const cumulet::viewer::SurfaceAssetPtr& /*asset*/,
                     const cumulet::viewer::SurfaceChoice& /*choice*/) override {}
  void load_environment(const cumulet::FilePath& /*path*/) override {}
  void make_sky(const cumulet::light::Day& /*day*/) override {}
  void request(const std::vector<GridRequest>& /*requests*/) override {}
  void request(const std::vector<cumulet::viewer::PoseRequest>& /*requests*/) override {}
  void request(Player /*player*/, const cumulet::viewer::FrameRequest& /*request*/) override {}
  void follow_states(Player /*player*/, const std::shared_ptr<cumulet::viewer::Live>& /*live*/,
                     const std::optional<cumulet::viewer::BuildSettings>& /*settings*/) override {}
  void configure_states(Player /*player*/, const std::optional<cumulet::viewer::BuildSettings>& /*settings*/) override {
  }
  void call(const char* worker, Player player, const char* function) override {
    calls.push_back(std::string(worker) + " " + std::to_string(player) + ": " + function);
  }

  Calls calls;
};

// Records the calls that reach it.
class Fake : public JobSource {
 public:
  explicit Fake(const JobContext& context) : JobSource(context) {}
  Fake(const JobContext& context, std::string its_name, Calls& its_calls)
      : JobSource(context), name(std::move(its_name)), calls(&its_calls) {}

  void cancel() override {
    add("cancel");
    log_call("fake", name.c_str());
  }
  void rebuild() override { add("rebuild"); }
  [[nodiscard]] bool busy() const override { return is_busy; }
  [[nodiscard]] Worker::Status status() const override { return shown; }
  bool wait(Time until) const override {
    add("wait");
    limit = until;
    return is_ready;
  }

  std::string name;
  Calls* calls = nullptr;
  bool is_busy = false;
  bool is_ready = true;
  Worker::Status shown;
  mutable Time limit;

 private:
  void add(const char* call) const { calls->push_back(name + " " + call); }
};

class JobListTest : public testing::Test {
 protected:
  Fake& add(ContentKind kind, const char* name) {
    auto& fake = list_.add<Fake>(kind);
    fake.name = name;
    fake.calls = &calls_;
    return fake;
  }
  [[nodiscard]] std::shared_ptr<Fake> player(const char* name, JobLog::Player player) {
    return std::make_shared<Fake>(list_.context(player), name, calls_);
  }

  Calls calls_;
  JobList list_{JobContext{{}, [] {}}};
};

TEST_F(JobListTest, CallsAllInTheirOrder) {
  add(ContentKind::environment, "a");
  add(ContentKind::volume, "b");
  list_.set_players({player("c", 1), player("d", 2)});
  list_.cancel();
  list_.rebuild();
  EXPECT_EQ(calls_, (Calls{"a cancel", "b cancel", "c cancel", "d cancel",  //
                           "a rebuild", "b rebuild", "c rebuild", "d rebuild"}));
}

TEST_F(JobListTest, IsBusyIfOneIs) {
  EXPECT_FALSE(list_.busy());
  Fake& own = add(ContentKind::surfaces, "a");
  const auto played = player("b", 1);
  list_.set_players({played});
  EXPECT_FALSE(list_.busy());
  own.is_busy = true;
  EXPECT_TRUE(list_.busy());
  EXPECT_TRUE(list_.busy(ContentKind::surfaces));
  EXPECT_FALSE(list_.busy(ContentKind::volume));
  EXPECT_FALSE(list_.busy(ContentKind::instances));
  own.is_busy = false;
  played->is_busy = true;
  EXPECT_TRUE(list_.busy());
  EXPECT_TRUE(list_.busy(ContentKind::instances));
  EXPECT_FALSE(list_.busy(ContentKind::surfaces));
}

TEST_F(JobListTest, WaitsUntilTheTimeIsUp) {
  const Fake& first = add(ContentKind::volume, "a");
  Fake& second = add(ContentKind::volume, "b");
  const auto played = player("c", 1);
  list_.set_players({played});
  const Time until = std::chrono::steady_clock::now() + 1h;
  EXPECT_TRUE(list_.wait(until));
  EXPECT_EQ(calls_, (Calls{"a wait", "b wait", "c wait"}));
  EXPECT_EQ(first.limit, until);
  ASSERT_TRUE(played->limit);
  EXPECT_LE(*played->limit, *until);
  calls_.clear();
  second.is_ready = false;
  EXPECT_FALSE(list_.wait(std::nullopt));
  EXPECT_EQ(calls_, (Calls{"a wait", "b wait"}));
  EXPECT_FALSE(first.limit);
  second.is_ready = true;
  played->is_ready = false;
  EXPECT_FALSE(list_.wait(std::chrono::steady_clock::now()));
}

// A job of the replaced player would otherwise run to its end.
TEST_F(JobListTest, AReplacedPlayerIsNotWaitedFor) {
  struct Endless : Fake {
    using Fake::Fake;
    bool wait(Time /*until*/) const override {
      has_begun = true;
      awaited.wait(true);
      return true;
    }
    void set_awaited(bool is_awaited) override {
      awaited = is_awaited;
      awaited.notify_all();
    }
    mutable std::atomic<bool> has_begun = false;
    std::atomic<bool> awaited = true;
  };
  auto played = std::make_shared<Endless>(list_.context(1), "a", calls_);
  const std::weak_ptr<Endless> ends = played;
  list_.set_players({played});
  bool done = false;
  std::thread waiting([&] { done = list_.wait(std::nullopt); });
  while (!played->has_begun) std::this_thread::sleep_for(1ms);
  played.reset();
  list_.set_players({});
  waiting.join();
  EXPECT_TRUE(done);
  EXPECT_TRUE(ends.expired());
}

// If a player that stays were dropped for a moment, a waiting thread might return too early.
TEST_F(JobListTest, OnlyPlayersThatComeOrGoAreNotified) {
  struct Noting : Fake {
    using Fake::Fake;
    void set_awaited(bool awaited) override { calls->push_back(name + (awaited ? " comes" : " goes")); }
  };
  const auto a = std::make_shared<Noting>(list_.context(1), "a", calls_);
  const auto b = std::make_shared<Noting>(list_.context(2), "b", calls_);
  const auto c = std::make_shared<Noting>(list_.context(3), "c", calls_);
  list_.set_players({a, b});
  list_.set_players({a, b});
  list_.set_players({b, c});
  list_.set_players({c, b});
  list_.set_players({a});
  EXPECT_EQ(calls_, (Calls{"a comes", "b comes", "a goes", "c comes", "c goes", "b goes", "a comes"}));
}

// The order of ContentKind decides, then the order of the list. Players come last.
TEST_F(JobListTest, StatusIsThatOfTheFirstWorkingSource) {
  Fake& environment = add(ContentKind::environment, "environment");
  Fake& surfaces = add(ContentKind::surfaces, "surfaces");
  Fake& volume = add(ContentKind::volume, "volume");
  Fake& frames = add(ContentKind::volume, "frames");
  const auto played = player("player", 1);
  const auto other = player("other", 2);
  list_.set_players({played, other});
  EXPECT_EQ(list_.status().stage, Stage::idle);
  EXPECT_EQ(list_.status().fraction, 0.0);
  double fraction = 0.0;
  for (Fake* first : {other.get(), played.get(), &environment, &surfaces, &frames, &volume}) {
    fraction += 0.125;
    first->shown.stage = Stage::loading;
    first->shown.fraction = fraction;
    EXPECT_EQ(list_.status().stage, Stage::loading);
    EXPECT_EQ(list_.status().fraction, fraction) << first->name;
  }
}

TEST_F(JobListTest, TheFirstFailureOfAKindCounts) {
  Fake& volume = add(ContentKind::volume, "volume");
  Fake& grids = add(ContentKind::instances, "grids");
  Fake& frames = add(ContentKind::volume, "frames");
  const auto played = player("player", 1);
  const auto other = player("other", 2);
  list_.set_players({played, other});
  const auto text_of = [&](ContentKind kind) -> std::string {
    const auto failure = list_.status().failures[kind];
    return failure ? failure->what() : "none";
  };
  const auto fail = [](Fake& source) { source.shown.failure = Error(ErrorCode::file, source.name); };
  EXPECT_EQ(text_of(ContentKind::volume), "none");
  fail(frames);
  EXPECT_EQ(text_of(ContentKind::volume), "frames");
  fail(volume);
  EXPECT_EQ(text_of(ContentKind::volume), "volume");
  EXPECT_EQ(text_of(ContentKind::instances), "none");
  fail(*other);
  EXPECT_EQ(text_of(ContentKind::instances), "other");
  fail(*played);
  EXPECT_EQ(text_of(ContentKind::instances), "player");
  fail(grids);
  EXPECT_EQ(text_of(ContentKind::instances), "grids");
  EXPECT_EQ(text_of(ContentKind::models), "none");
}

// The destructor of a player waits for its job, whose callback may ask the viewer for its status.
TEST_F(JobListTest, PreviousPlayersAreDestroyedWithoutTheLock) {
  struct Asking : Fake {
    Asking(const JobContext& context, const JobList& its_list, Calls& its_calls)
        : Fake(context, "asking", its_calls), list(&its_list) {}
    Asking(const Asking&) = delete;
    Asking& operator=(const Asking&) = delete;
    ~Asking() override {
      if (list->status().stage == Stage::idle) calls->emplace_back("asked");
    }
    const JobList* list;
  };
  list_.set_players({std::make_shared<Asking>(list_.context(1), list_, calls_)});
  list_.set_players({});
  EXPECT_EQ(calls_, (Calls{"asked"}));
  list_.cancel();
  EXPECT_EQ(calls_.size(), 1U);
}

TEST_F(JobListTest, TheLogReachesAllSourcesAndNewPlayers) {
  CallLog log;
  add(ContentKind::volume, "a");
  list_.set_players({player("b", 3)});
  list_.set_job_log(&log);
  list_.cancel();
  EXPECT_EQ(log.calls, (Calls{"fake 0: a", "fake 3: b"}));
  log.calls.clear();
  list_.set_players({player("c", 4)});
  list_.cancel();
  EXPECT_EQ(log.calls, (Calls{"fake 0: a", "fake 4: c"}));
  log.calls.clear();
  list_.set_job_log(nullptr);
  list_.cancel();
  EXPECT_TRUE(log.calls.empty());
}

TEST(Jobs, AllWorkersAreInTheList) {
  CallLog log;
  cumulet::viewer::Jobs jobs(JobContext{{}, [] {}});
  jobs.set_job_log(&log);
  EXPECT_FALSE(jobs.busy());
  EXPECT_TRUE(jobs.wait(std::nullopt));
  EXPECT_EQ(jobs.status().stage, Stage::idle);
  jobs.cancel();
  EXPECT_EQ(log.calls, (Calls{"volume 0: cancel", "surfaces 0: cancel", "environment 0: cancel",
                              "building the grids of several volumes 0: cancel", "posing several models 0: cancel",
                              "frames 0: cancel", "states 0: cancel"}));
  log.calls.clear();
  jobs.rebuild();
  EXPECT_EQ(log.calls, (Calls{"building the grids of several volumes 0: forget failures",
                              "posing several models 0: forget failures", "frames 0: rebuild", "states 0: rebuild"}));
}

TEST(Jobs, CachesAreBusyUntilTheirChangesAreTaken) {
  int made = 0;
  std::optional<Error> failure;
  cumulet::viewer::RequestCache<GridRequest, int> cache(
      "counting", Stage::refining,
      [&](const GridRequest& /*request*/, Progress& /*progress*/) {
        if (failure) throw Error(*failure);
        return ++made;
      },
      JobContext{{}, [] {}});
  const GridRequest first{nullptr, {}, 1};
  const GridRequest second{nullptr, {}, 2};
  EXPECT_FALSE(cache.busy());
  EXPECT_FALSE(cache.take_changes());
  cache.request({first});
  ASSERT_TRUE(cache.wait(std::nullopt));
  EXPECT_TRUE(cache.busy());
  EXPECT_TRUE(cache.take_changes());
  EXPECT_FALSE(cache.take_changes());
  EXPECT_FALSE(cache.busy());
  EXPECT_EQ(cache.built(first), 1);
  // A failure is a change too. Only a rebuild retries it.
  failure = Error(ErrorCode::file, "no value");
  cache.request({first, second});
  ASSERT_TRUE(cache.wait(std::nullopt));
  EXPECT_TRUE(cache.take_changes());
  ASSERT_TRUE(cache.status().failure);
  EXPECT_STREQ(cache.status().failure->what(), "no value");
  failure.reset();
  cache.request({first, second});
  ASSERT_TRUE(cache.wait(std::nullopt));
  EXPECT_FALSE(cache.take_changes());
  EXPECT_FALSE(cache.built(second));
  cache.rebuild();
  cache.request({first, second});
  ASSERT_TRUE(cache.wait(std::nullopt));
  EXPECT_EQ(cache.built(second), 2);
  EXPECT_FALSE(cache.status().failure);
}

}  // namespace
