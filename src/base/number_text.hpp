#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <string>

// Numbers as text for messages and files. The text does not depend on the locales of the process: neither on the C
// locale that printf and std::to_string use, nor on the global C++ locale of new streams.

namespace cumulet {

/// Formats like "%.Ng" in the C locale.
inline std::string general_text(double value, int digits = 6) {
  std::array<char, 64> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
  return {text.data(), end};
}

/// Formats like "%.Nf" in the C locale.
inline std::string fixed_text(double value, int decimals) {
  // The largest double has 309 digits.
  std::array<char, 400> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  return {text.data(), end};
}

}  // namespace cumulet
