// Feeds of volumes: a volume in memory, a file, a sequence and a dynamic volume, as the viewer's own volume and as
// instances. Nothing needs GL.

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stage/dynamic_feed.hpp"
#include "stage/file_feed.hpp"
#include "stage/sequence_feed.hpp"
#include "support/clip.hpp"
#include "support/volume_feeds.hpp"
#include "support/volumes.hpp"
#include "volume/memory.hpp"

namespace {

using namespace cumulet;
using test::Clip;
using test::Feeds;
using test::settings_of_scale;
using viewer::as_asset;
using viewer::as_dynamic;
using viewer::as_sequence;
using viewer::AssetFeed;
using viewer::Builder;
using viewer::BuildSettings;
using viewer::DynamicFeed;
using viewer::FileFeed;
using viewer::JobContext;
using viewer::Live;
using viewer::LiveBuilder;
using viewer::VolumeFeedPtr;
using Taken = viewer::VolumeFeed::Taken;

// ---- sequences ----

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
