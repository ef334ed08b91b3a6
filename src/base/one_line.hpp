#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace cumulet {

/// Makes a text a part of one line of a message. Runs of blanks and control characters become one blank, and none is
/// left at the ends. Bytes that are not UTF-8 become "\xNN". What is longer than `longest` bytes ends in "...".
std::string one_line(std::string_view text, std::size_t longest = std::numeric_limits<std::size_t>::max());

}  // namespace cumulet
