#pragma once

// Private to surface/: resolves the URIs of a glTF file.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surface/budget.hpp"

namespace cumulet::surface::detail {

/// Returns true if the URI itself holds bytes (RFC 2397).
bool is_data_uri(std::string_view uri);

/// Returns the paths that a relative reference may mean, the likeliest first. They are: the path by RFC 3986,
/// percent-decoded and without query and fragment; the path with both; the text unchanged; and each of these with
/// slashes for backslashes.
std::vector<std::string> paths_of(std::string_view uri);

/// Returns the bytes of a data URI, or of the first of paths_of() that is a file, relative to `folder`. Throws
/// Error(file).
std::vector<std::uint8_t> resolve_uri(const std::string& uri, const std::optional<std::filesystem::path>& folder,
                                      Budget& budget);

}  // namespace cumulet::surface::detail
