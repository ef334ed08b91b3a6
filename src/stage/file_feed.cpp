#include "stage/file_feed.hpp"

#include <utility>

namespace cumulet::viewer {

FileFeed::FileFeed(const VolumeFile& file, const std::optional<BuildSettings>& settings,
                   const std::optional<BuildSettings>& proxy, std::shared_ptr<Builder> builder,
                   const FeedContext& context)
    : AssetFeed(nullptr, std::move(builder), context) {
  set_settings(settings);
  this->builder().load(file, settings, proxy);
}

bool FileFeed::take_volume() {
  auto loaded = builder().take_loaded();
  if (!loaded) return false;
  set_volume(std::move(loaded->volume));
  suggest(loaded->density_scale);
  return true;
}

bool FileFeed::take_proxy(bool is_wanted) {
  auto made = builder().take_proxy();
  if (!made || !is_wanted) return false;
  proxy_ = std::move(made);
  return true;
}

bool FileFeed::loads_after_proxy() const {
  // Check in this order: a job stores its result before it ends.
  return proxy_ && (!proxy_->load.expired() || builder().has_result());
}

}  // namespace cumulet::viewer
