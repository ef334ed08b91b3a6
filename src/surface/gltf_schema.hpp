#pragma once

// Private to surface/: checks that members read by the importer have the types that glTF 2.0 requires.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace cumulet::surface::detail {

/// Throws Error(file) if brackets nest deeper than any glTF needs, because JSON readers recurse.
void check_nesting(std::string_view text);

/// Checks member types and throws Error(file) with the name of the member. Drops `extras`. Converts integral numbers to
/// integers where integers belong. Converts integers to floating point where tinygltf would truncate them to 32 bits.
/// Returns a remark that names the first number out of glTF's range and counts the others, or "". The importer later
/// clamps such numbers to the nearest usable value.
std::string check_schema(nlohmann::json& root);

}  // namespace cumulet::surface::detail
