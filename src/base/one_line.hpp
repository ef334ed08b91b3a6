#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace cumulet {

/// A text for a message: control characters and blanks in a row are one blank, none at the ends. What is longer than
/// `longest` bytes ends in "...".
inline std::string one_line(std::string_view text, std::size_t longest = std::numeric_limits<std::size_t>::max()) {
  std::string line;
  for (const char c : text) {
    const bool blank = static_cast<unsigned char>(c) <= ' ' || c == '\x7f';
    if (blank && (line.empty() || line.back() == ' ')) continue;
    line += blank ? ' ' : c;
    if (line.size() >= longest) {
      line.append(3, '.');  // gcc 12 warns of += where it is inlined
      break;
    }
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace cumulet
