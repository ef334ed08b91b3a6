#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "grid/grid_builder.hpp"
#include "grid/lattice.hpp"

namespace cumulet::test {

/// Returns the grid without clear cones, as if they had not been computed.
inline grid::TetGrid without_clear_cones(grid::TetGrid grid) {
  for (grid::CellRecord& cell : grid.cells) {
    if (cell.data.z == 0) cell.data.w = 0;
  }
  return grid;
}

/// A volume, its statistics, and the grid that the CPU builds from them.
struct GridReference {
  std::shared_ptr<const volume::ScalarVolume> volume;
  std::shared_ptr<const grid::Statistics> statistics;
  grid::Channels channels;

  /// cube: if not given, the volume's own.
  explicit GridReference(volume::ScalarVolume v, const std::optional<grid::Cube>& cube = std::nullopt,
                         grid::Channels beside = {})
      : volume(std::make_shared<const volume::ScalarVolume>(std::move(v))),
        statistics(std::make_shared<const grid::Statistics>(*volume, cube ? *cube : grid::fit_cube(*volume))),
        channels(std::move(beside)) {}
  [[nodiscard]] grid::TetGrid grid(const grid::RefineSettings& settings) const {
    const grid::DiamondSet diamonds(*statistics, channels, settings);
    grid::GridBuilder builder(*statistics, diamonds);
    builder.bisect();
    return builder.records(settings.cells, volume->max_value, channels);
  }
  [[nodiscard]] grid::LatticePtr lattice(const grid::RefineSettings& settings) const {
    return std::make_shared<const grid::Lattice>(*statistics, channels, settings, volume->max_value);
  }
};

}  // namespace cumulet::test
