#pragma once

// Private to volume/: a field on the lattice of another.

#include <optional>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// Whether the voxels of both lattices, within a box of the second, are in the same places to a thousandth of a voxel.
bool same_places(const glm::dmat4& a, const glm::dmat4& b, const Box& voxels);

/// The field on another lattice, as VolumeFrame says. What is not constant over what a brick of the lattice is
/// interpolated from becomes bricks, the rest tiles. O(voxels that become bricks, and samples an axis cubed); in
/// parallel, the same whatever the threads. Throws where the field is too far or too large for the lattice. within: of
/// the lattice, where alone it is asked for; beyond stand whole bricks and tiles, or nothing.
SourceGrid resample(const ScalarVolume& field, const glm::dmat4& lattice, const std::optional<Box>& within,
                    Progress* progress, Portion portion);

/// What of a field without a background is in its bricks that meet the box. Active are those voxels that are not 0. It
/// reads from the field.
SourceGrid bricks_within(const ScalarVolume& field, const Box& box);

}  // namespace cumulet::volume::detail
