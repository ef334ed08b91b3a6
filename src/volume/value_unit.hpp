#pragma once

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// The unit in which densities up to max_value are kept, so that floats hold their squares: 1 for a max_value from
/// 2^-32 to 2^32 and for 0, else the largest power of two that is not above max_value.
double value_unit(float max_value);

/// The same field with values / unit, which is a power of two: exact, but for what is 2^-126 of the unit or less.
/// O(voxels of bricks). Throws Error(cancelled).
ScalarVolume in_units_of(double unit, ScalarVolume volume, const Progress* progress = nullptr);

}  // namespace cumulet::volume
