#pragma once

// Before any other header of OpenVDB's: its trees read their values by what is specialised here.

#include <openvdb/io/Compression.h>
#include <openvdb/math/Vec3.h>

#include <cstddef>
#include <cstdint>
#include <istream>
#include <vector>

namespace cumulet::volume::detail {

/// Reads bytes that OpenVDB compressed, or skips them if data is null. What the file says of their length is checked
/// before it is believed: OpenVDB writes past its buffer where a damaged length is negative, and allocates whatever a
/// positive one says. Throws std::runtime_error.
void read_compressed(std::istream& in, char* data, std::size_t bytes, std::uint32_t compression);
/// Appends what read_compressed would read, as the file has it. Throws the same of lengths.
void copy_compressed(std::istream& in, std::vector<char>& to, std::size_t bytes, std::uint32_t compression);
/// Appends these bytes.
void copy_bytes(std::istream& in, std::vector<char>& to, std::size_t count);

}  // namespace cumulet::volume::detail

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME::io {

// What values may be.
#define CUMULET_VDB_VALUES(OF) \
  OF(math::half)               \
  OF(float)                    \
  OF(double)                   \
  OF(std::int32_t)             \
  OF(std::int64_t)             \
  OF(math::Vec3<math::half>) OF(math::Vec3<float>) OF(math::Vec3<double>) OF(math::Vec3<std::int32_t>)

// Defined once, in vdb_compression.cpp: linkers then prefer these to what other code makes of OpenVDB's template.
#define CUMULET_READ_DATA(T)                                                                                  \
  template <>                                                                                                 \
  void readData<T>(std::istream & in, T * data, Index count, std::uint32_t compression, DelayedLoadMetadata*, \
                   std::size_t);
CUMULET_VDB_VALUES(CUMULET_READ_DATA)
#undef CUMULET_READ_DATA

}  // namespace OPENVDB_VERSION_NAME::io
}  // namespace openvdb
