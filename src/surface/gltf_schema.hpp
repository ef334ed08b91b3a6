#pragma once

// Private to surface/: is every member that the importer reads of the type that glTF 2.0 says?

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace cumulet::surface::detail {

/// Throws Error(file) if brackets nest deeper than any glTF needs: what reads JSON later recurses.
void check_nesting(std::string_view text);

/// Throws Error(file) that names the member. Drops `extras`, makes integers of integral numbers where integers belong,
/// and numbers with a fraction of integers where tinygltf would cut them to 32 bits. The remark, if there is one, names
/// the first of the numbers that are out of glTF's range, and counts the others: they are taken for the nearest that
/// the importer knows what to do with.
std::string check_schema(nlohmann::json& root);

}  // namespace cumulet::surface::detail
