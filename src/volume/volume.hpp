#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "base/file_path.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "volume/brick_values.hpp"
#include "volume/device_bricks.hpp"

namespace cumulet::volume {

/// Larger absolute values count as 0: they are fill values (netCDF's is 9.97e36), not measurements.
inline constexpr float largest_value = 1e30F;

/// A box of voxels [min, max], both inclusive, with one value.
struct Tile {
  glm::ivec3 min;
  glm::ivec3 max;
  float value;
};

/// A tile as stored in a tree: not clipped to the active voxels; it may have the background value, or be inactive.
struct SourceTile {
  Tile box;
  bool active;
};

/// A scalar field on a sparse voxel lattice, independent of file formats.
///
/// Voxel (i,j,k) is the unit cube centered on (i,j,k) in index space, with a constant value. The field is zero outside
/// bounds. Inside, a voxel is in a brick, else in a tile, else it has the background value. Values are between 0 and
/// largest_value.
struct ScalarVolume {
  std::string name;                ///< grid name, for messages
  glm::dmat4 index_to_world{1.0};  ///< affine: world = index_to_world * (i,j,k,1)
  glm::ivec3 bounds_min{0};        ///< first active voxel, inclusive
  glm::ivec3 bounds_max{-1};       ///< last active voxel, inclusive
  float background = 0.0F;
  float max_value = 0.0F;           ///< over all voxels within bounds
  std::uint64_t active_voxels = 0;  ///< active tiles count with all their voxels
  /// Brick origins: multiples of 8, unique, sorted by (x, y, z) lexicographically.
  std::vector<glm::ivec3> brick_origins;
  /// 512 per brick, z fastest: index ((x & 7) * 8 + (y & 7)) * 8 + (z & 7), OpenVDB's leaf order. Voxels outside bounds
  /// are zero.
  BrickValues brick_values;
  /// Set if the values of all bricks are GPU-resident: it has the same bricks, and brick_values is empty.
  DeviceBricksPtr on_device;
  /// Disjoint, not overlapping any brick, clipped to bounds; only tiles whose value differs from the background.
  std::vector<Tile> tiles;
  // Numbers of source voxels within bounds that count as 0.
  std::uint64_t negative_voxels = 0;
  std::uint64_t non_finite_voxels = 0;
  std::uint64_t huge_voxels = 0;  ///< finite, absolute value above largest_value

  /// True if there is no active voxel: bounds are then the one voxel (0, 0, 0), which is 0.
  [[nodiscard]] bool empty() const { return active_voxels == 0; }
  /// Bytes of main memory, excluding a few hundred.
  [[nodiscard]] std::uint64_t bytes() const {
    return brick_origins.size() * sizeof(glm::ivec3) + brick_values.bytes() + tiles.size() * sizeof(Tile) +
           (on_device ? on_device->bytes() : 0);
  }
};

/// An entry of a file's metadata, as text.
struct Metadata {
  std::string name;
  std::string type;
  std::string value;
};

/// The readable content of a grid's voxels: none, scalars, or the lengths of vectors.
enum class Values { none, scalars, lengths };

/// One grid of a file, for listings and messages.
struct GridInfo {
  std::string name;
  std::string type;         ///< as in the file: "float", "half", "vec3s", ...
  std::string grid_class;   ///< "fog volume", "level set", "unknown", ...
  std::string unique_name;  ///< "name[n]" if a file repeats a name
  std::string refusal;      ///< why it is not a scalar fog volume; empty if it is one
  Values values = Values::none;
  std::vector<Metadata> metadata;
};

/// Creates the statics of the libraries that read volumes. Call it before threads of this library start: these end
/// before statics are destroyed that existed at their start (base/library_thread.hpp). Any thread.
void initialize_readers();

/// Returns the grids of a .vdb or .nvdb file, without their voxels. Throws Error(file).
std::vector<GridInfo> list_grids(const FilePath& file);

/// Reads one scalar grid of a .vdb or .nvdb file.
///
/// grid_name: if empty, the scalar fog grid "density"; else the first of "smoke", "soot", "flames", "flame", "fire",
/// "temperature", "heat"; else the first fog grid of the file that is not a velocity. A name in this case is preferred
/// to the same name in another case. A warning lists the other grids, unless this is the only one named "density" in
/// any case. Another warning reports an unknown newer file version. Level sets, vector grids, points and unreadable
/// files throw Error(file) with one line that names file and cause. An empty grid gives an empty volume, with a
/// warning. Negative and non-finite voxels, and those beyond largest_value, become zero, with a warning with their
/// number for each kind. Any affine transform is accepted; a frustum transform is not. O(active nodes) time and memory.
/// progress: receives the completed fraction; if it is cancelled, Error(cancelled) is thrown.
ScalarVolume import_volume(const FilePath& file, const std::string& grid_name, const Log& log,
                           Progress* progress = nullptr);

}  // namespace cumulet::volume
