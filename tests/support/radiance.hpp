#pragma once

#include <cstdint>
#include <string>

namespace cumulet::test {

/// The bytes of an uncompressed Radiance (.hdr) file: bright in its left eighth, another color elsewhere.
inline std::string radiance_file(std::uint32_t width, std::uint32_t height) {
  std::string file =
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
  for (std::uint32_t i = 0; i < width * height; ++i)
    file += i % width < width / 8 ? "\xC0\x60\x30\x83" : "\x20\x40\x80\x7F";
  return file;
}

}  // namespace cumulet::test
