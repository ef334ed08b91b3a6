#pragma once

// Private to surface/: what URIs of a glTF file lead to.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surface/gltf_file.hpp"

namespace cumulet::surface::detail {

/// Whether it holds bytes itself (RFC 2397).
bool is_data_uri(std::string_view uri);

/// Paths that a relative reference may mean, the likeliest first: its path by RFC 3986, without query and fragment and
/// percent-decoded; the same with both; the text as it is; and each of these with slashes for backslashes.
std::vector<std::string> paths_of(std::string_view uri);

/// Bytes of a data URI, or of the first of paths_of() that is a file, relative to `folder`. Throws Error(file).
std::vector<std::uint8_t> resolve_uri(const std::string& uri, const std::optional<std::filesystem::path>& folder,
                                      Budget& budget);

}  // namespace cumulet::surface::detail
