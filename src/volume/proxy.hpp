#pragma once

// Low-resolution proxies of large files, shown while the files load.

#include <glm/glm.hpp>
#include <optional>

#include "volume/frame.hpp"

namespace cumulet::volume {

/// The density, temperature and flame of a file at a quarter of the resolution (voxels of 4^3). Occupancy is exact,
/// because it comes from the file's tree. Values come from a sixteenth of the bricks: a voxel is the mean of the active
/// voxels that were read around it, times its own active fraction. Overall means are thus preserved, but details
/// smaller than about 32 voxels are lost.
struct Proxy {
  VolumeFrame frame;
  /// The extent of the visible voxels at full resolution, as in VolumeInfo.
  struct Extent {
    glm::ivec3 low;
    glm::ivec3 high;  ///< both inclusive
    glm::dmat4 index_to_world;
  };
  std::optional<Extent> extent;  ///< empty if the fields have different lattices
};

}  // namespace cumulet::volume
