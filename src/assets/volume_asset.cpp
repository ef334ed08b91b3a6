#include "assets/volume_asset.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "assets/patient_lock.hpp"
#include "base/detached_work.hpp"
#include "grid/cube.hpp"
#include "volume/advection.hpp"
#include "volume/value_unit.hpp"

namespace cumulet::viewer {

namespace {

// True if the frame's voxels are in main memory and have channels that are averaged with the density as weight.
bool is_weighted(const volume::VolumeFrame& frame, const scene::DensityRamps& ramps, bool in_gl) {
  return !in_gl && (frame.color || frame.anisotropy || frame.velocity || !ramps.colors.empty());
}

// Returns the mean with the momentum of another frame; nullopt if either has none.
std::optional<grid::MomentumField::Values> mean_momentum(std::optional<grid::MomentumField::Values> momentum,
                                                         const volume::VolumeFrame& other, const volume::Ramp& ramp,
                                                         const Progress& progress, const Log& log) {
  if (!momentum) return std::nullopt;
  const auto second = scene::momentum_of(other, ramp, &progress, log, momentum->fastest);
  if (!second || second->fastest != momentum->fastest) return std::nullopt;
  auto mean = scene::mean_of(momentum->components, second->components, "velocity", &progress);
  if (!mean) return std::nullopt;
  return grid::MomentumField::Values{std::move(*mean), momentum->fastest};
}

}  // namespace

VolumeAsset::VolumeAsset(volume::VolumeFrame frame, const Progress* progress)
    : frame_(make_deferred_delete<const volume::VolumeFrame>(std::move(frame))) {
  begin(progress);
}

VolumeAsset::VolumeAsset(volume::VolumeFrame open, volume::VolumeFrame close, const Progress* progress)
    : frame_(make_deferred_delete<const volume::VolumeFrame>(std::move(open))),
      close_(make_deferred_delete<const volume::VolumeFrame>(std::move(close))) {
  begin(progress);
}

VolumeAsset::VolumeAsset(scene::StateInGlPtr in_gl, const Progress* progress, std::optional<double> temperature_scale)
    : in_gl_(std::move(in_gl)) {
  volume::VolumeFrame frame = in_gl_->frame();
  frame.temperature_scale = temperature_scale;
  frame_ = make_deferred_delete<const volume::VolumeFrame>(std::move(frame));
  begin(progress);
}

VolumeAsset::VolumeAsset(const VolumeAsset& nearest, Interpolated /*tag*/)
    : frame_(nearest.frame_),
      close_(nearest.close_),
      volume_info_(nearest.volume_info_),
      box_(nearest.box_),
      cube_(grid::fit_cube(frame_->density, box_.low, box_.high, grid::Interpolation::linear)) {}

std::shared_ptr<const VolumeAsset> VolumeAsset::interpolated() const {
  const std::scoped_lock lock(mutex_);
  if (!interpolated_) interpolated_ = std::make_shared<const VolumeAsset>(*this, Interpolated{});
  return interpolated_;
}

void VolumeAsset::Box::add(const volume::ScalarVolume& field) {
  if (field.empty()) return;
  low = glm::min(low, field.bounds_min);
  high = glm::max(high, field.bounds_max);
}

double VolumeAsset::temperature_scale() const {
  if (frame_->temperature_scale) return *frame_->temperature_scale;
  float max_value = 0.0F;
  for (const auto& frame : frames()) {
    if (frame->temperature) max_value = std::max(max_value, frame->temperature->max_value);
  }
  return volume::temperature_scale_of(max_value);
}

double VolumeAsset::unit() const {
  float max_value = 0.0F;
  for (const auto& frame : frames()) max_value = std::max(max_value, frame->density.max_value);
  return volume::value_unit(max_value);
}

VolumeAsset::Frames VolumeAsset::frames() const { return close_ ? Frames{frame_, close_} : Frames{frame_}; }

void VolumeAsset::begin(const Progress* progress) {
  const volume::ScalarVolume& density = frame_->density;
  const auto is_there = [](const auto& field) { return field && !field->empty(); };
  Box shown;
  Box hot;
  for (const auto& frame : frames()) {
    shown.add(frame->density);
    if (frame->flame) shown.add(*frame->flame);
    if (frame->temperature) hot.add(*frame->temperature);
  }
  Box all = shown;
  if (!hot.empty()) all = {glm::min(all.low, hot.low), glm::max(all.high, hot.high)};
  if (shown.empty()) shown = all;
  const bool empty = all.empty();
  if (empty) shown = all = {density.bounds_min, density.bounds_max};
  box_ = all;
  cube_ = grid::fit_cube(density, all.low, all.high);
  VolumeInfo volume_info{.empty = empty,
                         .may_emit = is_there(frame_->flame) || is_there(frame_->temperature),
                         .low = shown.low,
                         .high = shown.high,
                         .index_to_world = density.index_to_world,
                         .anisotropy_grid = {},
                         .coarse = volume::CoarseVolume(density, progress),
                         .emission_defaults = {.has_only_temperature = density.empty() && !is_there(frame_->flame)}};
  if (frame_->temperature) volume_info.emission_defaults.temperature_scale = temperature_scale();
  if (frame_->flame) volume_info.flame = volume::CoarseVolume(*frame_->flame, progress);
  if (frame_->temperature) volume_info.temperature = volume::CoarseVolume(*frame_->temperature, progress);
  if (frame_->anisotropy) volume_info.anisotropy_grid = (*frame_->anisotropy)[0].name;
  volume_info_ = std::make_shared<const VolumeInfo>(std::move(volume_info));
}

std::uint64_t VolumeAsset::bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& frame : frames()) {
    bytes += frame->density.bytes();
    for (const volume::ScalarVolume* field : frame->beside_density()) bytes += field->bytes();
  }
  return bytes + derived_bytes();
}

std::uint64_t VolumeAsset::derived_bytes() const {
  std::uint64_t bytes = 0;
  const std::scoped_lock lock(mutex_);
  if (exposed_) bytes += exposed_->asset->bytes();
  if (interpolated_) bytes += interpolated_->derived_bytes();
  if (statistics_) bytes += statistics_->bytes();
  if (ramped_) bytes += ramped_->density.voxels->bytes() + ramped_->density.statistics->bytes();
  if (latticed_) bytes += latticed_->lattice->bytes();
  if (ramped_ && ramped_->ends) bytes += ramped_->ends->bytes();
  grid::Channels made;
  if (weighted_) made = weighted_->fields;
  if (glowing_) made.emission = glowing_->emission;
  bytes += made.bytes();
  return bytes;
}

const volume::ScalarVolume& VolumeAsset::main_field() const {
  if (!frame_->density.empty()) return frame_->density;
  if (frame_->flame && !frame_->flame->empty()) return *frame_->flame;
  return frame_->temperature && !frame_->temperature->empty() ? *frame_->temperature : frame_->density;
}

const VolumeAsset::Ramped& VolumeAsset::ramped(const volume::Ramp& ramp, Progress& progress) const {
  if (ramped_ && ramped_->ramp == ramp) return *ramped_;
  drop(ramped_);
  std::shared_ptr<const volume::ScalarVolume> voxels;
  std::shared_ptr<const grid::DensityEnds> ends;
  const auto curved = [&](const volume::ScalarVolume& density) { return volume::apply(ramp, density, &progress); };
  double unit = 1.0;
  if (close_) {
    volume::ScalarVolume open = curved(frame_->density);
    volume::ScalarVolume close = curved(close_->density);
    unit = volume::value_unit(std::max(open.max_value, close.max_value));
    open = volume::in_units_of(unit, std::move(open), &progress);
    close = volume::in_units_of(unit, std::move(close), &progress);
    // Nullopt for fire without density.
    auto mean = scene::mean_of(&open, &close, "density", &progress);
    voxels = make_deferred_delete<const volume::ScalarVolume>(mean ? std::move(*mean) : open);
    if (mean) ends = make_deferred_delete<const grid::DensityEnds>(std::move(open), std::move(close), cube_, &progress);
  } else {
    volume::ScalarVolume density = curved(frame_->density);
    unit = volume::value_unit(density.max_value);
    voxels = make_deferred_delete<const volume::ScalarVolume>(volume::in_units_of(unit, std::move(density), &progress));
  }
  auto statistics = make_deferred_delete<const grid::Statistics>(*voxels, cube_, &progress);
  put(ramped_, Ramped{ramp, {std::move(voxels), std::move(statistics), unit}, std::move(ends)});
  return *ramped_;
}

VolumeAsset::Density VolumeAsset::density(const volume::Ramp& ramp, Progress& progress, double& seconds) const {
  using Clock = std::chrono::steady_clock;
  seconds = 0.0;
  progress.begin(Progress::Stage::statistics);
  const auto lock = patient_lock(computing_, progress);
  const auto start = Clock::now();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  if (ramp.empty() && !close_ && !is_extreme()) {
    if (!statistics_) {
      put(statistics_, make_deferred_delete<const grid::Statistics>(frame_->density, cube_, &progress));
      seconds = since();
    }
    return {{frame_, &frame_->density}, statistics_};
  }
  const bool was_there = ramped_ && ramped_->ramp == ramp;
  Density density = ramped(ramp, progress).density;
  if (!was_there) seconds = since();
  return density;
}

std::shared_ptr<const VolumeAsset> VolumeAsset::while_open(double seconds, Progress& progress) const {
  if (seconds == 0.0 || !moves()) return nullptr;
  progress.begin(Progress::Stage::statistics);
  const auto lock = patient_lock(exposing_, progress);
  if (exposed_ && exposed_->seconds == seconds) return exposed_->asset;
  drop(exposed_);
  volume::VolumeFrame open = volume::advect(*frame_, -0.5 * seconds, &progress);
  volume::VolumeFrame close = volume::advect(*frame_, 0.5 * seconds, &progress);
  open.temperature_scale = close.temperature_scale = temperature_scale();
  put(exposed_, Exposed{seconds, std::make_shared<const VolumeAsset>(std::move(open), std::move(close), &progress)});
  return exposed_->asset;
}

grid::LatticePtr VolumeAsset::lattice(const volume::Ramp& ramp, const grid::Channels& channels,
                                      const grid::RefineSettings& refine, Progress& progress) const {
  // Independent of the view and of the cell budget.
  const grid::RefineSettings any_view;
  grid::RefineSettings of = refine;
  of.camera.reset();
  of.pixel_size = any_view.pixel_size;
  of.max_cells = any_view.max_cells;
  if (of.criterion != grid::Criterion::transmittance) {
    // Other criteria do not use the medium.
    of.density_scale = any_view.density_scale;
    of.anisotropy = any_view.anisotropy;
  }
  double seconds = 0.0;
  const Density field = density(ramp, progress, seconds);
  progress.begin(Progress::Stage::refining);
  const auto lock = patient_lock(computing_, progress);
  if (!latticed_ || latticed_->ramp != ramp || latticed_->channels != channels || latticed_->refine != of) {
    drop(latticed_);
    put(latticed_, Latticed{ramp, channels, of,
                            make_deferred_delete<const grid::Lattice>(*field.statistics, channels, of,
                                                                      field.voxels->max_value, &progress)});
  }
  return latticed_->lattice;
}

scene::Emission VolumeAsset::emission_by(const scene::Emission& emission) const {
  return volume_info_->emission_defaults.complete(emission);
}

VolumeAsset::Weighing VolumeAsset::weighing(const std::shared_ptr<const volume::VolumeFrame>& frame,
                                            const scene::DensityRamps& ramps, Progress& progress) const {
  if (ramps.values.empty() && !is_extreme()) return {frame, ramps};
  const double unit = ramped(ramps.values, progress).density.unit;
  if (unit == 1.0) return {frame, ramps};
  volume::VolumeFrame copy = *frame;
  copy.density = volume::in_units_of(unit, volume::apply(ramps.values, frame->density, &progress), &progress);
  return {make_deferred_delete<const volume::VolumeFrame>(std::move(copy)), {{}, ramps.colors}, frame};
}

grid::Channels VolumeAsset::channels(const scene::DensityRamps& ramps, const scene::Emission& emission,
                                     bool anisotropic, Progress& progress, const Log& log) const {
  const scene::Emission given = emission_by(emission);
  const auto field = [&]<class Field>(std::type_identity<Field>, auto values) {
    return values ? make_deferred_delete<const Field>(*std::move(values), cube_, &progress) : nullptr;
  };
  constexpr std::type_identity<grid::RgbField> colors;
  constexpr std::type_identity<grid::ScalarField> numbers;
  constexpr std::type_identity<grid::MomentumField> motion;
  const auto lock = patient_lock(computing_, progress);
  const volume::VolumeFrame* close = close_.get();
  if (!glowing_ || glowing_->settings != given) {
    drop(latticed_);  // it refers to the emission
    drop(glowing_);
    auto emissive = in_gl_ ? in_gl_->emission(given) : scene::emission_of(*frame_, given, &progress);
    if (close != nullptr)
      emissive =
          scene::mean_of(emissive, scene::emission_of(*close, given, &progress), "temperature or flame", &progress);
    put(glowing_, Glowing{given, field(colors, std::move(emissive))});
  }
  const auto weighs = [&](const std::shared_ptr<const volume::VolumeFrame>& frame) {
    const bool weighted = is_weighted(*frame, ramps, static_cast<bool>(in_gl_));
    return weighted ? weighing(frame, ramps, progress) : Weighing{frame, ramps};
  };
  const bool weighs_anew = !weighted_ || weighted_->ramps != ramps;
  const bool turns_anew = anisotropic && (weighs_anew || !weighted_->anisotropic);
  Weighing at_open{frame_, ramps};
  Weighing at_close{close_, ramps};
  if (weighs_anew || turns_anew) {
    at_open = weighs(frame_);
    if (close_) at_close = weighs(close_);
  }
  const auto scattering_at = [&](const Weighing& at) {
    return scene::scattering_of(*at.frame, at.ramps, &progress, &at.colored_by->density);
  };
  const auto forward_at = [&](const Weighing& at) {
    return scene::forward_of(*at.frame, at.ramps, &progress, &at.colored_by->density);
  };
  if (weighs_anew) {
    drop(latticed_);
    drop(weighted_);
    auto scattering = in_gl_ ? in_gl_->scattering() : scattering_at(at_open);
    auto momentum = in_gl_ ? in_gl_->momentum()
                           : scene::momentum_of(*at_open.frame, at_open.ramps.values, &progress, log,
                                                close != nullptr ? scene::fastest_of(*close) : 0.0);
    if (close != nullptr) {
      scattering = scene::mean_of(scattering, scattering_at(at_close), "density", &progress);
      momentum = mean_momentum(std::move(momentum), *at_close.frame, at_close.ramps.values, progress, log);
    }
    grid::Channels made;
    made.scattering = field(colors, std::move(scattering));
    made.momentum = field(motion, std::move(momentum));
    put(weighted_, Weighted{ramps, std::move(made)});
  }
  if (turns_anew) {
    auto forward = in_gl_ ? in_gl_->forward() : forward_at(at_open);
    if (close != nullptr) {
      const auto closing = forward_at(at_close);
      forward = scene::mean_of(forward ? &*forward : nullptr, closing ? &*closing : nullptr, "density", &progress);
    }
    Weighted made{ramps, weighted_->fields, true};
    made.fields.forward = field(numbers, std::move(forward));
    put(weighted_, std::move(made));
  }
  grid::Channels made = weighted_->fields;
  made.emission = glowing_->emission;
  if (!anisotropic) made.forward = nullptr;
  made.ends = close_ ? ramped(ramps.values, progress).ends : nullptr;
  return made;
}

}  // namespace cumulet::viewer
