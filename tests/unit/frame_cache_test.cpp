// The frame cache of a sequence: it reads and builds ahead in the order of need, keeps as many frames as fit, and skips
// broken ones.

#include "jobs/frame_cache.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "jobs/build_grid.hpp"
#include "support/clip.hpp"
#include "volume/between.hpp"

namespace {

using cumulet::test::Clip;
using cumulet::viewer::BuildSettings;
using cumulet::viewer::FrameCache;
using cumulet::viewer::FrameFiles;
using cumulet::viewer::FrameFilesPtr;
using cumulet::viewer::JobContext;
using Frames = std::vector<std::uint32_t>;
using State = FrameCache::State;

constexpr std::uint64_t plenty = std::uint64_t{1} << 32U;

class FrameCacheTest : public testing::Test {
 protected:
  static constexpr int count = 8;

  [[nodiscard]] FrameFilesPtr files(bool suggested = false) const {
    FrameFiles files{clip_.paths(), {}};
    files.shown.suggested_density_scale = suggested;
    return std::make_shared<const FrameFiles>(files);
  }
  // All frames, starting with `first`; earlier frames come last.
  static Frames from(std::uint32_t first) {
    Frames order(count);
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::rotate(order, order.begin() + first);
    return order;
  }
  // Polls until the condition is true. Returns false after a minute.
  template <class Condition>
  static bool comes(Condition&& condition) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }
  [[nodiscard]] std::size_t number(State state) const {
    return static_cast<std::size_t>(std::ranges::count(cache_.frames().frames, state));
  }
  [[nodiscard]] std::vector<std::string> warnings() {
    const std::scoped_lock lock(mutex_);
    return warnings_;
  }

  Clip clip_{count};
  std::mutex mutex_;
  std::vector<std::string> warnings_;
  std::atomic<int> told_ = 0;
  FrameCache cache_{JobContext{cumulet::Log([this](cumulet::LogLevel level, const char* text) {
                                 const std::scoped_lock lock(mutex_);
                                 if (level == cumulet::LogLevel::warning) warnings_.emplace_back(text);
                               }),
                               [this] { ++told_; }}};
};

// Compares cells, point location and channels bit by bit.
void expect_same_grid(const cumulet::viewer::Built& a, const cumulet::viewer::Built& b) {
  const auto bytes = [](const auto& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  EXPECT_EQ(bytes(a.source->grid->cells), bytes(b.source->grid->cells));
  EXPECT_EQ(bytes(a.source->grid->tree), bytes(b.source->grid->tree));
  EXPECT_EQ(bytes(a.source->grid->channels.emission), bytes(b.source->grid->channels.emission));
  EXPECT_EQ(a.source->max_value, b.source->max_value);
}

TEST_F(FrameCacheTest, PrefetchedFramesMatchSingleLoads) {
  clip_.with_flame(5);
  clip_.empty(6);
  const FrameFilesPtr all = files();
  cache_.request({all, from(3), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  ASSERT_TRUE(cache_.nearest());
  EXPECT_EQ(cache_.nearest()->frame, 3U);
  EXPECT_TRUE(cache_.nearest()->wanted);
  ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
  EXPECT_GE(told_, count);
  const std::uint64_t revision = cache_.revision();
  for (std::uint32_t frame = 0; frame < count; ++frame) {
    SCOPED_TRACE(frame);
    cache_.request({all, from(frame), BuildSettings{}, plenty});
    const auto ready = cache_.nearest();
    ASSERT_TRUE(ready && ready->wanted);
    EXPECT_EQ(ready->frame, frame);
    cumulet::Progress progress;
    const auto alone = cumulet::viewer::build_grid({}, all->file(frame).read({}, nullptr), BuildSettings{}, progress);
    expect_same_grid(ready->built, alone);
  }
  EXPECT_EQ(cache_.revision(), revision);  // nothing was built twice
}

// A fire that goes out: its last frames have only a few kelvin.
TEST_F(FrameCacheTest, AllFramesUseTheLargestFramesTemperatureScale) {
  const auto heat = [](int frame, float times) {
    auto grid = cumulet::test::clip_ball(frame, "temperature");
    for (auto value = grid->beginValueOn(); value; ++value) value.setValue(times * *value);
    return grid;
  };
  const auto write = [&](int frame, float times) {
    cumulet::test::write_frame(clip_.path(frame), {cumulet::test::clip_ball(frame), heat(frame, times)});
  };
  write(4, 1000.0F);  // among the largest balls, so it is the largest file
  write(1, 5.0F);
  const FrameFilesPtr all = files();
  BuildSettings glowing;
  glowing.emission.blackbody = 1.0;
  cache_.request({all, from(1), glowing, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  const auto ready = cache_.nearest();
  ASSERT_TRUE(ready && ready->frame == 1U);
  EXPECT_EQ(ready->built.volume->temperature_scale(), 1.0);
  EXPECT_FALSE(ready->built.source->emits()) << "of 10 kelvin nothing glows";
  EXPECT_EQ(all->file(1).read({}, nullptr)->temperature_scale(), 1500.0) << "by itself";
}

TEST_F(FrameCacheTest, KeepsTheNextFramesWithinItsMemory) {
  const FrameFilesPtr all = files();
  cache_.request({all, from(0), BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
  std::vector<std::uint64_t> sizes;
  for (std::uint32_t frame = 0; frame < count; ++frame) {
    cache_.request({all, from(frame), BuildSettings{}, plenty});
    EXPECT_TRUE(cache_.nearest()->built.volume) << "voxels stay where there is room";
    sizes.push_back(cache_.nearest()->built.source->bytes());
  }
  const std::uint64_t room = 3 * *std::ranges::max_element(sizes);
  cache_.request({all, from(2), BuildSettings{}, room});
  const auto ready = [&](std::uint32_t frame) { return cache_.frames().frames[frame] == State::ready; };
  for (const std::uint32_t frame : {2U, 3U, 4U}) EXPECT_TRUE(ready(frame)) << frame;
  EXPECT_FALSE(ready(0));
  EXPECT_FALSE(ready(1));
  const auto takes = [&] {
    std::uint64_t bytes = 0;
    for (std::uint32_t frame = 0; frame < count; ++frame) bytes += ready(frame) ? sizes[frame] : 0;
    return bytes;
  };
  EXPECT_LE(takes(), room);
  // Playback moves on: frames that were evicted are read again.
  cache_.request({all, from(6), BuildSettings{}, room});
  ASSERT_TRUE(comes([&] { return ready(6) && ready(7) && ready(0); }));
  EXPECT_LE(takes(), room);
  // With a limit of 0 bytes, exactly one frame is kept.
  cache_.request({all, from(4), BuildSettings{}, 0});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.nearest()->frame, 4U);
  EXPECT_TRUE(cache_.nearest()->wanted);
  EXPECT_EQ(number(State::ready), 1U);
}

TEST_F(FrameCacheTest, SkipsMissingOrCorruptFrames) {
  clip_.remove(0);
  clip_.remove(3);
  clip_.corrupt(4);
  const FrameFilesPtr all = files();
  cache_.request({all, from(0), BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return number(State::ready) == 5 && number(State::failed) == 3; }));
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> proxies = {{0, 1}, {1, 1}, {2, 2}, {3, 2}, {4, 2}, {5, 5}};
  for (const auto& [frame, shown] : proxies) {
    cache_.request({all, from(frame), BuildSettings{}, plenty});
    ASSERT_TRUE(cache_.wait(std::nullopt));
    EXPECT_EQ(cache_.nearest()->frame, shown) << frame;
    EXPECT_TRUE(cache_.nearest()->wanted) << frame;
  }
  EXPECT_FALSE(cache_.status().failure);
  EXPECT_FALSE(cache_.failure_of(2));
  ASSERT_EQ(warnings().size(), 3U);  // one per broken frame
  for (const int broken : {0, 3, 4}) {
    ASSERT_TRUE(cache_.failure_of(static_cast<std::uint32_t>(broken)));
    EXPECT_EQ(std::string(cache_.failure_of(static_cast<std::uint32_t>(broken))->what()).rfind(clip_.path(broken), 0),
              0U);
    const auto names = [&](const std::string& line) { return line.rfind(clip_.path(broken) + ": ", 0) == 0; };
    EXPECT_EQ(std::ranges::count_if(warnings(), names), 1) << broken;
  }
  for (const std::string& line : warnings()) EXPECT_TRUE(line.ends_with(": another frame is shown instead")) << line;
  // Once the file exists, the frame is displayed.
  cumulet::test::write_frame(clip_.path(3), {cumulet::test::clip_ball(3)});
  cache_.rebuild();
  ASSERT_TRUE(comes([&] { return number(State::ready) == 6 && number(State::failed) == 2; }));
}

TEST_F(FrameCacheTest, FailsWithoutAnyReadableFrame) {
  for (int frame = 0; frame < count; ++frame) clip_.remove(frame);
  cache_.request({files(), from(2), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_FALSE(cache_.nearest());
  ASSERT_TRUE(cache_.status().failure);
  EXPECT_EQ(std::string(cache_.status().failure->what()).rfind(clip_.path(2), 0), 0U);
  EXPECT_EQ(warnings().size(), std::size_t{count});
  for (const std::string& line : warnings())
    EXPECT_EQ(line.find("instead"), std::string::npos) << "there is no other frame: " << line;
  cumulet::test::write_frame(clip_.path(6), {cumulet::test::clip_ball(6)});
  cache_.rebuild();
  ASSERT_TRUE(cache_.wait(std::nullopt));
  ASSERT_TRUE(cache_.nearest());
  EXPECT_EQ(cache_.nearest()->frame, 6U);
  EXPECT_FALSE(cache_.status().failure);
}

TEST_F(FrameCacheTest, SettingsComeFromTheLargestReadableFile) {
  std::vector<std::uintmax_t> sizes;
  for (const std::string& path : clip_.paths()) sizes.push_back(std::filesystem::file_size(path));
  auto largest = static_cast<std::uint32_t>(std::ranges::max_element(sizes) - sizes.begin());
  clip_.corrupt(static_cast<int>(largest));  // so the next largest file is used
  sizes[largest] = 0;
  largest = static_cast<std::uint32_t>(std::ranges::max_element(sizes) - sizes.begin());
  const FrameFilesPtr all = files(true);
  const auto volume = all->file(largest).read({}, nullptr);
  const auto scale = volume->coarse().suggest_density_scale();
  ASSERT_TRUE(scale);
  cache_.request({all, from(0), std::nullopt, plenty});  // no settings yet
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_FALSE(cache_.nearest());
  cache_.request({all, from(0), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.nearest()->built.settings.refine.density_scale, *scale);
  const auto judged = cache_.take_analyzed();
  ASSERT_TRUE(judged);
  EXPECT_EQ(judged->density_scale, scale);
  EXPECT_EQ(judged->volume_info->bounds().max, volume->bounds().max);
  EXPECT_FALSE(cache_.take_analyzed());
}

TEST_F(FrameCacheTest, ShowsOldFramesUntilNewSettingsAreBuilt) {
  const FrameFilesPtr all = files();
  cache_.request({all, from(0), BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
  BuildSettings finer;
  finer.refine.threshold = 0.01;
  cache_.request({all, from(1), finer, plenty});
  ASSERT_TRUE(cache_.nearest());
  EXPECT_EQ(cache_.nearest()->frame, 1U);
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.nearest()->built.settings, finer);
  ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
}

TEST_F(FrameCacheTest, ChangedFilesDiscardAllFrames) {
  cache_.request({files(), from(0), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  const Clip other(3);
  const auto others = std::make_shared<const FrameFiles>(FrameFiles{other.paths(), {}});
  cache_.request({others, {1, 2, 0}, BuildSettings{}, plenty});
  EXPECT_EQ(cache_.frames().frames.size(), 3U);
  ASSERT_TRUE(comes([&] { return number(State::ready) == 3; }));
  cache_.clear();
  EXPECT_FALSE(cache_.nearest());
  EXPECT_TRUE(cache_.wait(std::nullopt));
  EXPECT_TRUE(cache_.frames().frames.empty());
  EXPECT_FALSE(cache_.take_analyzed());
}

// A host repairs the file as soon as the warning is logged. The earlier failure does not count.
TEST_F(FrameCacheTest, RepairedFileIsReadAgain) {
  const Clip other(1);
  other.remove(0);
  std::unique_ptr<FrameCache> cache;
  std::atomic<int> mended = 0;
  const auto mend = [&](cumulet::LogLevel level, const char* /*text*/) {
    if (level != cumulet::LogLevel::warning || mended++ > 0) return;
    cumulet::test::write_frame(other.path(0), {cumulet::test::clip_ball(0)});
    cache->rebuild();
  };
  cache = std::make_unique<FrameCache>(JobContext{cumulet::Log(mend), [] {}});
  const auto files = std::make_shared<const FrameFiles>(FrameFiles{other.paths(), {}});
  cache->request({files, {0}, BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return !cache->busy() && mended > 0; }));
  EXPECT_FALSE(cache->status().failure);
  ASSERT_TRUE(cache->nearest());
  EXPECT_TRUE(cache->nearest()->wanted);
}

TEST_F(FrameCacheTest, ReportsWhyItStopped) {
  clip_.corrupt(3);
  std::atomic<bool> throws = true;
  FrameCache cache(JobContext{cumulet::Log([&](cumulet::LogLevel, const char*) {
                                if (throws) throw std::runtime_error("no room");
                              }),
                              [] {}});
  cache.request({files(), from(3), BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return cache.status().failure.has_value(); }));
  EXPECT_STREQ(cache.status().failure->what(), "internal error: no room");
  EXPECT_TRUE(cache.wait(std::nullopt));
  throws = false;
  cache.rebuild();
  ASSERT_TRUE(cache.wait(std::nullopt));
  EXPECT_FALSE(cache.status().failure);
  EXPECT_TRUE(cache.nearest());
}

// A rebuild continues in the background; its results are not awaited if nothing was requested since.
TEST_F(FrameCacheTest, AfterAFinalResultNothingIsAwaited) {
  const FrameFilesPtr all = files();
  cache_.request({all, from(2), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_FALSE(cache_.is_final_taken());
  ASSERT_TRUE(cache_.take());
  EXPECT_TRUE(cache_.is_final_taken());
  cache_.rebuild();
  EXPECT_FALSE(cache_.busy());
  ASSERT_TRUE(cache_.wait(std::nullopt));
  cache_.request({all, from(3), BuildSettings{}, plenty});
  EXPECT_FALSE(cache_.is_final_taken());
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_TRUE(cache_.take()->wanted);
  cache_.clear();
  EXPECT_FALSE(cache_.is_final_taken());
}

TEST_F(FrameCacheTest, WaitingEndsIfNobodyNeedsTheResult) {
  for (int frame = 0; frame < count; ++frame) clip_.corrupt(frame);
  std::atomic<bool> has_warned = false;
  std::atomic<bool> may_continue = false;
  FrameCache cache{JobContext{cumulet::Log([&](cumulet::LogLevel /*level*/, const char* /*text*/) {
                                has_warned = true;
                                has_warned.notify_all();
                                may_continue.wait(false);  // the job does not end before
                              }),
                              [] {}}};
  const auto is_ready = [&] { return cache.wait(std::chrono::steady_clock::now()); };
  cache.request({files(), from(0), BuildSettings{}, plenty});
  has_warned.wait(false);
  EXPECT_FALSE(is_ready());
  std::thread waiting([&] { EXPECT_TRUE(cache.wait(std::nullopt)); });
  cache.set_awaited(false);
  waiting.join();
  EXPECT_TRUE(is_ready());
  cache.set_awaited(true);
  EXPECT_FALSE(is_ready());
  may_continue = true;
  may_continue.notify_all();
  EXPECT_TRUE(cache.wait(std::nullopt));
}

TEST_F(FrameCacheTest, StopsUntilTheNextRequest) {
  const FrameFilesPtr all = files();
  for (std::uint32_t round = 0; round < 6; ++round) {
    cache_.request({all, from(round), BuildSettings{}, plenty});
    cache_.cancel();
    ASSERT_TRUE(cache_.wait(std::nullopt));
    EXPECT_FALSE(cache_.busy());
  }
  cache_.request({all, from(1), BuildSettings{}, plenty});
  ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
}

// Requests change continuously and from several threads. The final state is that of the last request.
TEST_F(FrameCacheTest, RequestsMayChangeContinuously) {
  clip_.corrupt(2);
  const FrameFilesPtr all = files();
  const FrameFilesPtr again = files();
  std::atomic<bool> ends = false;
  std::thread looks([&] {
    while (!ends) {
      static_cast<void>(cache_.nearest());
      static_cast<void>(cache_.frames());
      static_cast<void>(cache_.status());
      static_cast<void>(cache_.take_analyzed());
    }
  });
  for (std::uint32_t i = 0; i < 60; ++i) {
    BuildSettings settings;
    settings.refine.threshold = 0.02 + 0.01 * (i % 3);
    cache_.request({i % 20 < 15 ? all : again, from(i % count), settings, i % 7 == 0 ? 0 : plenty});
    if (i % 11 == 5) cache_.cancel();
    if (i % 13 == 5) cache_.rebuild();
    if (i % 17 == 5) cache_.clear();
    if (i % 4 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  cache_.request({all, from(4), BuildSettings{}, plenty});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_TRUE(comes([&] { return number(State::ready) == count - 1; }));
  ends = true;
  looks.join();
  EXPECT_EQ(cache_.nearest()->frame, 4U);
  EXPECT_EQ(cache_.nearest()->built.settings, BuildSettings{});
}

// Quarter-frame steps, starting with `first`; earlier steps come last.
Frames steps_from(std::uint32_t first, std::uint32_t last) {
  Frames order(last + 1);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::rotate(order, order.begin() + first);
  return order;
}

TEST_F(FrameCacheTest, SubframesInterpolateBothFrames) {
  using cumulet::scene::Between;
  const FrameFilesPtr all = files();
  for (const Between how : {Between::blend, Between::advect}) {
    const FrameCache::Steps steps{how, 4, how == Between::advect ? 1.0 / 24.0 : 0.0};
    const std::uint32_t last = 4 * (count - 1);
    for (const std::uint32_t step : {9U, 10U, 12U}) {
      SCOPED_TRACE(step);
      cache_.request({all, steps_from(step, last), BuildSettings{}, plenty, steps});
      ASSERT_TRUE(cache_.wait(std::nullopt));
      const auto ready = cache_.nearest();
      ASSERT_TRUE(ready && ready->wanted);
      EXPECT_EQ(ready->frame, step / 4);
      EXPECT_EQ(ready->part, 0.25 * (step % 4));
      cumulet::Progress progress;
      const auto before = all->file(step / 4).read({}, nullptr);
      auto volume = before;
      if (step % 4 != 0) {
        const auto after = all->file(step / 4 + 1).read({}, nullptr);
        const double part = 0.25 * (step % 4);
        // The balls have no velocity.
        volume = std::make_shared<const cumulet::viewer::VolumeAsset>(
            cumulet::volume::blend(before->frame(), after->frame(), part));
      }
      expect_same_grid(ready->built, cumulet::viewer::build_grid({}, volume, BuildSettings{}, progress));
    }
    ASSERT_TRUE(comes([&] { return number(State::ready) == count; }));
  }
  // A request with other steps keeps the whole frames.
  const std::uint64_t revision = cache_.revision();
  cache_.request({all, from(3), BuildSettings{}, plenty});
  EXPECT_EQ(number(State::ready), static_cast<std::size_t>(count));
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.nearest()->frame, 3U);
  EXPECT_TRUE(cache_.nearest()->wanted);
  EXPECT_LE(cache_.revision(), revision + 1);  // one step may have been in progress
}

TEST_F(FrameCacheTest, NoSubframesNextToFailedFrames) {
  clip_.remove(0);
  clip_.corrupt(4);
  const FrameFilesPtr all = files();
  const FrameCache::Steps steps{cumulet::scene::Between::blend, 2, 0.0};
  const std::uint32_t last = 2 * (count - 1);
  cache_.request({all, steps_from(0, last), BuildSettings{}, plenty, steps});
  ASSERT_TRUE(comes([&] { return number(State::ready) == count - 2 && number(State::failed) == 2; }));
  struct Case {
    std::uint32_t step;
    std::uint32_t frame;
    double part;
  };
  const std::vector<Case> cases = {{0, 1, 0.0}, {1, 1, 0.0}, {3, 1, 0.5},  {6, 3, 0.0}, {7, 3, 0.0},
                                   {8, 3, 0.0}, {9, 3, 0.0}, {10, 5, 0.0}, {11, 5, 0.5}};
  for (const Case& one : cases) {
    SCOPED_TRACE(one.step);
    cache_.request({all, steps_from(one.step, last), BuildSettings{}, plenty, steps});
    ASSERT_TRUE(cache_.wait(std::nullopt));
    const auto ready = cache_.nearest();
    ASSERT_TRUE(ready && ready->wanted);
    EXPECT_EQ(ready->frame, one.frame);
    EXPECT_EQ(ready->part, one.part);
  }
  EXPECT_EQ(warnings().size(), 2U);  // only for files, not for steps between them
}

TEST_F(FrameCacheTest, SubframesStayWithinTheMemory) {
  const FrameFilesPtr all = files();
  const FrameCache::Steps steps{cumulet::scene::Between::blend, 8, 0.0};
  const std::uint32_t last = 8 * (count - 1);
  cache_.request({all, steps_from(3, last), BuildSettings{}, 0, steps});
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_EQ(cache_.nearest()->part, 0.375);
  EXPECT_EQ(number(State::ready), 0U);
  const std::uint64_t one = cache_.frames().bytes;
  const std::uint64_t room = 4 * one;
  cache_.request({all, steps_from(20, last), BuildSettings{}, room, steps});
  ASSERT_TRUE(comes([&] { return cache_.nearest()->frame == 2 && !cache_.busy(); }));
  EXPECT_LE(cache_.frames().bytes, room);
  // The build in progress ends, and none follows.
  cache_.request({all, steps_from(40, last), BuildSettings{}, plenty, steps});
  cache_.cancel();
  ASSERT_TRUE(cache_.wait(std::nullopt));
  EXPECT_FALSE(cache_.status().failure);
}

}  // namespace
