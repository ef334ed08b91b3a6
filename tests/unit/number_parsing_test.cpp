// Numbers are read alike by std::from_chars and by the function that replaces it for C++ libraries without it.
#include "base/number_parsing.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <system_error>

namespace {

using cumulet::number_by_strtod;

template <class Number, class Bits>
void expect_same(const std::string& text) {
  SCOPED_TRACE('\'' + text + '\'');
  constexpr Number unchanged = 4711;
  Number wanted = unchanged;
  Number found = unchanged;
  const char* first = text.data();
  const auto by_library = std::from_chars(first, first + text.size(), wanted);
  const auto by_strtod = number_by_strtod(first, first + text.size(), found);
  EXPECT_EQ(by_strtod.ptr - first, by_library.ptr - first);
  EXPECT_EQ(by_strtod.ec, by_library.ec);
  EXPECT_EQ(std::bit_cast<Bits>(found), std::bit_cast<Bits>(wanted));
}

void expect_same(const std::string& text) {
  expect_same<double, std::uint64_t>(text);
  expect_same<float, std::uint32_t>(text);
}

TEST(NumberParsing, BothWaysReadTheSame) {
  for (const char* text : {"0",         "-0",
                           "1",         "-1.5",
                           "3.",        ".25",
                           "1e3",       "1E-3x",
                           "2e",        "2e+",
                           "1.5,7",     "1,5",
                           "12 34",     "",
                           " 1",        "+1",
                           "-",         "--1",
                           "-+1",       ".",
                           "e5",        "0x10",
                           "-0X1p3",    "inf",
                           "-Infinity", "nan",
                           "infx",      "1_000",
                           "1e400",     "-1e400",
                           "1e-400",    "1e39",
                           "1e-46",     "4.9e-324",
                           "1e-40",     "0.1",
                           "16777217",  "9007199254740993",
                           "abc",       "1/2"})
    expect_same(text);
  // A long number, and one that ends within its text.
  expect_same("0." + std::string(400, '3') + "e2");
  expect_same(std::string(60, '9'));
}

TEST(NumberParsing, RandomNumbersAreExact) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    const auto value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    std::array<char, 64> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    expect_same<double, std::uint64_t>({text.data(), end});
  }
}

TEST(NumberParsing, OnlyTheGivenTextIsRead) {
  const std::string text = "12345";
  double number = 0.0;
  const auto result = number_by_strtod(text.data(), text.data() + 2, number);
  EXPECT_EQ(number, 12.0);
  EXPECT_EQ(result.ptr, text.data() + 2);
}

}  // namespace
