#include "viewer/volume_asset.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "base/apart.hpp"
#include "grid/cube.hpp"
#include "viewer/patient_lock.hpp"

namespace cumulet::viewer {

namespace {

// Of voxels, inclusive.
struct Box {
  glm::ivec3 low{std::numeric_limits<int>::max()};
  glm::ivec3 high{std::numeric_limits<int>::min()};

  void add(const volume::ScalarVolume& field) {
    if (field.empty()) return;
    low = glm::min(low, field.bounds_min);
    high = glm::max(high, field.bounds_max);
  }
  [[nodiscard]] bool empty() const { return low.x > high.x; }
};

}  // namespace

VolumeAsset::VolumeAsset(volume::VolumeFrame frame, const Progress* progress)
    : frame_(make_left<const volume::VolumeFrame>(std::move(frame))) {
  const volume::ScalarVolume& density = frame_->density;
  const auto is_there = [](const auto& field) { return field && !field->empty(); };
  Box shown;
  shown.add(density);
  if (frame_->flame) shown.add(*frame_->flame);
  Box all = shown;
  if (frame_->temperature) all.add(*frame_->temperature);
  if (shown.empty()) shown = all;
  const bool empty = all.empty();
  if (empty) shown = all = {density.bounds_min, density.bounds_max};
  cube_ = grid::fit_cube(density, all.low, all.high);
  VolumeFacts facts{.empty = empty,
                    .may_emit = is_there(frame_->flame) || is_there(frame_->temperature),
                    .low = shown.low,
                    .high = shown.high,
                    .index_to_world = density.index_to_world,
                    .anisotropy_grid = {},
                    .coarse = volume::CoarseVolume(density, progress)};
  if (frame_->anisotropy) facts.anisotropy_grid = (*frame_->anisotropy)[0].name;
  facts_ = std::make_shared<const VolumeFacts>(std::move(facts));
}

std::uint64_t VolumeAsset::bytes() const {
  std::uint64_t bytes = frame_->density.bytes();
  for (const volume::ScalarVolume* field : frame_->beside_density()) bytes += field->bytes();
  const std::scoped_lock lock(mutex_);
  if (statistics_) bytes += statistics_->bytes();
  if (ramped_) bytes += ramped_->density.voxels->bytes() + ramped_->density.statistics->bytes();
  if (latticed_) bytes += latticed_->lattice->bytes();
  grid::Channels made;
  if (glowing_) made.emission = glowing_->emission;
  if (weighted_) {
    made.scattering = weighted_->scattering;
    made.momentum = weighted_->momentum;
    made.forward = weighted_->forward.value_or(nullptr);
  }
  bytes += made.bytes();
  return bytes;
}

const volume::ScalarVolume& VolumeAsset::main_field() const {
  if (!frame_->density.empty()) return frame_->density;
  if (frame_->flame && !frame_->flame->empty()) return *frame_->flame;
  return frame_->temperature && !frame_->temperature->empty() ? *frame_->temperature : frame_->density;
}

VolumeAsset::Density VolumeAsset::density(const volume::Ramp& ramp, Progress& progress, double& seconds) const {
  using Clock = std::chrono::steady_clock;
  seconds = 0.0;
  progress.begin(Progress::Stage::statistics);
  const auto lock = patient_lock(computing_, progress);
  const auto start = Clock::now();
  const auto statistics_of = [&](const volume::ScalarVolume& voxels) {
    auto made = make_left<const grid::Statistics>(voxels, cube_, &progress);
    seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return made;
  };
  if (ramp.empty()) {
    if (!statistics_) put(statistics_, statistics_of(frame_->density));
    return {{frame_, &frame_->density}, statistics_};
  }
  if (!ramped_ || ramped_->ramp != ramp) {
    drop(ramped_);
    const auto voxels = make_left<const volume::ScalarVolume>(volume::apply(ramp, frame_->density, &progress));
    put(ramped_, Ramped{ramp, {voxels, statistics_of(*voxels)}});
  }
  return ramped_->density;
}

grid::LatticePtr VolumeAsset::lattice(const volume::Ramp& ramp, const grid::Channels& channels,
                                      const grid::RefineSettings& refine, Progress& progress) const {
  // The same for all views and budgets.
  const grid::RefineSettings any_view;
  grid::RefineSettings of = refine;
  of.camera.reset();
  of.pixel_size = any_view.pixel_size;
  of.max_cells = any_view.max_cells;
  if (of.criterion != grid::Criterion::transmittance) {
    // No other knows of the medium.
    of.density_scale = any_view.density_scale;
    of.anisotropy = any_view.anisotropy;
  }
  double seconds = 0.0;
  const Density field = density(ramp, progress, seconds);
  progress.begin(Progress::Stage::refining);
  const auto lock = patient_lock(computing_, progress);
  if (!latticed_ || latticed_->ramp != ramp || latticed_->channels != channels || latticed_->refine != of) {
    drop(latticed_);
    put(latticed_,
        Latticed{ramp, channels, of,
                 make_left<const grid::Lattice>(*field.statistics, channels, of, field.voxels->max_value, &progress)});
  }
  return latticed_->lattice;
}

grid::Channels VolumeAsset::channels(const volume::Ramp& density_ramp, const scene::Emission& emission,
                                     bool anisotropic, Progress& progress, const Log& log) const {
  scene::Emission given = emission;
  // What has a temperature alone would be nothing.
  const bool alone = frame_->density.empty() && (!frame_->flame || frame_->flame->empty());
  if (given.blackbody == 0.0 && alone) given.blackbody = 1.0;
  const auto field = [&]<class Field>(std::type_identity<Field>, auto values) {
    return values ? make_left<const Field>(*std::move(values), cube_, &progress) : nullptr;
  };
  constexpr std::type_identity<grid::RgbField> colours;
  constexpr std::type_identity<grid::ScalarField> numbers;
  constexpr std::type_identity<grid::MomentumField> motion;
  const auto lock = patient_lock(computing_, progress);
  if (!glowing_ || glowing_->settings != given) {
    drop(latticed_);  // it holds them
    drop(glowing_);
    put(glowing_, Glowing{given, field(colours, scene::emission_of(*frame_, given, &progress))});
  }
  if (!weighted_ || weighted_->density_ramp != density_ramp) {
    drop(latticed_);
    drop(weighted_);
    put(weighted_, Weighted{density_ramp, field(colours, scene::scattering_of(*frame_, density_ramp, &progress)),
                            field(motion, scene::momentum_of(*frame_, density_ramp, &progress, log)), std::nullopt});
  }
  if (anisotropic && !weighted_->forward)
    put(weighted_->forward, field(numbers, scene::forward_of(*frame_, density_ramp, &progress)));
  return {glowing_->emission, weighted_->scattering, anisotropic ? *weighted_->forward : nullptr, weighted_->momentum};
}

}  // namespace cumulet::viewer
