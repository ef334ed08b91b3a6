#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <string>

// Texts of numbers for messages and files. They do not depend on the process' locales, neither C's, which printf and
// std::to_string follow, nor C++'s global one, which every new stream takes.

namespace cumulet {

/// As "%.Ng" prints it in the C locale.
inline std::string general_text(double value, int digits = 6) {
  std::array<char, 64> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
  return {text.data(), end};
}

/// As "%.Nf" prints it in the C locale.
inline std::string fixed_text(double value, int decimals) {
  // The largest double has 309 digits.
  std::array<char, 400> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  return {text.data(), end};
}

}  // namespace cumulet
