#pragma once

#include <string>
#include <string_view>

namespace cumulet::image {

/// Throws std::runtime_error, one line with the path and the cause, if replace_file could not write there. Does not
/// change an existing file. Call it before a long render; replace_file checks again.
void check_writable(const std::string& path);

/// Replaces the content of a file atomically: writes a temporary file in the same folder and renames it, so that on
/// failure the old file remains. Follows links; writes directly to devices and pipes. Throws std::runtime_error as
/// check_writable.
void replace_file(const std::string& path, std::string_view bytes);

/// Returns the content of a file. Throws as check_writable.
[[nodiscard]] std::string read_file(const std::string& path);

}  // namespace cumulet::image
