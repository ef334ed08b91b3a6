#pragma once

#include <cumulet/cumulet.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <scene_file.hpp>
#include <settings.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace cumulet::demo {

// Parsers of the values of flags. Each throws UsageError. Numbers are parsed independently of the locale.

/// Parses a finite number; nothing else may follow.
[[nodiscard]] double parse_number(std::string_view text);
/// Parses exactly `count` numbers, separated by commas.
[[nodiscard]] std::vector<double> parse_numbers(std::string_view text, std::size_t count);
/// Parses an integer from `least` to `most`.
[[nodiscard]] std::uint64_t parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most);
/// Parses three numbers in a range.
[[nodiscard]] std::array<double, 3> parse_three(std::string_view text, const settings::Range& range);

void parse_size(std::string_view text, SceneOptions& scene);
/// Sets eye, target and field of view; keeps the lens.
void parse_camera(std::string_view text, cumulet_camera_desc& camera);
void parse_sun(std::string_view text, cumulet_sun_sky_desc& light);
void parse_sky_model(std::string_view text, cumulet_sun_sky_desc& light);
[[nodiscard]] settings::RampPoints parse_ramp(std::string_view text);
/// Parses stops of a value and a color: "0:#ff8000,1:1/0.5/0", in sRGB or linear Rec. 709.
[[nodiscard]] settings::ColorStops parse_color_ramp(const settings::ColorRampInfo& info, std::string_view text);
[[nodiscard]] std::optional<settings::ClipBox> parse_clip_box(std::string_view text);
[[nodiscard]] std::vector<settings::ClipPlane> parse_clip_planes(std::string_view text);
[[nodiscard]] std::vector<std::string> parse_light_groups(std::string_view text);

[[nodiscard]] std::string in_quotes(std::string_view text);
[[nodiscard]] std::vector<std::string_view> split(std::string_view text, char separator);
/// Splits a value such as "0,0,1 0,0,0 40" at white space.
[[nodiscard]] std::vector<std::string_view> words(std::string_view text);

}  // namespace cumulet::demo
