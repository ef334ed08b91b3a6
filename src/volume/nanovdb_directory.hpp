#pragma once

// Private to volume/: the grids in a NanoVDB file, and their positions.

#include <cstdint>
#include <string>
#include <vector>

#include "volume/nanovdb_version.hpp"
#include "volume/source_file.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume::detail {

/// Location of the bytes of one grid.
struct NanoLocation {
  std::uint64_t position;
  std::uint64_t file_bytes;
  std::uint64_t memory_bytes;
  nanovdb::io::Codec codec;
  nanovdb::GridType type;
};

/// All sizes are within the file. locations[i] belongs to grids[i].
struct NanoDirectory {
  std::string format;                ///< "NanoVDB 32.9"
  std::vector<std::string> remarks;  ///< one warning each
  std::vector<NanoLocation> locations;
  std::vector<GridInfo> grids;
};

/// Reads segments (magic numbers NanoVDB0 and NanoVDB2) and grid buffers without a header (NanoVDB0 and NanoVDB1), one
/// after another. Throws for versions other than 32.
NanoDirectory read_nano_directory(SourceFile& stream);

/// Whether the magic number of this grid is valid.
bool is_nano_grid(const nanovdb::GridData& grid);

/// Whether the checksum of a grid's head is correct, by the rule of the version that wrote it. Returns true if the grid
/// has no checksum or an unknown newer version. root_bytes: size of the root with its tiles. It follows the tree and is
/// within the grid.
bool has_right_checksum(const nanovdb::GridData& grid, std::uint64_t root_bytes);

bool is_nano_scalar(nanovdb::GridType type);
bool is_nano_vector(nanovdb::GridType type);

}  // namespace cumulet::volume::detail
