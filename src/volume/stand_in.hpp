#pragma once

// What a large file looks like, long before it is read.

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>

#include "volume/frame.hpp"

namespace cumulet::volume {

/// A file's density, temperature and flame in voxels of 4^3. Where there is anything is known of each voxel, as the
/// file's tree has it; how much there is, of a sixteenth of the bricks: a voxel is the mean of those that were read
/// around it, times the active part of it. The means of the whole are so kept, and what is smaller than some 32 voxels
/// is not seen.
struct StandIn {
  VolumeFrame frame;
  /// What the voxels that are seen of the whole reach over, as VolumeFacts has it.
  struct Extent {
    glm::ivec3 low;
    glm::ivec3 high;  ///< both inclusive
    glm::dmat4 index_to_world;
  };
  std::optional<Extent> extent;  ///< none: of fields on lattices of their own
};

/// A file with as many bricks takes a second of a processor until it is seen.
inline constexpr std::uint64_t worth_a_stand_in = 50'000;

struct StandInWish {
  /// Called on the import's thread, once at most, before the whole is read. What it throws leaves the import.
  std::function<void(StandIn)> take;
  std::uint64_t least_bricks = worth_a_stand_in;  ///< that the first field has; with fewer there is none
};

/// The same as the other import_frame, but that a .vdb file of many bricks has a stand-in first, which takes about a
/// twentieth of the time. None of a file from before OpenVDB 3, nor where anything of it fails: what is wrong with a
/// file is told of the whole.
VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress,
                         const StandInWish& stand_in);

}  // namespace cumulet::volume
