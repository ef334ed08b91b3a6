#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "jobs/builder.hpp"
#include "stage/volume_feed.hpp"

namespace cumulet::viewer {

/// A volume in main memory, for which a Builder builds grids. All feeds of a viewer's own volumes use one builder, so a
/// grid may be that of an earlier volume.
class AssetFeed : public VolumeFeed {
 public:
  /// volume: not null. The grid is built at the first request().
  AssetFeed(VolumeAssetPtr volume, std::shared_ptr<Builder> builder, const FeedContext& context)
      : VolumeFeed(context), volume_(std::move(volume)), builder_(std::move(builder)) {}

  void request(const std::optional<BuildSettings>& settings) override;
  /// Requests a grid. before: as in Builder::build().
  void build(const BuildSettings& settings, scene::GridPlanPtr before);
  bool take_info() override { return false; }  // it is known before
  /// is_seen: ignored, because nothing is played.
  Taken take(bool is_seen) override;
  [[nodiscard]] bool waits() const override { return false; }
  [[nodiscard]] bool is_due() const override { return false; }
  [[nodiscard]] VolumeInfoPtr info() const override { return volume_ ? volume_->volume_info() : nullptr; }
  [[nodiscard]] VolumeAssetPtr volume() const override { return volume_; }
  [[nodiscard]] const void* source() const override { return volume_.get(); }
  [[nodiscard]] std::shared_ptr<JobSource> jobs() const override { return builder_; }

 protected:
  void set_volume(VolumeAssetPtr volume) { volume_ = std::move(volume); }
  [[nodiscard]] Builder& builder() const { return *builder_; }

 private:
  VolumeAssetPtr volume_;  // null: a file that is being read
  std::shared_ptr<Builder> builder_;
};

/// Returns the feed if it is that of a volume in main memory, else null.
[[nodiscard]] inline AssetFeed* as_asset(const VolumeFeedPtr& feed) { return dynamic_cast<AssetFeed*>(feed.get()); }

}  // namespace cumulet::viewer
