#pragma once

#include <memory>
#include <mutex>

#include "base/progress.hpp"
#include "grid/statistics.hpp"
#include "viewer/bounds.hpp"
#include "volume/optical_depth.hpp"
#include "volume/volume.hpp"

namespace cumulet::viewer {

/// A volume and what is computed of it once, however many viewers show it. Immutable to its users; any thread.
class VolumeAsset {
 public:
  /// Throws Error(unsupported) for what no control cube holds.
  explicit VolumeAsset(volume::ScalarVolume volume, const Progress* progress = nullptr);

  [[nodiscard]] const volume::ScalarVolume& volume() const { return *volume_; }
  /// World bounds of the active voxels.
  [[nodiscard]] const Bounds& bounds() const { return bounds_; }
  [[nodiscard]] const volume::CoarseVolume& coarse() const { return coarse_; }
  /// The first caller computes them; others wait, and if the first is cancelled the next one computes them. seconds
  /// receives what computing took, 0 if they were there. Throws Error(cancelled) if this caller's progress is.
  [[nodiscard]] std::shared_ptr<const grid::Statistics> statistics(Progress& progress, double& seconds) const;

 private:
  std::shared_ptr<const volume::ScalarVolume> volume_;
  volume::CoarseVolume coarse_;
  Bounds bounds_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const grid::Statistics> statistics_;
};

using VolumeAssetPtr = std::shared_ptr<const VolumeAsset>;

}  // namespace cumulet::viewer
