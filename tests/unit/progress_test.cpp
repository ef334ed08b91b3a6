// Lines of cumulet-render about its progress, and its timeline.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <timeline.hpp>
#include <vector>

#include "early_pictures.hpp"
#include "held_lines.hpp"
#include "progress.hpp"

namespace {

using namespace cumulet::demo;

TEST(Progress, RatesAreHiddenUntilMeasurable) {
  // Time before the first line was not measured.
  EXPECT_EQ(rendering_line(0.5, 0.0, 1e9, 0.0), "rendering [############............] 50 %");
  EXPECT_EQ(rendering_line(0.5, 0.01, 1e7, 1e-9), "rendering [############............] 50 %");
  EXPECT_EQ(rendering_line(0.0, 0.0, 0.0, 10.0), "rendering [........................] 0 %");
  EXPECT_EQ(rendering_line(0.5, 0.25, 1e6, 10.0),
            "rendering [############............] 50 %  100 ksamples/s  ETA 0:20");
  EXPECT_NE(rendering_line(1.0, 1.0, 5e13, 10.0).find("5 Tsamples/s"), std::string::npos);
}

TEST(Progress, CountsTowardTheNearestLimit) {
  EXPECT_EQ(part_done(0.3, 9.0, std::nullopt), 0.3);
  EXPECT_EQ(part_done(0.3, 6.0, 10.0), 0.6) << "the time";
  EXPECT_EQ(part_done(0.8, 6.0, 10.0), 0.8) << "the noise, or the samples";
  EXPECT_EQ(part_done(0.8, 11.0, 10.0), 1.0);
}

TEST(Progress, LastLineGivesTheReasonForStopping) {
  EXPECT_EQ(ending_line(Ending::noise, 0.01874, 91.0, 2.0, std::nullopt, 42.0),
            "noise 1.87 % (target 2 %) after 91 samples per pixel in 0:42");
  EXPECT_EQ(ending_line(Ending::samples, 0.024, 64.0, 2.0, 30.0, 42.0),
            "noise 2.4 % (target 2 %) after 64 samples per pixel in 0:42, the maximum");
  EXPECT_EQ(ending_line(Ending::time, 0.1, 10.26, 0.0, 30.0, 30.0),
            "noise 10 % after 10.26 samples per pixel in 0:30, stopped at the time limit of 30 s");
  EXPECT_EQ(ending_line(Ending::samples, std::nullopt, 1.0, 2.0, std::nullopt, 42.0),
            "noise unknown (target 2 %) after 1 sample per pixel in 0:42, the maximum");
  EXPECT_EQ(ending_line(Ending::noise, 0.0, 16.0, 2.0, std::nullopt, 42.0),
            "noise 0 % (target 2 %) after 16 samples per pixel in 0:42")
      << "a black picture has none";
  EXPECT_EQ(ending_line(Ending::samples, 0.031, 64.0, 0.0, std::nullopt, 65.0),
            "noise 3.1 % after 64 samples per pixel in 1:05");
}

TEST(EarlyPictures, AreWrittenAtGrowingIntervals) {
  EarlyPictures pictures(10.0);
  EXPECT_FALSE(pictures.due(9.9));
  EXPECT_TRUE(pictures.due(10.0));
  pictures.written(11.0);
  EXPECT_FALSE(pictures.due(21.0));
  EXPECT_TRUE(pictures.due(22.0)) << "twice the time of the last one";
  EXPECT_FALSE(EarlyPictures(std::nullopt).due(1e9));
}

TEST(HeldLines, FailureIsPrintedOnceAndInOrder) {
  HeldLines lines;
  EXPECT_EQ(lines.take(CUMULET_LOG_WARNING, "one"), "warning: one");
  lines.hold();
  EXPECT_FALSE(lines.take(CUMULET_LOG_WARNING, "a.3.vdb: it is not there: another frame is shown instead"));
  EXPECT_FALSE(lines.take(CUMULET_LOG_ERROR, "two\nlines"));
  EXPECT_FALSE(lines.take(CUMULET_LOG_WARNING, "three"));
  EXPECT_EQ(lines.release("a.3.vdb: it is not there"),
            (std::vector<std::string>{"error: two lines", "warning: three"}));
  EXPECT_EQ(lines.take(CUMULET_LOG_WARNING, "four"), "warning: four");
  lines.hold();
  EXPECT_FALSE(lines.take(CUMULET_LOG_WARNING, "five"));
  EXPECT_EQ(lines.release(), std::vector<std::string>{"warning: five"});
  EXPECT_TRUE(lines.release().empty());
}

TEST(Timeline, IsJsonThatChromeReads) {
  cumulet::demo::Timeline timeline;
  EXPECT_EQ(nlohmann::json::parse(timeline.json())["traceEvents"].size(), 0U);
  cumulet::demo::Timeline::add(&timeline, "a \"name\"\xff", 2.0, 2.5);
  cumulet::demo::Timeline::add(&timeline, "frame", 1.0, 3.0);
  const auto events = nlohmann::json::parse(timeline.json())["traceEvents"];
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0]["ph"], "X");
  EXPECT_EQ(events[0]["ts"], 2e6);
  EXPECT_EQ(events[0]["dur"], 5e5);
  EXPECT_EQ(events[1]["name"], "frame");
  EXPECT_EQ(events[0]["tid"], events[1]["tid"]);
}

}  // namespace
