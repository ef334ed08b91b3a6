#include "jobs/build_grid.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/detached_work.hpp"
#include "base/error.hpp"
#include "grid/grid_builder.hpp"
#include "jobs/cell_budget.hpp"
#include "jobs/stopwatch.hpp"
#include "scene/space.hpp"
#include "volume/advection.hpp"

namespace cumulet::viewer {

namespace {

// Returns the volume for the shutter interval; null if nothing moves.
VolumeAssetPtr open_of(const VolumeAssetPtr& volume, double seconds, Progress& progress) {
  try {
    return volume->while_open(seconds, progress);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::cancelled) throw;
    throw Error(error.code(), volume->name() + ", while the shutter is open: " + error.what());
  }
}

// Returns the volume with the interpolation of these settings.
VolumeAssetPtr field_of(const VolumeAssetPtr& volume, const BuildSettings& settings) {
  return settings.interpolation == grid::Interpolation::linear ? volume->interpolated() : volume;
}

// Density scale for values in `unit`, limited to the maximum extinction of path tracing.
double density_scale_in(double unit, const volume::ScalarVolume& voxels, const grid::Cube& cube, double scale) {
  const glm::dmat3 axes(cube.to_world);
  const double edge = cube.size() * std::max({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
  const double max_value = voxels.max_value;
  return max_value > 0.0 ? std::min(scale * unit, scene::max_extinction(edge) / max_value) : scale * unit;
}

bool interpolates(const BuildSettings& settings) { return settings.interpolation == grid::Interpolation::linear; }

// Returns whether the GPU builds a tetrahedral grid; logs the reason if the CPU builds it instead.
bool builds_on_gpu(const Log& log, const VolumeAsset& volume, const BuildSettings& settings, bool moves) {
  if (settings.on != BuildOn::gpu) return false;
  if (moves) log.info(volume.name() + ": its grid is built on the CPU because it has motion blur");
  return !moves;
}

}  // namespace

bool needs_values(const VolumeAsset& volume, const BuildSettings& settings) {
  return settings.march != scene::March::tet || settings.on != BuildOn::gpu || interpolates(settings) ||
         !settings.density_ramp.empty() || !settings.density_colors.empty() || settings.emission.has_color_ramp() ||
         volume.is_extreme() || (settings.shutter_seconds != 0.0 && volume.moves());
}

void log_limited(const Log& log, std::uint64_t most, std::uint64_t max_cells) {
  log.info((most < max_cells ? "the memory limit of " + std::to_string(most) + " cells"
                             : "max_cells (" + std::to_string(max_cells) + ")") +
           " stopped the refinement above the threshold");
}

Built build_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings, Progress& progress,
                 const ResourceLimits& resource_limits, const scene::GridPlanPtr& before) {
  Built built;
  const volume::DeviceBricksPtr& in_gl = volume->volume().on_device;
  if (in_gl && needs_values(*volume, settings)) {
    in_gl->ask_for_values();
    return built;
  }
  built.volume = volume;
  built.settings = settings;
  built.active_voxels = volume->volume().active_voxels;
  built.moves = volume->moves();
  Stopwatch watch;
  const VolumeAssetPtr moving = open_of(volume, settings.shutter_seconds, progress);
  const VolumeAssetPtr asset = field_of(moving ? moving : volume, settings);
  const VolumeAsset& shown = *asset;
  if (moving && 0.5 * settings.shutter_seconds * volume->fastest() > volume::farthest_voxels)
    log.info(volume->name() + ": motion blur is limited to 64 voxels per half shutter time");
  const double taken = watch.lap();
  const auto [voxels, statistics, unit] = shown.density(settings.density_ramp, progress, built.seconds.statistics);
  watch.lap();
  const grid::Channels channels = shown.channels({settings.density_ramp, settings.density_colors}, settings.emission,
                                                 settings.anisotropic, progress, log);
  built.seconds.statistics += taken + watch.lap();
  progress.begin(Progress::Stage::refining);
  const auto finished = [unit = unit, depth = unit * statistics->mean_optical_depth()](scene::MarchSource source) {
    source.value_unit = unit;
    source.optical_depth = depth;
    return std::make_shared<const scene::MarchSource>(std::move(source));
  };
  if (settings.march != scene::March::tet) {
    built.source = finished(scene::make_voxel_source(settings.march, voxels, statistics, channels));
    resource_limits.require(built.bytes(), volume->name());
    built.seconds.records = watch.lap();
    return built;
  }
  const bool on_gpu = builds_on_gpu(log, *volume, settings, moving != nullptr);
  const Carried carried = Carried::of(channels, grid::has_corners(settings.refine.cells, settings.interpolation));
  const std::uint64_t max_cells = settings.refine.max_cells;
  grid::RefineSettings refine = settings.refine;
  refine.density_scale = density_scale_in(unit, *voxels, statistics->cube(), settings.refine.density_scale);
  grid::LatticePtr lattice;
  std::optional<std::uint64_t> planned;
  if (on_gpu) {
    lattice = shown.lattice(settings.density_ramp, channels, refine, progress);
    planned = planned_cells_that_fit(max_cells, carried, *lattice, volume->bytes(), resource_limits);
    if (!planned && in_gl) {
      in_gl->ask_for_values();
      return {};
    }
    if (!planned)
      log.info(volume->name() + ": its grid is built on the CPU: a lattice of " +
               std::to_string(lattice->device_bytes()) + " bytes leaves too little of the GPU memory limit of " +
               std::to_string(resource_limits.gl_bytes()) + " bytes");
  }
  if (planned) {
    std::vector<std::uint8_t> levels =
        before && before->lattice == lattice
            ? lattice->own.levels(lattice->cube, settings.refine, before->levels, &progress)
            : lattice->own.levels(grid::ViewLevels(lattice->cube, settings.refine), &progress);
    built.source =
        finished(scene::make_planned_source({lattice, std::move(levels), *planned}, voxels, statistics, channels));
    built.cell_limit = *planned;
    resource_limits.require(built.bytes(), volume->name());
    built.seconds.refine = watch.lap();
    return built;
  }
  refine.max_cells = built.cell_limit = cells_that_fit(max_cells, carried, volume->bytes(), resource_limits);
  const auto diamonds = make_deferred_delete<const grid::DiamondSet>(*statistics, channels, refine, &progress);
  auto builder = make_deferred_delete<grid::GridBuilder>(*statistics, *diamonds);
  builder->bisect(&progress);
  built.seconds.refine = watch.lap();
  progress.begin(Progress::Stage::records);
  const float max_value = voxels->max_value;
  auto grid = make_deferred_delete<const grid::TetGrid>(
      builder->records(settings.refine.cells, max_value, channels, &progress));
  builder.reset();
  built.seconds.records = watch.lap();
  built.cells = grid->cells.size();
  built.levels = grid->levels;
  built.limited = grid->limited;
  if (grid->limited) log_limited(log, refine.max_cells, max_cells);
  built.source =
      finished(scene::make_tet_source(std::move(grid), grid::has_fits(settings.refine.cells), max_value, &progress));
  resource_limits.require(built.bytes(), volume->name());
  return built;
}

}  // namespace cumulet::viewer
