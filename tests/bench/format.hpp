#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace cumulet::bench {

/// Formats like std::printf; at most 1023 bytes.
template <class... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 1024> buffer{};
  std::snprintf(buffer.data(), buffer.size(), pattern, values...);
  return buffer.data();
}

}  // namespace cumulet::bench
