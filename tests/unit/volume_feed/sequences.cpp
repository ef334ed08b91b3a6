// Feeds of sequences.

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "stage/dynamic_feed.hpp"
#include "stage/file_feed.hpp"
#include "stage/sequence_feed.hpp"
#include "support/clip.hpp"
#include "support/volume_feeds.hpp"
#include "support/volumes.hpp"

namespace {

using namespace cumulet;
using test::Clip;
using test::Feeds;
using test::plenty;
using test::settings_of_scale;
using viewer::BuildSettings;
using viewer::JobContext;
using viewer::SequenceFeed;
using Suggestion = SequenceFeed::Suggestion;
using Taken = viewer::VolumeFeed::Taken;

class SequenceFeeds : public Feeds {
 protected:
  explicit SequenceFeeds(int count = 3) : count_(count), clip_(count) {}

  [[nodiscard]] std::shared_ptr<viewer::Sequence> sequence(bool suggests = false,
                                                           const scene::Playback& playback = {}) const {
    viewer::FrameFiles files{clip_.paths(), {}};
    files.shown.suggested_density_scale = suggests;
    viewer::SequenceState state;
    state.playback = playback;
    state.playback.count = static_cast<std::uint32_t>(count_);
    state.memory_bytes = plenty;
    return std::make_shared<viewer::Sequence>(std::make_shared<const viewer::FrameFiles>(files), state);
  }
  [[nodiscard]] std::shared_ptr<SequenceFeed> feed(const std::shared_ptr<viewer::Sequence>& sequence,
                                                   const std::optional<BuildSettings>& settings = BuildSettings{},
                                                   Suggestion suggestion = Suggestion::ignored) {
    return std::make_shared<SequenceFeed>(sequence, settings,
                                          std::make_shared<viewer::FrameCache>(JobContext{{}, [] {}}), suggestion,
                                          std::make_shared<const viewer::ResourceLimits>(), context());
  }
  // Sends the request and waits for its result, which is not taken.
  static void wait(SequenceFeed& feed) {
    EXPECT_EQ(feed.take(false), Taken::nothing);
    EXPECT_TRUE(feed.cache().wait(std::nullopt));
  }

  int count_;
  Clip clip_;
};

class SequenceFeedsOfOneFrame : public SequenceFeeds {
 protected:
  SequenceFeedsOfOneFrame() : SequenceFeeds(1) {}
};

TEST_F(SequenceFeeds, TakesTheCurrentFrame) {
  const auto it = feed(sequence());
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  ASSERT_TRUE(it->frame() && it->built());
  EXPECT_EQ(*it->frame(), (scene::SequenceFrame{0, it->id(), 1, 0.0}));
  EXPECT_NE(it->built()->source, nullptr);
  EXPECT_NE(it->volume(), nullptr);
  EXPECT_EQ(it->built()->volume, it->volume());
}

TEST_F(SequenceFeeds, HasNothingAtFirst) {
  const auto it = feed(sequence());
  EXPECT_FALSE(it->frame());
  EXPECT_FALSE(it->built());
  EXPECT_FALSE(it->is_rendered());
  EXPECT_FALSE(it->waits());
  EXPECT_EQ(it->info(), nullptr);
  EXPECT_EQ(it->volume(), nullptr);
  EXPECT_TRUE(it->is_due());
}

TEST_F(SequenceFeeds, AFrameWaitsUntilTheLastOneIsSeen) {
  const auto clip = sequence();
  const auto it = feed(clip);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  clip->set_position(2.0);
  wait(*it);
  EXPECT_EQ(it->take(false), Taken::nothing);
  EXPECT_TRUE(it->waits());
  EXPECT_EQ(it->frame()->number, 0U);
  EXPECT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->frame()->number, 2U);
}

TEST_F(SequenceFeeds, ATakenFrameIsNotRenderedYet) {
  const auto clip = sequence();
  const auto it = feed(clip);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->is_rendered());
  it->note_rendered();
  EXPECT_TRUE(it->is_rendered());
  clip->set_position(1.0);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->is_rendered());
}

TEST_F(SequenceFeedsOfOneFrame, NothingIsDueOnceTheFinalFrameIsTaken) {
  const auto it = feed(sequence());
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->is_due());
  EXPECT_FALSE(it->waits());
  EXPECT_EQ(it->take(true), Taken::nothing);
}

TEST_F(SequenceFeedsOfOneFrame, ARenewedRequestGivesTheSameGrid) {
  const auto it = feed(sequence());
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  const scene::SequenceFrame taken = *it->frame();
  const scene::MarchSourcePtr source = it->built()->source;
  it->note_rendered();
  it->renew_request();
  EXPECT_EQ(it->take(true), Taken::same);
  EXPECT_EQ(*it->frame(), taken);
  EXPECT_EQ(it->built()->source, source);
  EXPECT_TRUE(it->is_rendered());
}

TEST_F(SequenceFeedsOfOneFrame, OtherSettingsGiveAnotherGridOfTheFrame) {
  const auto it = feed(sequence());
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  const scene::MarchSourcePtr source = it->built()->source;
  BuildSettings dense;
  dense.march = scene::March::dense;
  it->request(dense);
  EXPECT_EQ(it->settings(), dense);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->frame()->number, 0U);
  EXPECT_EQ(it->frame()->taken, 2U);
  EXPECT_NE(it->built()->source, source);
  EXPECT_EQ(it->built()->settings, dense);
}

TEST_F(SequenceFeedsOfOneFrame, OldGridsStayWhileOthersAreBuilt) {
  const auto it = feed(sequence());
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  const scene::MarchSourcePtr source = it->built()->source;
  BuildSettings dense;
  dense.march = scene::March::dense;
  it->request(dense);
  EXPECT_EQ(it->take(false), Taken::nothing);
  EXPECT_EQ(it->built()->source, source);
}

TEST_F(SequenceFeeds, IsAnalyzedWithoutSettings) {
  const auto it = feed(sequence(), std::nullopt);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  ASSERT_NE(it->info(), nullptr);
  EXPECT_FALSE(it->info()->empty);
  EXPECT_EQ(it->take(true), Taken::nothing);
  it->request(BuildSettings{});
  wait(*it);
  EXPECT_EQ(it->take(true), Taken::other);
}

TEST_F(SequenceFeeds, MetadataIsTakenOnce) {
  const auto it = feed(sequence());
  EXPECT_FALSE(it->take_info());
  wait(*it);
  ASSERT_TRUE(it->take_info());
  const viewer::VolumeInfoPtr info = it->info();
  EXPECT_FALSE(it->take_info());
  EXPECT_EQ(it->info(), info);
}

TEST_F(SequenceFeeds, MetadataIsThatOfAllFrames) {
  const auto clip = sequence();
  const auto it = feed(clip);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  const viewer::VolumeInfoPtr info = it->info();
  clip->set_position(2.0);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->info(), info);
}

TEST_F(SequenceFeeds, TheViewersOwnUsesTheSuggestedDensityScale) {
  const auto it = feed(sequence(true), settings_of_scale(123.0), Suggestion::used_if_asked);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  const auto scale = it->suggested_density_scale();
  ASSERT_TRUE(scale);
  EXPECT_EQ(it->status(std::nullopt).density_scale, scale);
  ASSERT_TRUE(it->settings());
  EXPECT_EQ(it->settings()->refine.density_scale, *scale);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->settings.refine.density_scale, *scale);
}

TEST_F(SequenceFeeds, TheSuggestionIsUsedOnlyIfItIsAskedFor) {
  const auto it = feed(sequence(false), settings_of_scale(123.0), Suggestion::used_if_asked);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  EXPECT_FALSE(it->suggested_density_scale());
  EXPECT_TRUE(it->status(std::nullopt).density_scale);
  EXPECT_EQ(it->settings(), settings_of_scale(123.0));
}

TEST_F(SequenceFeeds, InstancesIgnoreTheSuggestion) {
  const auto it = feed(sequence(true), settings_of_scale(123.0), Suggestion::ignored);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  EXPECT_FALSE(it->suggested_density_scale());
  EXPECT_EQ(it->settings(), settings_of_scale(123.0));
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->settings.refine.density_scale, 123.0);
}

TEST_F(SequenceFeeds, TheSuggestionNeedsNoSettings) {
  const auto it = feed(sequence(true), std::nullopt, Suggestion::used_if_asked);
  wait(*it);
  ASSERT_TRUE(it->take_info());
  EXPECT_TRUE(it->suggested_density_scale());
  EXPECT_FALSE(it->settings());
}

TEST_F(SequenceFeeds, NotifiesOfChangesWhileItExists) {
  const auto clip = sequence();
  auto it = feed(clip);
  clip->set_position(1.0);
  EXPECT_EQ(notified_, 1);
  it.reset();
  clip->set_position(2.0);
  EXPECT_EQ(notified_, 1);
}

TEST_F(SequenceFeeds, StatusFollowsTheClockOfTheLastRequest) {
  const auto clip = sequence();
  const auto it = feed(clip);
  wait(*it);
  EXPECT_EQ(it->status(std::nullopt).asked, 0U);
  clip->set_position(2.0);
  wait(*it);
  const SequenceFeed::Status status = it->status(std::nullopt);
  EXPECT_EQ(status.asked, 2U);
  EXPECT_EQ(status.requested_position, 2.0);
  EXPECT_FALSE(status.drawn);
  EXPECT_EQ(status.frames.frames.size(), 3U);
}

TEST_F(SequenceFeeds, StatusHasTheDisplayedStep) {
  const auto it = feed(sequence());
  wait(*it);
  EXPECT_EQ(it->status(scene::SequenceFrame{2, it->id(), 1, 0.5}).drawn, 2.5);
}

TEST_F(SequenceFeeds, StepsBetweenFramesHaveAPart) {
  scene::Playback playback;
  playback.between = scene::Between::blend;
  playback.steps = 2;
  const auto clip = sequence(false, playback);
  const auto it = feed(clip);
  clip->set_position(0.5);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->frame()->number, 0U);
  EXPECT_EQ(it->frame()->part, 0.5);
}

TEST_F(SequenceFeeds, AnEarlierFrameReplacesABrokenOne) {
  clip_.corrupt(1);
  const auto clip = sequence();
  const auto it = feed(clip);
  clip->set_position(1.0);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->frame()->number, 0U);
  EXPECT_TRUE(it->cache().failure_of(1));
  EXPECT_FALSE(it->cache().failure_of(0));
}

TEST_F(SequenceFeedsOfOneFrame, ABrokenSequenceGivesNothing) {
  clip_.corrupt(0);
  const auto it = feed(sequence());
  wait(*it);
  EXPECT_FALSE(it->take_info());
  EXPECT_EQ(it->take(true), Taken::nothing);
  EXPECT_EQ(it->info(), nullptr);
  EXPECT_TRUE(it->cache().failure_of(0));
}

TEST_F(SequenceFeedsOfOneFrame, TheShutterHasTheTimeOfTheSequence) {
  scene::Playback playback;
  playback.velocity_scale = 2.0;
  BuildSettings settings;
  settings.shutter_seconds = 0.5;
  const auto it = feed(sequence(false, playback), settings);
  wait(*it);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->settings.shutter_seconds, 1.0);
  EXPECT_EQ(it->settings(), settings);
}

TEST_F(SequenceFeedsOfOneFrame, FeedsOfOneSequenceAreApart) {
  const auto clip = sequence();
  const auto a = feed(clip);
  const auto b = feed(clip);
  EXPECT_EQ(a->source(), clip.get());
  EXPECT_EQ(b->source(), clip.get());
  EXPECT_NE(a->jobs(), b->jobs());
  for (const auto& it : {a, b}) {
    wait(*it);
    ASSERT_EQ(it->take(true), Taken::other);
  }
  EXPECT_NE(a->frame()->sequence, b->frame()->sequence);
  EXPECT_EQ(a->frame()->taken, 1U);
  EXPECT_EQ(b->frame()->taken, 2U);
}

}  // namespace
