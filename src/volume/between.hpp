#pragma once

#include "base/progress.hpp"
#include "volume/frame.hpp"

namespace cumulet::volume {

/// Blends two frames; `part` is the weight of the second, 0 to 1. The result has the lattice of the first; fields of
/// the second are resampled to it as in import_frame if necessary. Density, temperature and flame are interpolated
/// linearly. Color, anisotropy and velocity are weighted by density, so that smoke keeps its color where the other
/// frame has none; if only one frame has such a field, it is used unchanged. Voxels that are equal in both frames stay
/// bit-identical.
///
/// O(bricks). Runs in parallel; the result does not depend on threads. Throws the errors of import_frame for
/// incompatible fields, Error(file), and Error(cancelled). The caller must add the frames' names to messages.
VolumeFrame blend(const VolumeFrame& before, const VolumeFrame& after, double part, Progress* progress = nullptr);

/// Interpolates two frames with a time difference of `seconds`: advects both to the time in between (advection.hpp) and
/// blends them. If one of them has no velocity, they are only blended.
VolumeFrame between(const VolumeFrame& before, const VolumeFrame& after, double part, double seconds,
                    Progress* progress = nullptr);

}  // namespace cumulet::volume
