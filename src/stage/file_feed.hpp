#pragma once

#include <memory>
#include <optional>

#include "assets/volume_file.hpp"
#include "stage/asset_feed.hpp"

namespace cumulet::viewer {

/// A volume that is read from a file. It has no volume until it was read, and may have a low-resolution proxy until its
/// grid is built. It shares a Builder with the feed that is shown meanwhile.
class FileFeed : public AssetFeed {
 public:
  /// Starts reading. settings, proxy: as in Builder::load().
  FileFeed(const VolumeFile& file, const std::optional<BuildSettings>& settings,
           const std::optional<BuildSettings>& proxy, std::shared_ptr<Builder> builder, const FeedContext& context);

  /// Takes the volume. Returns true if it has been read since the last call.
  bool take_volume();
  /// Takes the proxy, if there is one. is_wanted: it is kept. Returns true if there is another one now.
  bool take_proxy(bool is_wanted);
  /// Nullopt: none.
  [[nodiscard]] const std::optional<Proxy>& proxy() const { return proxy_; }
  void drop_proxy() { proxy_.reset(); }
  /// True if the load that made the proxy is running, or its results have not been taken.
  [[nodiscard]] bool loads_after_proxy() const;

 private:
  std::optional<Proxy> proxy_;
};

}  // namespace cumulet::viewer
