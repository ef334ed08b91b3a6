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

/// Values further from 0 than this count as 0: fill values are (netCDF's is 9.97e36), and no measured value is.
inline constexpr float largest_value = 1e30F;

/// A box of voxels [min, max], both inclusive, of one value.
struct Tile {
  glm::ivec3 min;
  glm::ivec3 max;
  float value;
};

/// A scalar field on a sparse voxel lattice, free of any file format.
///
/// Voxel (i,j,k) is the unit cube centred on (i,j,k) in index space, of constant value. The field is zero outside
/// bounds; inside, a voxel is in a brick, else in a tile, else it has the background value. Values are not
/// negative, and largest_value at most.
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
  /// 512 a brick, z fastest: index ((x & 7) * 8 + (y & 7)) * 8 + (z & 7), OpenVDB's leaf order. Voxels outside bounds
  /// hold zero.
  BrickValues brick_values;
  /// Where the values of all bricks are in GL instead: the same bricks; brick_values is empty.
  DeviceBricksPtr on_device;
  /// Disjoint, not overlapping any brick, clipped to bounds; only tiles whose value differs from
  /// the background.
  std::vector<Tile> tiles;
  // What the source had within bounds, and counts as 0.
  std::uint64_t negative_voxels = 0;
  std::uint64_t non_finite_voxels = 0;
  std::uint64_t huge_voxels = 0;  ///< finite, beyond largest_value either way

  /// No active voxel: bounds are then the one voxel (0, 0, 0), which is 0.
  [[nodiscard]] bool empty() const { return active_voxels == 0; }
  /// Main memory, but for some hundreds.
  [[nodiscard]] std::uint64_t bytes() const {
    return brick_origins.size() * sizeof(glm::ivec3) + brick_values.bytes() + tiles.size() * sizeof(Tile) +
           (on_device ? on_device->bytes() : 0);
  }
};

/// The volume of bricks that are in GL. bricks: tidy.
ScalarVolume volume_on_device(DeviceBricksPtr bricks, std::string name, const glm::dmat4& index_to_world);

/// An entry of a file's metadata, as text.
struct Metadata {
  std::string name;
  std::string type;
  std::string value;
};

/// What can be read of a grid's voxels: nothing, numbers, or the lengths of vectors.
enum class Values { none, scalars, lengths };

/// One grid of a file, for listings and messages.
struct GridInfo {
  std::string name;
  std::string type;         ///< as the file says: "float", "half", "vec3s", ...
  std::string grid_class;   ///< "fog volume", "level set", "unknown", ...
  std::string unique_name;  ///< "name[n]" where a file repeats a name
  std::string refusal;      ///< why it is no scalar fog volume; empty: it is one
  Values values = Values::none;
  std::vector<Metadata> metadata;
};

/// Creates the statics of the libraries that read volumes. Called before threads of this library start, which end
/// before statics are destroyed that exist by then (base/library_thread.hpp). Any thread.
void initialize_readers();

/// The grids of a .vdb or .nvdb file, without their voxels. Throws Error(file).
std::vector<GridInfo> list_grids(const FilePath& file);

/// Reads one scalar grid of a .vdb or .nvdb file.
///
/// grid_name empty: the scalar fog grid called "density"; else the first of those called "smoke", "soot", "flames",
/// "flame", "fire", "temperature", "heat"; else the first of the file. A name in this case comes before the same name
/// in another case. A warning names the others, unless it is the only one called "density" in any case. Another warning
/// names a version of the file that is newer than the known ones. Level sets, vector grids, points and unreadable files
/// throw Error(file) with one line that names file and cause. An empty grid is an empty volume, with a warning;
/// negative and non-finite voxels, and those beyond largest_value, are zero, with one warning each that counts them.
/// Any affine transform is accepted; a frustum transform is not. O(active nodes) time and memory. progress receives the
/// fraction done; cancelled, Error(cancelled) is thrown.
ScalarVolume import_volume(const FilePath& file, const std::string& grid_name, const Log& log,
                           Progress* progress = nullptr);

}  // namespace cumulet::volume
