#pragma once

#include <array>
#include <charconv>
#include <string>
#include <string_view>

/// Names of the OpenEXR attributes that programs look up in rendered files. docs/aovs.md describes their values.
namespace cumulet::image::attributes {

inline constexpr std::string_view comments = "comments";
inline constexpr std::string_view version = "cumulet:version";
inline constexpr std::string_view scene = "cumulet:scene";
inline constexpr std::string_view grid_type = "cumulet:grid_type";
inline constexpr std::string_view background = "cumulet:background";
inline constexpr std::string_view samples = "cumulet:samples";
inline constexpr std::string_view first_sample = "cumulet:first_sample";
inline constexpr std::string_view seed = "cumulet:seed";
inline constexpr std::string_view noise = "cumulet:noise";

/// Value of the background attribute with which the luminance in the error estimate includes the sky.
inline constexpr std::string_view sky_background = "sky";

/// Returns the text of the comments attribute, which describes the file to users.
[[nodiscard]] inline std::string comments_text(const std::string& of_version, double a_pixel) {
  std::array<char, 32> number{};
  char* const end =
      std::to_chars(number.data(), number.data() + number.size(), a_pixel, std::chars_format::general, 6).ptr;
  return "Cumulet " + of_version + ", " + std::string(number.data(), end) + " samples per pixel";
}

}  // namespace cumulet::image::attributes
