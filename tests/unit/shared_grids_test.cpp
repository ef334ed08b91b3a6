// Grids that viewers of one volume share.

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "jobs/shared_grids.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using viewer::BuildSettings;
using viewer::Built;
using viewer::ResourceLimits;
using viewer::shared_grid;
using viewer::VolumeAssetPtr;

VolumeAssetPtr asset(int side, unsigned seed = 1) {
  return std::make_shared<const viewer::VolumeAsset>(
      test::noise_volume(glm::ivec3(side), glm::ivec3(0), static_cast<int>(seed)));
}

BuildSettings threshold(double value) {
  BuildSettings settings;
  settings.refine.threshold = value;
  return settings;
}

Built grid(const VolumeAssetPtr& volume, const BuildSettings& settings = {}, const ResourceLimits& limits = {},
           const Log& log = {}) {
  Progress progress;
  return shared_grid(log, volume, settings, progress, limits);
}

TEST(SharedGrids, AreThoseOfVolumeAndSettings) {
  const VolumeAssetPtr volume = asset(24);
  const Built first = grid(volume);
  const Built second = grid(volume);
  EXPECT_EQ(second.source, first.source);
  EXPECT_EQ(second.volume, volume);
  EXPECT_EQ(second.settings, first.settings);
  EXPECT_EQ(second.cells, first.cells);
  EXPECT_EQ(second.levels, first.levels);
  EXPECT_EQ(second.cell_limit, first.cell_limit);
  EXPECT_EQ(second.active_voxels, first.active_voxels);
  EXPECT_NE(grid(volume, threshold(0.5)).source, first.source);
  EXPECT_NE(grid(asset(24)).source, first.source);
}

// Only limits that change the grid make another one.
TEST(SharedGrids, DependOnLimitsThatMatter) {
  const VolumeAssetPtr volume = asset(24);
  const Built first = grid(volume, threshold(0.001));
  ResourceLimits ample;
  ample.set(0, std::uint64_t{1} << 30U);
  ample.set_gl(std::uint64_t{1} << 30U);
  EXPECT_EQ(grid(volume, threshold(0.001), ample).source, first.source);
  ResourceLimits tight;
  tight.set_gl(first.source->grid->bytes());  // two fifths of it are for cells
  const Built coarse = grid(volume, threshold(0.001), tight);
  EXPECT_NE(coarse.source, first.source);
  EXPECT_LT(coarse.cells, first.cells);
  EXPECT_TRUE(coarse.limited);
  // Both are in use.
  EXPECT_EQ(grid(volume, threshold(0.001), tight).source, coarse.source);
  EXPECT_EQ(grid(volume, threshold(0.001)).source, first.source);
  ResourceLimits none;
  none.set(0, 1000);
  EXPECT_THROW(static_cast<void>(grid(volume, threshold(0.001), none)), Error);
}

// Settings that do not change the grid make no other one.
TEST(SharedGrids, DependOnSettingsThatMatter) {
  const VolumeAssetPtr volume = asset(24);
  BuildSettings settings = threshold(0.1);
  const Built first = grid(volume, settings);
  settings.refine.density_scale = 3.0;
  settings.shutter_seconds = 0.01;  // the volume has no velocity
  const Built second = grid(volume, settings);
  EXPECT_EQ(second.source, first.source);
  EXPECT_EQ(second.settings, settings);
  settings.refine.criterion = grid::Criterion::transmittance;
  const Built visible = grid(volume, settings);
  EXPECT_NE(visible.source, first.source);
  settings.refine.density_scale = 1.0;
  EXPECT_NE(grid(volume, settings).source, visible.source);
}

TEST(SharedGrids, LiveAsLongAsSomebodyUsesThem) {
  const VolumeAssetPtr volume = asset(24);
  std::weak_ptr<const scene::MarchSource> source = grid(volume).source;
  EXPECT_TRUE(source.expired());
  const Built again = grid(volume);
  ASSERT_TRUE(again.source);
  std::weak_ptr<const viewer::VolumeAsset> weak;
  {
    const VolumeAssetPtr other = asset(16);
    weak = other;
    static_cast<void>(grid(other));
  }
  EXPECT_TRUE(weak.expired());  // a grid that was shared does not keep its volume
}

TEST(SharedGrids, AreBuiltOnceForThreadsThatAskAtTheSameTime) {
  const VolumeAssetPtr volume = asset(64);
  BuildSettings settings = threshold(0.001);
  settings.refine.max_cells = 2000;  // logged
  std::array<Built, 4> built;
  std::array<std::vector<std::string>, 4> lines;
  {
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < built.size(); ++i) {
      threads.emplace_back([&, i] {
        const Log log([&, i](LogLevel, const char* line) { lines.at(i).emplace_back(line); });
        built.at(i) = grid(volume, settings, {}, log);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  for (std::size_t i = 0; i < built.size(); ++i) {
    EXPECT_EQ(built.at(i).source, built[0].source);
    EXPECT_TRUE(built.at(i).limited);
    EXPECT_EQ(lines.at(i), (std::vector<std::string>{"max_cells (2000) stopped the refinement above the threshold"}));
  }
}

TEST(SharedGrids, WaitingThreadBuildsIfTheFirstIsCancelled) {
  const VolumeAssetPtr volume = asset(72);
  Progress cancelled;
  std::atomic<bool> ended = false;
  std::thread first([&] {
    try {
      static_cast<void>(shared_grid({}, volume, threshold(0.001), cancelled));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
    }
    ended = true;
  });
  while (cancelled.stage() != Progress::Stage::refining && !ended) std::this_thread::yield();
  Built built;
  std::thread second([&] { built = grid(volume, threshold(0.001)); });
  cancelled.cancel();
  first.join();
  second.join();
  EXPECT_TRUE(built.source);
}

// A cancelled request ends although another thread goes on building. Until then it reports that thread's progress.
TEST(SharedGrids, WaitingThreadFollowsTheBuildAndCanBeCancelled) {
  const VolumeAssetPtr large = asset(72);
  Progress running;
  Built built;
  std::atomic<bool> ended = false;
  std::thread builds([&] {
    built = shared_grid({}, large, threshold(0.001), running);
    ended = true;
  });
  while (running.stage() != Progress::Stage::refining && !ended) std::this_thread::yield();
  Progress waiting;
  std::optional<ErrorCode> failure;
  Built same;
  std::thread waits([&] {
    try {
      same = shared_grid({}, large, threshold(0.001), waiting);
    } catch (const Error& error) {
      failure = error.code();
    }
  });
  while (waiting.stage() == Progress::Stage::idle && !ended) std::this_thread::yield();
  waiting.cancel();
  waits.join();
  const bool was_running = !ended;
  builds.join();
  EXPECT_TRUE(built.source);
  if (was_running) {
    EXPECT_EQ(failure, ErrorCode::cancelled);
  } else {
    EXPECT_TRUE(failure == ErrorCode::cancelled || same.source == built.source);
  }
}

}  // namespace
