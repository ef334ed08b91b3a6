#include "stage/asset_feed.hpp"

namespace cumulet::viewer {

void AssetFeed::request(const std::optional<BuildSettings>& settings) {
  set_settings(settings);
  if (settings) builder_->build(volume_, *settings);
}

void AssetFeed::build(const BuildSettings& settings, scene::GridPlanPtr before) {
  set_settings(settings);
  builder_->build(volume_, settings, std::move(before));
}

VolumeFeed::Taken AssetFeed::take(bool /*is_seen*/) {
  auto built = builder_->take_built();
  if (!built) return Taken::nothing;
  const bool is_former = built->volume != volume_;
  set_built(std::move(*built));
  return is_former ? Taken::former : Taken::other;
}

}  // namespace cumulet::viewer
