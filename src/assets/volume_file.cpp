#include "assets/volume_file.hpp"

#include <memory>
#include <utility>

#include "base/error.hpp"

namespace cumulet::viewer {

namespace {

void transform(volume::VolumeFrame& frame, const glm::dmat4& to_world) {
  for (volume::ScalarVolume* field : frame.fields()) field->index_to_world = to_world * field->index_to_world;
}

}  // namespace

VolumeAssetPtr VolumeFile::read(const Log& log, Progress* progress) const { return read(log, progress, {}); }

VolumeAssetPtr VolumeFile::read(const Log& log, Progress* progress,
                                const std::function<void(volume::Proxy)>& take_proxy) const {
  const auto take = [&](volume::Proxy made) {
    transform(made.frame, to_world);
    if (made.extent) made.extent->index_to_world = to_world * made.extent->index_to_world;
    take_proxy(std::move(made));
  };
  volume::VolumeFrame frame = take_proxy ? volume::import_frame(path, grids, log, progress, {take, min_proxy_bricks})
                                         : volume::import_frame(path, grids, log, progress);
  return asset_of(std::move(frame), progress);
}

VolumeAssetPtr VolumeFile::read_content(std::unique_ptr<ByteSource> content, const Log& log) const {
  return asset_of(volume::import_frame(std::move(content), path.given(), grids, log), nullptr);
}

VolumeAssetPtr VolumeFile::asset_of(volume::VolumeFrame frame, Progress* progress) const {
  transform(frame, to_world);
  frame.temperature_scale = temperature_scale;
  try {
    return std::make_shared<const VolumeAsset>(std::move(frame), progress);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::cancelled) throw;
    throw Error(e.code(), path.given() + ": " + e.what());
  }
}

}  // namespace cumulet::viewer
