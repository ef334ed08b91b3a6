#pragma once

#include <cstdint>
#include <vector>

#include "volume/volume.hpp"

namespace cumulet::bench {

/// How a NanoVDB grid keeps its values.
enum class NanoType {
  float32,  ///< nanovdb::NanoGrid<float>
  fp16,     ///< 16 bits, from the least to the greatest value of a leaf
  fpn,      ///< 1 to 16 bits a leaf, within half a thousandth of the volume's maximum: to compare memory
};

/// A volume as a NanoVDB grid, in the words that PNanoVDB.h reads.
///
/// Its index space is cube space, its values are what the dense march has: relative to the volume's maximum, as halves
/// have them. What is not 0 is active, so that nodes' maxima are majorants. Throws std::runtime_error of what is wider
/// than 4096 voxels.
std::vector<std::uint32_t> make_nano_grid(const volume::ScalarVolume& volume, NanoType type);

}  // namespace cumulet::bench
