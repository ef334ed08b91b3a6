#include "volume/vdb_compression.hpp"

#include <blosc.h>
#include <zlib.h>

#include <cstring>
#include <vector>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr const char* damaged = "the file is damaged: wrong size of compressed values";

void unpack_blosc(const std::vector<char>& packed, char* data, std::size_t bytes) {
  std::size_t whole = 0;
  if (packed.size() < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(packed.data(), packed.size(), &whole) != 0 ||
      whole != bytes || blosc_decompress_ctx(packed.data(), data, bytes, 1) != static_cast<int>(bytes)) {
    fail(damaged);
  }
}

void unpack_zip(const std::vector<char>& packed, char* data, std::size_t bytes) {
  uLongf whole = bytes;
  const int status =
      uncompress(reinterpret_cast<Bytef*>(data), &whole, reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || whole != bytes) fail(damaged);
}

}  // namespace

namespace {

bool is_packed(std::uint32_t compression) {
  return (compression & (openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ZIP)) != 0;
}

// Checks the length in the file. It is negative or 0 if the values are not compressed, because compression would not
// have made them smaller.
std::int64_t check_length(std::int64_t length, std::size_t bytes) {
  const auto limit = static_cast<std::int64_t>(bytes);
  if (length > limit + BLOSC_MAX_OVERHEAD || (length <= 0 && length != -limit)) fail(damaged);
  return length;
}

}  // namespace

void read_compressed(std::istream& in, char* data, std::size_t bytes, std::uint32_t compression) {
  const auto take = [&](char* to, std::size_t count) {
    if (to != nullptr) {
      in.read(to, static_cast<std::streamsize>(count));
    } else {
      in.seekg(static_cast<std::streamoff>(count), std::ios::cur);
    }
  };
  if (!is_packed(compression)) {
    take(data, bytes);
    return;
  }
  std::int64_t length = 0;
  in.read(reinterpret_cast<char*>(&length), sizeof length);
  if (check_length(length, bytes) <= 0) {
    take(data, bytes);
  } else if (data == nullptr) {
    take(nullptr, static_cast<std::size_t>(length));
  } else {
    std::vector<char> packed(static_cast<std::size_t>(length));
    take(packed.data(), packed.size());
    ((compression & openvdb::io::COMPRESS_BLOSC) != 0 ? unpack_blosc : unpack_zip)(packed, data, bytes);
  }
}

void copy_bytes(std::istream& in, std::vector<char>& to, std::size_t count) {
  to.resize(to.size() + count);
  in.read(to.data() + to.size() - count, static_cast<std::streamsize>(count));
}

void copy_compressed(std::istream& in, std::vector<char>& to, std::size_t bytes, std::uint32_t compression) {
  if (!is_packed(compression)) {
    copy_bytes(in, to, bytes);
    return;
  }
  std::int64_t length = 0;
  copy_bytes(in, to, sizeof length);
  std::memcpy(&length, to.data() + to.size() - sizeof length, sizeof length);
  copy_bytes(in, to, check_length(length, bytes) <= 0 ? bytes : static_cast<std::size_t>(length));
}

}  // namespace cumulet::volume::detail

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME::io {

#define CUMULET_READ_DATA(T)                                                                                    \
  template <>                                                                                                   \
  void readData<T>(std::istream & in, T * data, Index count, std::uint32_t compression,                         \
                   DelayedLoadMetadata* /*metadata*/, std::size_t /*offset*/) {                                 \
    cumulet::volume::detail::read_compressed(in, reinterpret_cast<char*>(data), sizeof(T) * std::size_t{count}, \
                                             compression);                                                      \
  }
CUMULET_VDB_VALUES(CUMULET_READ_DATA)
#undef CUMULET_READ_DATA

}  // namespace OPENVDB_VERSION_NAME::io
}  // namespace openvdb
