#include "viewer/volume_asset.hpp"

#include <chrono>

#include "grid/cube.hpp"
#include "viewer/patient_lock.hpp"

namespace cumulet::viewer {

VolumeAsset::VolumeAsset(volume::ScalarVolume volume) : volume_(std::move(volume)) {
  grid::fit_cube(volume_);
  for (int corner = 0; corner < 8; ++corner) {
    glm::dvec3 p(volume_.bounds_min);
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = ((corner >> axis) & 1) != 0 ? volume_.bounds_max[axis] + 0.5 : volume_.bounds_min[axis] - 0.5;
    }
    const glm::dvec3 world(volume_.index_to_world * glm::dvec4(p, 1.0));
    bounds_.min = corner == 0 ? world : glm::min(bounds_.min, world);
    bounds_.max = corner == 0 ? world : glm::max(bounds_.max, world);
  }
}

std::shared_ptr<const grid::Statistics> VolumeAsset::statistics(Progress& progress, double& seconds) const {
  seconds = 0.0;
  progress.begin(Progress::Stage::statistics);
  const auto lock = patient_lock(mutex_, progress);
  if (!statistics_) {
    const auto start = std::chrono::steady_clock::now();
    statistics_ = std::make_shared<const grid::Statistics>(volume_, grid::fit_cube(volume_), &progress);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return statistics_;
}

}  // namespace cumulet::viewer
