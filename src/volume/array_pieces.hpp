#pragma once

// Private to volume/: the encoded bytes of an array, decoded in order.

#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/byte_source.hpp"
#include "volume/array_field.hpp"

namespace cumulet::volume::detail {

/// Bytes that are read together, at most.
inline constexpr std::size_t piece_bytes = std::size_t{1} << 20U;

/// Bytes in order. Methods throw std::runtime_error.
class Pieces {
 public:
  Pieces() = default;
  Pieces(const Pieces&) = delete;
  Pieces& operator=(const Pieces&) = delete;
  virtual ~Pieces() = default;
  /// Returns the number of bytes written, which is smaller only at the end.
  virtual std::size_t read(char* to, std::size_t count) = 0;
  /// Ends a base64 stream with its padding. Another one follows directly.
  virtual void end_stream() {}
  /// Reads over `count` bytes, or over all of them if there are fewer. Returns their number.
  std::uint64_t skip(std::uint64_t count);
};

/// Returns the decoded bytes of a field's values. count: that of the numbers that are read; only a field whose values
/// are at the end of the content needs it.
std::unique_ptr<Pieces> open_pieces(ByteSource& content, const ArrayField& field, std::uint64_t count);
/// Returns the most numbers of a field that a content of this size can hold, without reading it.
std::uint64_t max_numbers(const ByteSource& content, const ArrayField& field);

}  // namespace cumulet::volume::detail
