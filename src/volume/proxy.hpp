#pragma once

// Low-resolution proxies of large files, shown while the files load.

#include <cstdint>
#include <functional>
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

/// A file with this many bricks takes about a second of one core to load.
inline constexpr std::uint64_t worth_a_proxy = 50'000;

struct ProxyRequest {
  /// Called on the import's thread, at most once, before the full-resolution import. Its exceptions propagate.
  std::function<void(Proxy)> take;
  std::uint64_t min_bricks = worth_a_proxy;  ///< minimum bricks of the first field; smaller files get no proxy
};

/// Like the other import_frame, but makes a proxy first for a .vdb file of many bricks, which takes about a twentieth
/// of the time. There is no proxy for files from before OpenVDB 3, or if making it fails: errors of a file are reported
/// by the full-resolution import.
VolumeFrame import_frame(const FilePath& file, const GridNames& names, const Log& log, Progress* progress,
                         const ProxyRequest& proxy);

}  // namespace cumulet::volume
