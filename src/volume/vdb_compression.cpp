#include "volume/vdb_compression.hpp"

#include <blosc.h>
#include <zlib.h>

#include <vector>

#include "volume/import_detail.hpp"

namespace cumulet::volume::detail {

namespace {

constexpr const char* damaged = "the file is damaged: its compressed values are not as long as it says";

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

void read_compressed(std::istream& in, char* data, std::size_t bytes, std::uint32_t compression) {
  using namespace openvdb::io;
  const auto take = [&](char* to, std::size_t count) {
    if (to != nullptr) {
      in.read(to, static_cast<std::streamsize>(count));
    } else {
      in.seekg(static_cast<std::streamoff>(count), std::ios::cur);
    }
  };
  if ((compression & (COMPRESS_BLOSC | COMPRESS_ZIP)) == 0) {
    take(data, bytes);
    return;
  }
  // Negative, or 0: as they are, for compression would not have made them fewer.
  std::int64_t length = 0;
  in.read(reinterpret_cast<char*>(&length), sizeof length);
  const auto limit = static_cast<std::int64_t>(bytes);
  if (length > limit + BLOSC_MAX_OVERHEAD || (length <= 0 && length != -limit)) fail(damaged);
  if (length <= 0) {
    take(data, bytes);
  } else if (data == nullptr) {
    take(nullptr, static_cast<std::size_t>(length));
  } else {
    std::vector<char> packed(static_cast<std::size_t>(length));
    take(packed.data(), packed.size());
    ((compression & COMPRESS_BLOSC) != 0 ? unpack_blosc : unpack_zip)(packed, data, bytes);
  }
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
