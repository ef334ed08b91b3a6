// Pictures that cumulet-demo renders in the background, without a GL context.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "measurements.hpp"
#include "picture_job.hpp"
#include "render_queue.hpp"
#include "support/folder.hpp"
#include "time_left.hpp"

namespace {

using namespace cumulet::demo;
using State = RenderEntry::State;

PictureJob job(const std::string& path) {
  PictureJob made;
  made.file.path = path;
  return made;
}

/// Waits for a condition. A busy machine only makes it slower.
template <class Condition>
void wait_for(Condition condition) {
  const auto start = std::chrono::steady_clock::now();
  while (!condition()) {
    ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

TEST(RenderQueueTest, CarriesOutOneJobAfterTheOther) {
  std::atomic<int> running = 0;
  std::atomic<int> wakes = 0;
  RenderQueue queue(
      [&](const PictureJob& picture, const PictureWatch& watch) -> std::string {
        EXPECT_EQ(++running, 1);
        watch.report(0.5, "half");
        --running;
        if (picture.file.path == "bad.png") throw std::runtime_error("no disk");
        return "made " + picture.file.path;
      },
      [&] { ++wakes; });
  EXPECT_EQ(queue.unfinished(), 0u);
  for (const char* path : {"a.png", "bad.png", "b.png"}) queue.add(job(path));
  wait_for([&] { return queue.unfinished() == 0; });
  const std::vector<RenderEntry> entries = queue.entries();
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].number, 1u);
  EXPECT_EQ(entries[0].state, State::done);
  EXPECT_EQ(entries[0].text, "made a.png");
  EXPECT_EQ(entries[0].part, 1.0);
  EXPECT_EQ(entries[1].state, State::failed);
  EXPECT_EQ(entries[1].text, "no disk");
  EXPECT_EQ(entries[2].state, State::done);
  EXPECT_GE(wakes, 3);
  EXPECT_EQ(queue.take_ended().size(), 3u);
  EXPECT_TRUE(queue.take_ended().empty()) << "each is reported once";
  queue.clear();
  EXPECT_TRUE(queue.entries().empty());
}

TEST(RenderQueueTest, CancelsRunningAndWaitingJobs) {
  RenderQueue queue(
      [](const PictureJob&, const PictureWatch& watch) -> std::string {
        while (!watch.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        throw PictureCancelled();
      },
      [] {});
  for (const char* path : {"a.png", "b.png", "c.png"}) queue.add(job(path));
  wait_for([&] { return queue.entries()[0].state == State::running; });
  queue.cancel(2);
  queue.cancel(99);
  EXPECT_EQ(queue.entries()[1].state, State::cancelled);
  queue.clear();
  EXPECT_EQ(queue.entries().size(), 2u) << "unfinished entries stay";
  queue.cancel(1);
  wait_for([&] { return queue.entries()[1].state == State::running; });
  EXPECT_EQ(queue.entries()[0].state, State::cancelled);
  EXPECT_EQ(queue.unfinished(), 1u);
  // The destructor cancels the last one.
}

TEST(TimeLeftTest, FollowsFromTheRate) {
  TimeLeft left;
  const auto seconds = [&left] { return left.seconds(0.0); };
  EXPECT_FALSE(seconds());
  left.see(0.1, 10.0);
  left.see(0.101, 10.1);
  EXPECT_FALSE(seconds()) << "too early";
  left.see(0.3, 12.0);
  EXPECT_NEAR(seconds().value(), 7.0, 1e-9);
  left.see(0.1, 13.0);
  EXPECT_FALSE(seconds()) << "another image";
  left.see(0.6, 14.0);
  EXPECT_NEAR(seconds().value(), 0.8, 1e-9);
  left.see(1.0, 15.0);
  EXPECT_FALSE(seconds());
  left.rest();
  EXPECT_FALSE(seconds());
}

// A loaded machine completes a tiny part of the first sample in the first second.
TEST(TimeLeftTest, NeedsAWholeSample) {
  cumulet_sampling_desc sampling{};
  sampling.samples = 256;
  const double sample = part_of_a_sample(sampling);
  TimeLeft left;
  left.see(1e-6, 10.0);
  left.see(7e-6, 11.0);
  EXPECT_FALSE(left.seconds(sample)) << "46 hours";
  left.see(0.9 * sample, 14.0);
  EXPECT_FALSE(left.seconds(sample));
  left.see(1e-6 + sample, 15.0);
  EXPECT_NEAR(left.seconds(sample).value(), 5.0 * 255.0, 1.0);
}

TEST(MeasurementsTest, TimeLeftNeedsAWholeImage) {
  Charts charts;
  Measurements measurements(charts);
  cumulet_sampling_desc sampling{};
  sampling.samples = 10;
  Status status;
  status.frame.flags = CUMULET_RENDER_INCOMPLETE;
  const auto see = [&](double progress, double now) {
    status.frame.progress = progress;
    measurements.take_status(status, 0, now);
    return measurements.seconds_left(sampling);
  };
  EXPECT_FALSE(see(0.01, 1.0));
  EXPECT_FALSE(see(0.099, 20.0)) << "no pixel-complete image";
  status.frame.width = status.frame.height = 8;
  EXPECT_FALSE(see(0.1, 21.0));
  EXPECT_FALSE(see(0.15, 22.0));
  EXPECT_NEAR(see(0.2, 23.0).value(), 16.0, 1e-9) << "the slow first sample does not count";
}

TEST(PictureJobTest, FileNameFollowsTheFormat) {
  EXPECT_EQ(path_for("/a/cloud.png", PictureFormat::exr, false), "/a/cloud.exr");
  EXPECT_EQ(path_for("/a/cloud", PictureFormat::webp, false), "/a/cloud.webp");
  EXPECT_EQ(path_for("/a/cloud.v2.png", PictureFormat::png, true), "/a/cloud.v2_####.png");
  EXPECT_EQ(path_for("/a/cloud_####.png", PictureFormat::png, true), "/a/cloud_####.png");
  EXPECT_EQ(path_for("/a/cloud_##.png", PictureFormat::exr, true), "/a/cloud_##.exr");
  EXPECT_EQ(path_for("/a/cloud_####.png", PictureFormat::png, false), "/a/cloud.png");
}

TEST(PictureJobTest, ProblemsAreNamed) {
  const cumulet::test::Folder folder;
  PictureSettings settings;
  settings.file.path = (folder / "cloud.png").string();
  EXPECT_EQ(problem_of(settings), "");
  EXPECT_FALSE(std::filesystem::exists(settings.file.path));
  settings.width = 0;
  EXPECT_EQ(problem_of(settings), "Width and height must be from 1 to 16384");
  settings.width = 16384;
  EXPECT_EQ(problem_of(settings), "");
  settings.file.format = PictureFormat::webp;
  EXPECT_EQ(problem_of(settings), "Width and height must be from 1 to 16383");
  settings.width = 1920;
  settings.samples = 0;
  EXPECT_NE(problem_of(settings), "");
  settings.samples = 1;
  settings.sequence = true;
  EXPECT_EQ(problem_of(settings), "The file name needs #### for the number of the frame");
  settings.file.path = (folder / "cloud_####.webp").string();
  settings.range = {5, 3};
  EXPECT_EQ(problem_of(settings), "The first frame is after the last one");
  settings.range = {3, 5};
  EXPECT_EQ(problem_of(settings), "");
  settings.file.path = "/proc/nowhere/cloud_####.webp";
  EXPECT_NE(problem_of(settings), "");
}

TEST(PictureJobTest, HasTheChosenSettings) {
  SceneOptions scene;
  scene.display.denoise = CUMULET_DENOISE_FAST;
  scene.sampling.view = CUMULET_VIEW_CELLS;
  scene.light_groups = {"key", "fill"};
  PictureSettings settings;
  settings.width = 320;
  settings.height = 200;
  settings.samples = 12;
  settings.noise_percent = 2.0f;
  settings.time_limit = 30.0f;
  settings.file = {"a.exr", PictureFormat::exr, Denoise::fast, {CUMULET_AOV_VOLUME, CUMULET_AOV_NORMAL}, true};
  PictureJob made = job_of(settings, scene);
  EXPECT_EQ(made.scene.width, 320u);
  EXPECT_EQ(made.scene.height, 200u);
  EXPECT_EQ(made.scene.sampling.samples, 12u);
  EXPECT_EQ(made.scene.sampling.noise_target_percent, 2.0f);
  EXPECT_EQ(made.scene.sampling.view, CUMULET_VIEW_SHADED);
  EXPECT_EQ(made.scene.sampling.separate_volume_aov, 1);
  EXPECT_EQ(made.scene.sampling.light_groups, 2u);
  EXPECT_EQ(made.scene.display.denoise, CUMULET_DENOISE_OFF) << "the file is denoised separately";
  EXPECT_EQ(made.file, settings.file);
  EXPECT_EQ(made.time_limit, 30.0);
  EXPECT_FALSE(made.frames);
  settings.file.format = PictureFormat::png;
  settings.sequence = true;
  settings.range = {3, 5};
  made = job_of(settings, scene);
  EXPECT_TRUE(made.file.aovs.empty()) << "only EXR has layers";
  EXPECT_FALSE(made.file.cryptomatte);
  EXPECT_EQ(made.scene.sampling.separate_volume_aov, 0);
  EXPECT_EQ(made.frames, (PictureJob::Range{3, 5}));
}

}  // namespace
