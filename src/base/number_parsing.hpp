#pragma once

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <clocale>
#include <cmath>
#include <concepts>
#include <cstdlib>
#include <string>
#include <system_error>
#include <type_traits>
#include <version>

#ifdef __APPLE__
#include <xlocale.h>
#endif

// Numbers from text, in any locale of the process.

namespace cumulet {

#ifndef _WIN32
/// As std::from_chars, by strtod. Only for C++ libraries without floating-point numbers in std::from_chars, such as
/// libc++ before version 20.
template <std::floating_point Number>
std::from_chars_result number_by_strtod(const char* first, const char* last, Number& number) {
  static const locale_t c_locale = newlocale(LC_ALL_MASK, "C", locale_t{});
  // strtod also skips blanks and reads plus signs and hexadecimal numbers.
  std::string text(first, std::find_if_not(first, last, [](unsigned char c) {
                     return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
                            c == '+' || c == '.' || c == '(' || c == ')' || c == '_';
                   }));
  if (text.starts_with('+')) return {first, std::errc::invalid_argument};
  const std::size_t sign = text.starts_with('-') ? 1 : 0;
  if (text.substr(sign, 2) == "0x" || text.substr(sign, 2) == "0X") text.resize(sign + 1);
  char* end = nullptr;
  errno = 0;
  Number found{};
  if constexpr (std::is_same_v<Number, float>) {
    found = strtof_l(text.c_str(), &end, c_locale);
  } else {
    found = strtod_l(text.c_str(), &end, c_locale);
  }
  const char* rest = first + (end - text.c_str());
  if (rest == first) return {first, std::errc::invalid_argument};
  if (errno == ERANGE && (found == Number{} || std::isinf(found))) return {rest, std::errc::result_out_of_range};
  number = found;
  return {rest, std::errc{}};
}
#endif

/// Reads a decimal number at the beginning of a text, as std::from_chars does.
template <class Number>
std::from_chars_result number_from_chars(const char* first, const char* last, Number& number) {
#ifndef __cpp_lib_to_chars
  if constexpr (std::is_floating_point_v<Number>) {
    return number_by_strtod(first, last, number);
  } else
#endif
  {
    return std::from_chars(first, last, number);
  }
}

}  // namespace cumulet
