#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace cumulet {

/// Makes a text fit for one line of a message. Runs of blanks and control characters become one blank, and blanks at
/// the ends are removed. Bytes that are not UTF-8 become "\xNN". Text longer than about `longest` bytes is cut and ends
/// in "...".
std::string one_line(std::string_view text, std::size_t longest = std::numeric_limits<std::size_t>::max());

}  // namespace cumulet
