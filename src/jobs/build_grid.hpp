#pragma once

#include <cstdint>

#include "assets/volume_asset.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "jobs/built.hpp"
#include "jobs/resource_limits.hpp"
#include "scene/march_source.hpp"

namespace cumulet::viewer {

/// Logs that refinement ended at `most` cells: because of max_cells, or because of the memory limits.
void log_limited(const Log& log, std::uint64_t most, std::uint64_t max_cells);

/// Returns true if building with these settings requires the voxels in main memory.
[[nodiscard]] bool needs_values(const VolumeAsset& volume, const BuildSettings& settings);

/// Builds a grid on this thread. Throws Error(cancelled), and everything that its steps throw.
///
/// A GPU build is only planned here; the GPU executes the plan. Volumes that move while the shutter is open are built
/// on the CPU, and this is logged. Grids are coarsened to fit the main and GPU memory limits; if even the coarsest does
/// not fit, Error(out_of_memory) is thrown.
///
/// before: for a moving camera, the plan that is shown now. Its cells are kept where possible to avoid popping. The
/// result has no source if GPU-resident voxels are needed in main memory first.
[[nodiscard]] Built build_grid(const Log& log, const VolumeAssetPtr& volume, const BuildSettings& settings,
                               Progress& progress, const ResourceLimits& resource_limits = {},
                               const scene::GridPlanPtr& before = nullptr);

}  // namespace cumulet::viewer
