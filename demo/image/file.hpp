#pragma once

#include <string>
#include <string_view>

namespace cumulet::image {

/// Throws std::runtime_error, one line with the path and the cause, if replace_file could not write there. Leaves
/// what is there untouched. To be asked before hours of work, not instead of the check while writing.
void check_writable(const std::string& path);

/// Makes the file hold exactly these bytes: they go to a temporary sibling, which then takes the file's name, so that
/// a failure leaves the old file, never half a new one. Links are followed; devices and pipes are written directly.
/// Throws std::runtime_error as check_writable does.
void replace_file(const std::string& path, std::string_view bytes);

/// All of a file. Throws likewise.
[[nodiscard]] std::string read_file(const std::string& path);

}  // namespace cumulet::image
