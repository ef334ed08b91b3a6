#pragma once

#include "base/progress.hpp"
#include "volume/frame.hpp"

namespace cumulet::volume {

/// What advect() moves anything by at most, along an axis.
constexpr double farthest_voxels = 64.0;

/// The frame as it is so many seconds later, or before where they are negative: all its fields, carried along its
/// velocity, which stays as it is meanwhile. Semi-Lagrangian (Stam, "Stable Fluids", 1999): what comes to a voxel's
/// centre is followed back, by the midpoint rule in steps of two voxels at most, and is there the trilinear
/// interpolation between voxel centres; of colour, anisotropy and velocity weighed by density, whose they are. What
/// does not move stays to the bit. Mass is kept as far as that scheme does: in a smooth flow without sources to a per
/// cent or so.
///
/// Where the frame has no velocity, it stands still; but beyond the box of the velocity's voxels the velocity is that
/// of the box's nearest voxel, so that what is at the rim may leave it. Along an axis nothing moves by more than 64
/// voxels: what would counts as that fast. A frame without velocity is returned as it is.
///
/// O(voxels of bricks that something moves through); in parallel, the same whatever the threads. Memory: the new
/// fields' bricks, of floats, and no more than one field's a second time. Throws Error(cancelled), and Error(file)
/// where that is more than 2^21 bricks; what messages say of the frame is for the caller to put in front. from, to: of
/// the progress' fraction.
VolumeFrame advect(const VolumeFrame& frame, double seconds, Progress* progress = nullptr, double from = 0.0,
                   double to = 1.0);

}  // namespace cumulet::volume
