#include "viewer/volume_asset.hpp"

#include <chrono>

#include "base/apart.hpp"
#include "grid/cube.hpp"
#include "viewer/patient_lock.hpp"

namespace cumulet::viewer {

VolumeAsset::VolumeAsset(volume::ScalarVolume volume, const Progress* progress)
    : volume_(make_left<const volume::ScalarVolume>(std::move(volume))), coarse_(*volume_, progress) {
  grid::fit_cube(*volume_);
  bounds_ = world_bounds(volume_->bounds_min, volume_->bounds_max, volume_->index_to_world);
}

std::shared_ptr<const grid::Statistics> VolumeAsset::statistics(Progress& progress, double& seconds) const {
  seconds = 0.0;
  progress.begin(Progress::Stage::statistics);
  const auto lock = patient_lock(mutex_, progress);
  if (!statistics_) {
    const auto start = std::chrono::steady_clock::now();
    statistics_ = make_left<const grid::Statistics>(*volume_, grid::fit_cube(*volume_), &progress);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return statistics_;
}

}  // namespace cumulet::viewer
