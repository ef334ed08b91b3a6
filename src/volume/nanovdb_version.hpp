#pragma once

// Private to volume/: NanoVDB of OpenVDB 10 to 13. Its headers and types have other names in some versions.

#include <nanovdb/NanoVDB.h>

#if NANOVDB_MINOR_VERSION_NUMBER < 6
#include <nanovdb/util/IO.h>  // since OpenVDB 11, NanoVDB.h defines the types of files
#endif

#include <bit>
#include <cstdint>

namespace cumulet::volume::detail {

#if NANOVDB_MINOR_VERSION_NUMBER < 6
using NanoTreeData = nanovdb::TreeData<>;
using NanoFileHeader = nanovdb::io::Header;
using NanoFileMetaData = nanovdb::io::MetaData;
#else
using NanoTreeData = nanovdb::TreeData;
using NanoFileHeader = nanovdb::io::FileHeader;
using NanoFileMetaData = nanovdb::io::FileMetaData;
#endif

/// Entry of a grid's table of blind data. OpenVDB 11 renamed the members.
struct NanoBlindData {
  std::int64_t data_offset;
  std::uint64_t value_count;
  std::uint32_t value_size;
  std::uint32_t semantic;
  std::uint32_t data_class;
  std::uint32_t data_type;
  char name[256];
};

// The layouts of files are the same in all versions of NanoVDB 32.
static_assert(NANOVDB_MAJOR_VERSION_NUMBER == 32);
static_assert(sizeof(nanovdb::GridData) == 672 && sizeof(NanoTreeData) == 64);
static_assert(sizeof(NanoFileHeader) == 16 && sizeof(NanoFileMetaData) == 176);
static_assert(sizeof(NanoBlindData) == sizeof(nanovdb::GridBlindMetaData));

/// An integer up to OpenVDB 10, a class since 11.
inline std::uint32_t flags_of(const nanovdb::GridData& grid) { return std::bit_cast<std::uint32_t>(grid.mFlags); }
/// An integer up to OpenVDB 11, a class since 12. The lower half is the checksum of the grid's head.
inline std::uint64_t checksum_of(const nanovdb::GridData& grid) { return std::bit_cast<std::uint64_t>(grid.mChecksum); }

}  // namespace cumulet::volume::detail
