#pragma once

#include "base/progress.hpp"
#include "volume/frame.hpp"

namespace cumulet::volume {

/// Maximum displacement by advect() along an axis, in voxels.
constexpr double farthest_voxels = 64.0;

/// Advects all fields of the frame along its velocity, which is constant meanwhile, by `seconds` (negative: backward in
/// time). Semi-Lagrangian (Stam, "Stable Fluids", 1999): a voxel center is traced back by the midpoint rule in steps of
/// at most two voxels. The field is interpolated there trilinearly between voxel centers; color, anisotropy and
/// velocity are interpolated with density weights, because they are properties of matter. Voxels that do not move stay
/// bit-identical. Mass is conserved as far as the scheme does: in a smooth flow without sources to about one percent.
///
/// Inside the velocity's bounds, voxels without velocity are at rest. Outside, the velocity is that of the nearest
/// voxel in the bounds, so that matter at the border can leave them. Displacements are clamped to 64 voxels along each
/// axis. A frame without velocity is returned unchanged.
///
/// O(voxels of bricks that matter moves through). Runs in parallel; the result does not depend on threads. Memory: the
/// new fields' bricks as floats, plus at most one field a second time. Throws Error(cancelled), and Error(file) for
/// more than 2^21 bricks; the caller must add the frame's name to messages. from, to: range of the progress fraction.
VolumeFrame advect(const VolumeFrame& frame, double seconds, Progress* progress = nullptr, double from = 0.0,
                   double to = 1.0);

}  // namespace cumulet::volume
