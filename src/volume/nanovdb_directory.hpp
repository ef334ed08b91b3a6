#pragma once

// Private to volume/: which grids a NanoVDB file holds, and where.

#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/IO.h>

#include <cstdint>
#include <string>
#include <vector>

#include "volume/source_file.hpp"
#include "volume/volume.hpp"

namespace cumulet::volume::detail {

/// Where the bytes of one grid are.
struct NanoPlace {
  std::uint64_t position;
  std::uint64_t file_bytes;
  std::uint64_t memory_bytes;
  nanovdb::io::Codec codec;
  nanovdb::GridType type;
};

/// Every size in it lies within the file. places[i] belongs to grids[i].
struct NanoDirectory {
  std::string format;                ///< "NanoVDB 32.9"
  std::vector<std::string> remarks;  ///< one warning each
  std::vector<NanoPlace> places;
  std::vector<GridInfo> grids;
};

/// Reads segments (magic numbers NanoVDB0 and NanoVDB2) and buffers of grids without any header (NanoVDB0 and
/// NanoVDB1), one after another. Throws for other versions than 32.
NanoDirectory read_nano_directory(SourceFile& stream);

/// Whether the grid that begins with these bytes has a magic number of a grid.
bool is_nano_grid(const nanovdb::GridData& grid);

/// Whether the checksum of a grid's head is right, by the rule of the version that wrote it. True where the grid has
/// no checksum, and where the version is newer than the known ones. root_bytes: size of the root with its tiles, which
/// follows the tree and lies within the grid.
bool has_right_checksum(const nanovdb::GridData& grid, std::uint64_t root_bytes);

bool is_nano_scalar(nanovdb::GridType type);
bool is_nano_vector(nanovdb::GridType type);

}  // namespace cumulet::volume::detail
