#pragma once

#include <cstdint>
#include <vector>

#include "grid/cube.hpp"
#include "volume/volume.hpp"

namespace cumulet::bench {

/// Value type of a NanoVDB grid.
enum class NanoType {
  float32,  ///< nanovdb::NanoGrid<float>
  fp16,     ///< 16 bits, from the minimum to the maximum of a leaf
  fpn,      ///< 1 to 16 bits per leaf, within 0.0005 of the volume's maximum: to compare memory
};

/// Converts a volume to a NanoVDB grid, in the words that PNanoVDB.h reads.
///
/// Its index space is cube space. Its values are those of the dense grid: relative to the volume's maximum, rounded to
/// halves. Nonzero voxels are active, so that nodes' maxima are majorants. Throws std::runtime_error if the volume is
/// wider than 4096 voxels.
///
/// With linear interpolation, maxima are those of the cells that a node covers, whose upper corners may be voxels of
/// the next nodes. Nodes exist for all cells that are not empty. Only for float32, else std::runtime_error.
std::vector<std::uint32_t> make_nano_grid(const volume::ScalarVolume& volume, NanoType type,
                                          grid::Interpolation interpolation = grid::Interpolation::nearest);

}  // namespace cumulet::bench
