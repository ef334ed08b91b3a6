#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>

#include "assets/volume_asset.hpp"
#include "base/byte_source.hpp"
#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "volume/frame_import.hpp"

namespace cumulet::viewer {

/// A volume file, the grids to show, and its transform.
struct VolumeFile {
  FilePath path;
  volume::GridNames grids;
  glm::dmat4 to_world{1.0};              ///< affine, from the file's own world space
  bool suggested_density_scale = false;  ///< the medium uses the density scale suggested for the volume
  /// As VolumeFrame::temperature_scale.
  std::optional<double> temperature_scale = {};
  /// Minimum number of bricks for which a low-resolution proxy is made; tests use other values.
  std::uint64_t min_proxy_bricks = volume::worth_a_proxy;

  /// Throws the errors of import_frame() and of VolumeAsset's constructor.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress) const;
  /// take_proxy: receives the low-resolution proxy from import_frame(), transformed by to_world.
  [[nodiscard]] VolumeAssetPtr read(const Log& log, Progress* progress,
                                    const std::function<void(volume::Proxy)>& take_proxy) const;
  /// Reads the content in place of the file; the path is the name in messages.
  [[nodiscard]] VolumeAssetPtr read_content(std::unique_ptr<ByteSource> content, const Log& log) const;

 private:
  [[nodiscard]] VolumeAssetPtr asset_of(volume::VolumeFrame frame, Progress* progress) const;
};

}  // namespace cumulet::viewer
