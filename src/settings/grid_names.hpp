#pragma once

// Names by which the grids of a fire are found in a file, in lower case and in order of preference (docs/grids.md).

#include <array>
#include <string_view>

namespace cumulet::settings {

inline constexpr std::array<std::string_view, 3> temperature_names = {"temperature", "heat", "temp"};
inline constexpr std::array<std::string_view, 5> flame_names = {"flame", "flames", "fire", "burn", "fuel"};

}  // namespace cumulet::settings
