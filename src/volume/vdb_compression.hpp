#pragma once

// Include this before any other OpenVDB header: it specializes the function by which OpenVDB's trees read their values.

#include <openvdb/io/Compression.h>
#include <openvdb/math/Vec3.h>

#include <cstddef>
#include <cstdint>
#include <istream>
#include <vector>

namespace cumulet::volume::detail {

/// Reads bytes that OpenVDB compressed, or skips them if data is null. The length in the file is validated first:
/// OpenVDB writes past its buffer for a damaged negative length, and allocates memory for any positive one. Throws
/// std::runtime_error.
void read_compressed(std::istream& in, char* data, std::size_t bytes, std::uint32_t compression);
/// Appends the bytes that read_compressed() would read, still compressed. Throws the same errors for lengths.
void copy_compressed(std::istream& in, std::vector<char>& to, std::size_t bytes, std::uint32_t compression);
/// Appends `count` bytes.
void copy_bytes(std::istream& in, std::vector<char>& to, std::size_t count);

}  // namespace cumulet::volume::detail

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME::io {

// The value types.
#define CUMULET_VDB_VALUES(OF) \
  OF(math::half)               \
  OF(float)                    \
  OF(double)                   \
  OF(std::int32_t)             \
  OF(std::int64_t)             \
  OF(math::Vec3<math::half>) OF(math::Vec3<float>) OF(math::Vec3<double>) OF(math::Vec3<std::int32_t>)

// Defined once, in vdb_compression.cpp: linkers then prefer these to instances of OpenVDB's template in other code.
#define CUMULET_READ_DATA(T)                                                                                  \
  template <>                                                                                                 \
  void readData<T>(std::istream & in, T * data, Index count, std::uint32_t compression, DelayedLoadMetadata*, \
                   std::size_t);
CUMULET_VDB_VALUES(CUMULET_READ_DATA)
#undef CUMULET_READ_DATA

}  // namespace OPENVDB_VERSION_NAME::io
}  // namespace openvdb
