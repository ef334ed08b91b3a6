#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <vector>

namespace cumulet {

/// Appends the rest of a stream, whose size may be unknown (a pipe). A failure leaves bad() set. added(count) is called
/// after each piece of at most 1 MiB, and may throw.
template <class Added>
void read_rest(std::istream& stream, std::vector<std::uint8_t>& bytes, Added&& added) {
  constexpr std::size_t piece = std::size_t{1} << 20U;
  while (stream) {
    const std::size_t before = bytes.size();
    bytes.resize(before + piece);
    stream.read(reinterpret_cast<char*>(bytes.data() + before), piece);
    bytes.resize(before + static_cast<std::size_t>(stream.gcount()));
    added(bytes.size() - before);
  }
}

}  // namespace cumulet
