// Feeds of volumes: a volume in memory, a file, a sequence and a dynamic volume, as the viewer's own volume and as
// instances. Nothing needs GL.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "stage/dynamic_feed.hpp"
#include "stage/file_feed.hpp"
#include "stage/sequence_feed.hpp"
#include "support/clip.hpp"
#include "support/volumes.hpp"
#include "volume/memory.hpp"

namespace {

using namespace cumulet;
using test::Clip;
using viewer::as_asset;
using viewer::as_dynamic;
using viewer::as_sequence;
using viewer::AssetFeed;
using viewer::Builder;
using viewer::BuildSettings;
using viewer::DynamicFeed;
using viewer::FeedContext;
using viewer::FileFeed;
using viewer::JobContext;
using viewer::Live;
using viewer::LiveBuilder;
using viewer::SequenceFeed;
using viewer::VolumeFeedPtr;
using Suggestion = SequenceFeed::Suggestion;
using Taken = viewer::VolumeFeed::Taken;

constexpr std::uint64_t plenty = std::uint64_t{1} << 32U;

BuildSettings settings_of_scale(double density_scale) {
  BuildSettings settings;
  settings.refine.density_scale = density_scale;
  return settings;
}

class Feeds : public testing::Test {
 protected:
  [[nodiscard]] FeedContext context() {
    return {++last_feed_, last_taken_, [this] { ++notified_; }};
  }

  std::atomic<int> notified_ = 0;
  std::uint64_t last_feed_ = 0;
  std::uint64_t last_taken_ = 0;
};

// ---- sequences ----

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

// ---- dynamic volumes ----

class DynamicFeeds : public Feeds {
 protected:
  [[nodiscard]] std::shared_ptr<DynamicFeed> feed(const std::optional<BuildSettings>& settings = BuildSettings{}) {
    builder_ = std::make_shared<LiveBuilder>(JobContext{{}, [] {}});
    return std::make_shared<DynamicFeed>(live_, settings, builder_, context());
  }
  // Submits a state with this density. Waits until a grid is built, unless an earlier one has not been taken.
  void submit(float density) {
    constexpr int size = 8;
    const std::vector<float> values(std::size_t{size} * size * size, density);
    live_->set(
        std::vector<volume::MemoryField>{{volume::Channel::density, volume::DenseVoxels{values, {size, size, size}}}},
        "smoke");
    if (builder_) {
      EXPECT_TRUE(builder_->wait(std::nullopt));
    }
  }

  std::shared_ptr<Live> live_ = std::make_shared<Live>(std::nullopt);
  std::shared_ptr<LiveBuilder> builder_;
};

TEST_F(DynamicFeeds, HasNothingBeforeAState) {
  const auto it = feed();
  EXPECT_EQ(it->take(true), Taken::nothing);
  EXPECT_FALSE(it->frame());
  EXPECT_FALSE(it->built());
  EXPECT_FALSE(it->waits());
  EXPECT_FALSE(it->is_due());
  EXPECT_EQ(it->info(), nullptr);
  EXPECT_EQ(it->volume(), nullptr);
}

TEST_F(DynamicFeeds, TakesAState) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  ASSERT_TRUE(it->frame() && it->built());
  EXPECT_EQ(*it->frame(), (scene::SequenceFrame{1, it->id(), 1, 0.0}));
  ASSERT_NE(it->volume(), nullptr);
  EXPECT_EQ(it->built()->volume, it->volume());
  EXPECT_EQ(it->info(), it->volume()->volume_info());
  EXPECT_EQ(it->take(true), Taken::nothing);
}

TEST_F(DynamicFeeds, TakesAStateThatWasSubmittedBefore) {
  submit(1.0F);
  const auto it = feed();
  EXPECT_TRUE(builder_->wait(std::nullopt));
  EXPECT_EQ(it->take(true), Taken::other);
}

TEST_F(DynamicFeeds, KnownBoundsGiveMetadataOfAllStates) {
  live_ = std::make_shared<Live>(viewer::Bounds{glm::dvec3(-1.0, -2.0, -3.0), glm::dvec3(4.0, 5.0, 6.0)});
  const auto it = feed();
  const viewer::VolumeInfoPtr info = it->info();
  ASSERT_NE(info, nullptr);
  EXPECT_FALSE(info->empty);
  EXPECT_TRUE(info->may_emit);
  EXPECT_LT(glm::distance(info->bounds().min, glm::dvec3(-1.0, -2.0, -3.0)), 1e-12);
  EXPECT_LT(glm::distance(info->bounds().max, glm::dvec3(4.0, 5.0, 6.0)), 1e-12);
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->info(), info);
}

TEST_F(DynamicFeeds, MetadataIsThatOfTheLastState) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  const viewer::VolumeInfoPtr info = it->info();
  submit(2.0F);
  EXPECT_EQ(it->info(), info);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_NE(it->info(), info);
  EXPECT_FALSE(it->take_info());
}

TEST_F(DynamicFeeds, AStateWaitsUntilTheLastOneIsSeen) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  submit(2.0F);
  EXPECT_EQ(it->take(false), Taken::nothing);
  EXPECT_TRUE(it->waits());
  EXPECT_EQ(it->frame()->number, 1U);
  EXPECT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->waits());
  EXPECT_EQ(it->frame()->number, 2U);
}

TEST_F(DynamicFeeds, ATakenStateIsNotRenderedYet) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->is_rendered());
  it->note_rendered();
  EXPECT_TRUE(it->is_rendered());
  submit(2.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->is_rendered());
}

TEST_F(DynamicFeeds, StatusCountsStates) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  submit(2.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  submit(3.0F);
  const DynamicFeed::Status status = it->status();
  EXPECT_EQ(status.handed, 3U);
  EXPECT_EQ(status.ready, 2U);
  EXPECT_EQ(status.ready_count, 2U);
  EXPECT_EQ(status.drawn, 0U);
  EXPECT_EQ(status.displayed_count, 0U);
}

TEST_F(DynamicFeeds, EachDisplayedStateCountsOnce) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  it->note_displayed(*it->frame());
  it->note_displayed(*it->frame());
  EXPECT_EQ(it->status().drawn, 1U);
  EXPECT_EQ(it->status().displayed_count, 1U);
  submit(2.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->status().drawn, 1U);
  it->note_displayed(*it->frame());
  EXPECT_EQ(it->status().drawn, 2U);
  EXPECT_EQ(it->status().displayed_count, 2U);
}

TEST_F(DynamicFeeds, OtherSettingsRebuildTheState) {
  const auto it = feed();
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  const scene::MarchSourcePtr source = it->built()->source;
  BuildSettings dense;
  dense.march = scene::March::dense;
  it->request(dense);
  EXPECT_EQ(it->settings(), dense);
  EXPECT_TRUE(builder_->wait(std::nullopt));
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->frame()->number, 1U);
  EXPECT_EQ(it->frame()->taken, 2U);
  EXPECT_NE(it->built()->source, source);
}

TEST_F(DynamicFeeds, WithoutSettingsNothingIsBuilt) {
  const auto it = feed(std::nullopt);
  submit(1.0F);
  EXPECT_FALSE(builder_->busy());
  EXPECT_EQ(it->take(true), Taken::nothing);
  it->request(BuildSettings{});
  EXPECT_TRUE(builder_->wait(std::nullopt));
  EXPECT_EQ(it->take(true), Taken::other);
}

TEST_F(DynamicFeeds, NotifiesOfStatesWhileItExists) {
  auto it = feed();
  submit(1.0F);
  EXPECT_EQ(notified_, 1);
  it.reset();
  submit(2.0F);
  EXPECT_EQ(notified_, 1);
}

TEST_F(DynamicFeeds, MediaKeepTheirDensityScale) {
  const auto it = feed(settings_of_scale(123.0));
  submit(1.0F);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_FALSE(it->suggested_density_scale());
  EXPECT_EQ(it->built()->settings.refine.density_scale, 123.0);
}

TEST_F(DynamicFeeds, FeedsOfOneVolumeAreApart) {
  const auto a = feed();
  const auto builder = builder_;
  const auto b = feed();
  EXPECT_EQ(a->source(), live_.get());
  EXPECT_EQ(b->source(), live_.get());
  EXPECT_EQ(a->jobs(), builder);
  EXPECT_EQ(b->jobs(), builder_);
  submit(1.0F);
  EXPECT_TRUE(builder->wait(std::nullopt));
  ASSERT_EQ(b->take(true), Taken::other);
  ASSERT_EQ(a->take(true), Taken::other);
  EXPECT_NE(a->frame()->sequence, b->frame()->sequence);
  EXPECT_EQ(b->frame()->taken, 1U);
  EXPECT_EQ(a->frame()->taken, 2U);
}

TEST_F(DynamicFeeds, KindsAreToldApart) {
  const VolumeFeedPtr it = feed();
  EXPECT_EQ(as_dynamic(it), it.get());
  EXPECT_EQ(as_sequence(it), nullptr);
  EXPECT_EQ(as_dynamic(nullptr), nullptr);
  EXPECT_EQ(as_sequence(nullptr), nullptr);
}

// ---- volumes in memory, and files ----

class AssetFeeds : public Feeds {
 protected:
  static viewer::VolumeAssetPtr cloud(int seed = 1) {
    return std::make_shared<const viewer::VolumeAsset>(test::noise_volume({8, 8, 8}, glm::ivec3(0), seed));
  }
  [[nodiscard]] std::shared_ptr<AssetFeed> feed(const viewer::VolumeAssetPtr& volume) {
    return std::make_shared<AssetFeed>(volume, builder_, context());
  }
  [[nodiscard]] std::shared_ptr<FileFeed> feed(const std::string& path, bool suggests = false,
                                               const std::optional<BuildSettings>& settings = BuildSettings{}) {
    viewer::VolumeFile file;
    file.path = FilePath(path);
    file.suggested_density_scale = suggests;
    return std::make_shared<FileFeed>(file, settings, std::nullopt, builder_, context());
  }
  void wait() const { EXPECT_TRUE(builder_->wait(std::nullopt)); }

  std::shared_ptr<Builder> builder_ = std::make_shared<Builder>(JobContext{{}, [] {}});
  Clip clip_{1};
};

TEST_F(AssetFeeds, AreKnownBeforeTheyAreBuilt) {
  const viewer::VolumeAssetPtr volume = cloud();
  const auto it = feed(volume);
  EXPECT_EQ(it->volume(), volume);
  EXPECT_EQ(it->info(), volume->volume_info());
  EXPECT_EQ(it->source(), volume.get());
  EXPECT_FALSE(it->take_info());
  EXPECT_FALSE(it->built());
  EXPECT_EQ(it->take(true), Taken::nothing);
  EXPECT_EQ(as_asset(it), it.get());
  EXPECT_EQ(as_sequence(it), nullptr);
  EXPECT_EQ(as_dynamic(it), nullptr);
}

TEST_F(AssetFeeds, BuildAGridAtARequest) {
  const viewer::VolumeAssetPtr volume = cloud();
  const auto it = feed(volume);
  it->request(std::nullopt);  // it depends on a view
  wait();
  EXPECT_EQ(it->take(true), Taken::nothing);
  it->request(settings_of_scale(2.0));
  wait();
  ASSERT_EQ(it->take(false), Taken::other);
  EXPECT_EQ(it->built()->volume, volume);
  EXPECT_EQ(it->built()->settings, settings_of_scale(2.0));
  EXPECT_FALSE(it->frame());
  EXPECT_FALSE(it->waits());
  EXPECT_FALSE(it->is_due());
  EXPECT_EQ(it->take(false), Taken::nothing);
}

TEST_F(AssetFeeds, AGridOfAFormerVolumeIsTaken) {
  const viewer::VolumeAssetPtr first = cloud(1);
  feed(first)->request(BuildSettings{});
  wait();
  const auto it = feed(cloud(2));
  ASSERT_EQ(it->take(true), Taken::former);
  EXPECT_EQ(it->built()->volume, first);
  it->request(BuildSettings{});
  wait();
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->volume, it->volume());
}

TEST_F(AssetFeeds, FilesHaveNoVolumeUntilTheyAreRead) {
  const auto it = feed(clip_.path(0));
  EXPECT_EQ(it->volume(), nullptr);
  EXPECT_EQ(it->info(), nullptr);
  wait();
  ASSERT_TRUE(it->take_volume());
  EXPECT_FALSE(it->take_volume());
  ASSERT_NE(it->volume(), nullptr);
  EXPECT_FALSE(it->suggested_density_scale());
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->volume, it->volume());
  EXPECT_FALSE(it->proxy());
  EXPECT_FALSE(it->loads_after_proxy());
}

TEST_F(AssetFeeds, FilesSuggestADensityScaleOnce) {
  const auto it = feed(clip_.path(0), true, settings_of_scale(123.0));
  wait();
  ASSERT_TRUE(it->take_volume());
  const std::optional<double> scale = it->suggested_density_scale();
  ASSERT_TRUE(scale);
  ASSERT_EQ(it->take(true), Taken::other);
  EXPECT_EQ(it->built()->settings.refine.density_scale, *scale);
  EXPECT_EQ(it->take_suggestion(), scale);
  EXPECT_FALSE(it->suggested_density_scale());
  EXPECT_FALSE(it->take_suggestion());
}

TEST_F(AssetFeeds, AFileThatCannotBeReadGivesNothing) {
  clip_.corrupt(0);
  const auto it = feed(clip_.path(0));
  wait();
  EXPECT_FALSE(it->take_volume());
  EXPECT_EQ(it->take(true), Taken::nothing);
  EXPECT_TRUE(it->jobs()->status().failure);
}

}  // namespace
