#pragma once

// Private to volume/: resamples a field to another lattice.

#include <optional>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

/// Whether the voxel positions of two lattices, within a box of the second, agree to a thousandth of a voxel.
bool same_positions(const glm::dmat4& a, const glm::dmat4& b, const Box& voxels);

/// Resamples a field as described at import_frame(). Regions where the input of a brick is constant become tiles, all
/// others bricks. O(voxels that become bricks, times samples per axis cubed). Runs in parallel; the result does not
/// depend on threads. Throws if the field is too far off or too large for the lattice. within: the part of the lattice
/// that is needed; outside of it the result may have parts of bricks and tiles.
SourceGrid resample(const ScalarVolume& field, const glm::dmat4& lattice, const std::optional<Box>& within,
                    Progress* progress, Portion portion);

/// Returns the part of a field without a background in the bricks that overlap the box. Voxels that are not 0 are
/// active. The result reads from the field.
SourceGrid bricks_within(const ScalarVolume& field, const Box& box);

}  // namespace cumulet::volume::detail
