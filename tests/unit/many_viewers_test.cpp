// Several viewers in one process share grids and threads.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "assets/instance.hpp"
#include "jobs/worker_pool.hpp"
#include "support/volumes.hpp"
#include "viewer/viewer.hpp"

namespace {

using namespace cumulet;
using viewer::VolumeAssetPtr;

VolumeAssetPtr asset(int side, int seed = 1) {
  return std::make_shared<const viewer::VolumeAsset>(test::noise_volume(glm::ivec3(side), glm::ivec3(0), seed));
}

std::unique_ptr<viewer::Viewer> make_viewer() { return std::make_unique<viewer::Viewer>(Log(), nullptr, true); }

// The grids that a viewer shows, in the order of its volumes.
std::vector<scene::MarchSourcePtr> grids_of(viewer::Viewer& shown) {
  viewer::Frame frame;
  frame.target = viewer::Target::none;
  frame.size = {16, 16};
  frame.viewport = {0, 0, 16, 16};
  // The first frame may request instances' grids.
  static_cast<void>(shown.dry_run(frame));
  shown.wait(-1.0);
  const viewer::Viewer::DryRun run = shown.dry_run(frame);
  std::vector<scene::MarchSourcePtr> grids;
  for (const scene::Volume& volume : run.shot.scene->volumes) grids.push_back(volume.source);
  return grids;
}

// Four viewports of one volume, two of them with an instance of it.
TEST(ManyViewers, OfOneVolumeBuildAndHoldOneGrid) {
  const VolumeAssetPtr volume = asset(48);
  std::array<std::unique_ptr<viewer::Viewer>, 4> viewers;
  for (auto& one : viewers) {
    one = make_viewer();
    one->set_volume(volume);
  }
  const auto instance = std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = volume});
  viewers[2]->add_instance(instance);
  viewers[3]->add_instance(instance);
  const std::vector<scene::MarchSourcePtr> first = grids_of(*viewers[0]);
  ASSERT_EQ(first.size(), 1U);
  for (std::size_t i = 1; i < viewers.size(); ++i) {
    const std::vector<scene::MarchSourcePtr> grids = grids_of(*viewers[i]);
    ASSERT_EQ(grids.size(), i < 2 ? 1U : 2U);
    for (const scene::MarchSourcePtr& grid : grids) EXPECT_EQ(grid, first[0]) << i;
    // Each viewer counts all that it uses, and reports the only build.
    EXPECT_EQ(viewers[i]->stats().memory_bytes, viewers[0]->stats().memory_bytes);
    EXPECT_EQ(viewers[i]->stats().build_seconds.refine, viewers[0]->stats().build_seconds.refine);
    EXPECT_EQ(viewers[i]->stats().cells, viewers[0]->stats().cells);
  }
  EXPECT_GT(viewers[0]->stats().memory_bytes, volume->bytes() + first[0]->grid->bytes() - 1);
  // The grid lives as long as a viewer shows it.
  const std::weak_ptr<const scene::MarchSource> grid = first[0];
  for (auto& one : viewers) {
    EXPECT_FALSE(grid.expired());
    one.reset();
  }
  EXPECT_LE(grid.use_count(), 1);  // `first`
}

TEST(ManyViewers, RebuildConcernsOneViewer) {
  const VolumeAssetPtr volume = asset(32);
  const auto a = make_viewer();
  const auto b = make_viewer();
  a->set_volume(volume);
  b->set_volume(volume);
  const scene::MarchSourcePtr shared = grids_of(*a).at(0);
  ASSERT_EQ(grids_of(*b).at(0), shared);
  b->rebuild();
  b->wait(-1.0);
  EXPECT_NE(grids_of(*b).at(0), shared);
  EXPECT_EQ(grids_of(*a).at(0), shared);
}

// One viewer's cancellation does not concern the others, whichever of them builds.
TEST(ManyViewers, CancellationConcernsOneViewer) {
  for (const std::size_t cancelled : {0, 1}) {
    const VolumeAssetPtr volume = asset(80);
    std::array<std::unique_ptr<viewer::Viewer>, 2> viewers{make_viewer(), make_viewer()};
    for (const auto& one : viewers) one->set_volume(volume);
    while (viewers[0]->status().stage != Progress::Stage::refining &&
           viewers[0]->status().stage != Progress::Stage::idle)
      std::this_thread::yield();
    viewers.at(cancelled)->cancel();
    EXPECT_EQ(grids_of(*viewers.at(1 - cancelled)).size(), 1U) << cancelled;
  }
}

std::size_t threads_of_process() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

// Thumbnails: each viewer has a volume, an instance and a physical sky of its own, each made by another worker.
TEST(ManyViewers, UseFewThreads) {
  constexpr int count = 64;
  constexpr std::size_t max_detached = 16;
  const std::size_t cores = std::thread::hardware_concurrency();
  const std::size_t before = threads_of_process();
  std::atomic<bool> done = false;
  std::size_t most = 0;
  std::thread counts([&] {
    for (; !done; std::this_thread::sleep_for(std::chrono::milliseconds(2)))
      most = std::max(most, threads_of_process());
  });
  {
    std::vector<std::unique_ptr<viewer::Viewer>> viewers;
    for (int i = 0; i < count; ++i) {
      viewers.push_back(make_viewer());
      viewers.back()->set_volume(asset(16, i));
      viewers.back()->add_instance(
          std::make_shared<viewer::Instance>(viewer::InstanceSettings{.volume = asset(16, count + i)}));
      viewer::Light light;
      light.sun_elevation_degrees = static_cast<float>(i);
      light.sky = light::SkyModel{};
      viewers.back()->set_light(light);
    }
    for (const auto& one : viewers) EXPECT_EQ(grids_of(*one).size(), 2U);
  }
  done = true;
  counts.join();
  EXPECT_GT(most, before);
  EXPECT_LE(most, before + 1 + viewer::WorkerPool::max_threads() + max_detached + cores);
}

}  // namespace
