#pragma once

#include "base/progress.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume {

/// Returns the unit in which densities up to max_value are stored, so that their squares fit in floats. It is 1 for a
/// max_value from 2^-32 to 2^32 and for 0, else the largest power of two that is at most max_value.
double value_unit(float max_value);

/// Returns the field with values divided by `unit`, a power of two. Exact, except for values of at most 2^-126 units.
/// O(voxels of bricks). Throws Error(cancelled).
ScalarVolume in_units_of(double unit, ScalarVolume volume, const Progress* progress = nullptr);

}  // namespace cumulet::volume
