#pragma once

#include "base/progress.hpp"
#include "volume/frame.hpp"

namespace cumulet::volume {

/// Two frames mixed, by this part of the second, 0 to 1: fields of the first one's lattice, to which the second one's
/// are resampled as import_frame does where theirs is another. Matter is linear in the part. What says of what kind it
/// is, colour, anisotropy and velocity, is weighed by density, so that smoke keeps its colour where the other frame has
/// none; what only one of both has is as it has it. Fields of which a voxel is alike in both stay to the bit.
///
/// O(bricks); in parallel, the same whatever the threads. Throws what import_frame does of fields that do not go
/// together, Error(file), and Error(cancelled); what messages say of the frames is for the caller to put in front.
VolumeFrame blend(const VolumeFrame& before, const VolumeFrame& after, double part, Progress* progress = nullptr);

/// What is between two frames that are so many seconds apart: both, advected to there (advection.hpp) and blended.
/// Where one of them has no velocity, blended alone.
VolumeFrame between(const VolumeFrame& before, const VolumeFrame& after, double part, double seconds,
                    Progress* progress = nullptr);

}  // namespace cumulet::volume
