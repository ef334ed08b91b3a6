#pragma once

// Private to volume/: a field on the lattice of another.

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// Whether the voxels of both lattices, within a box of the second, are in the same places to a thousandth of a voxel.
bool same_places(const glm::dmat4& a, const glm::dmat4& b, const Box& voxels);

/// The field on another lattice, as VolumeFrame says. What is not constant over what a brick of the lattice is
/// interpolated from becomes bricks, the rest tiles. O(voxels that become bricks, and samples an axis cubed); in
/// parallel, the same whatever the threads. Throws where the field is too far or too large for the lattice.
SourceGrid resample(const ScalarVolume& field, const glm::dmat4& lattice, Progress* progress, Portion portion);

}  // namespace cumulet::volume::detail
