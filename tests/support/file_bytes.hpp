#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace cumulet::test {

/// The content of a file; "" if it cannot be read.
inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace cumulet::test
