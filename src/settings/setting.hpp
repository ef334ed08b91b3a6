#pragma once

// What is told of a setting, and what follows from its type alone. The table is settings.hpp.

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>

namespace cumulet::settings {

/// The shortest text that is read back as the number: 1e30, not 1e+30.
template <std::floating_point Number>
std::string number_text(Number value) {
  std::array<char, 64> buffer{};
  std::string text(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr);
  std::erase(text, '+');
  return text;
}

struct Range {
  double least = -std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::max();
  bool open = false;  // the ends themselves are out

  /// False for what is not a number.
  [[nodiscard]] constexpr bool holds(double value) const {
    return open ? value > least && value < most : value >= least && value <= most;
  }
  /// What to say of a number that it does not hold: "is not from 0 to 1".
  [[nodiscard]] std::string refusal() const {
    const bool bounded = most < std::numeric_limits<double>::max();
    if (!bounded && least == -most) return "is not finite";
    if (!bounded && !open) return least == 0.0 ? "is negative" : "is less than " + number_text(least);
    if (!bounded) return "is not above " + number_text(least);
    if (open) return "is not between " + number_text(least) + " and " + number_text(most);
    return "is not from " + number_text(least) + " to " + number_text(most);
  }
};

inline constexpr Range any_number;
inline constexpr Range not_negative = {0.0};
inline constexpr Range above_zero = {0.0, std::numeric_limits<double>::max(), true};
/// Radiance and irradiance.
inline constexpr Range light_range = {0.0, 1e30};

/// A value of an enum.
struct Choice {
  const char* name;  // on the command line and in scene files
  int value;
  const char* label;  // in the demo
  const char* tip;
};

/// How people are told of a value.
enum class Spelling {
  as_is,
  complement,       // as 1 - value, since 1 is their default and 0 the struct's: the albedo
  zero_is_negative  // 0 as -1, since 0 is the struct's default: the threshold
};

/// A row of the demo's panel. Integers without a most are typed, not slid.
struct Row {
  const char* label = "";  // "": none
  const char* tip = "";
  double least = 0.0;
  double most = 0.0;
  const char* format = "%.3f";
  bool logarithmic = false;
  const char* zero = "";  // how 0 reads; "": as a number
  // Of a light, whose strength is the above:
  const char* colour = "";
  const char* colour_tip = "";
  std::array<float, 3> hue = {1.0F, 1.0F, 1.0F};  // of a light that was never on
};

/// All that is told of a setting. "" where there is none.
struct Facts {
  const char* name;                           // the field's, in C and C++
  Range range = any_number;                   // what the C API takes
  std::optional<Range> given = std::nullopt;  // what scene files and flags take, if that is another
  double zero = 0.0;                          // what 0 stands for, of three numbers: all of them 0
  std::span<const Choice> choices = {};       // of an enum
  Spelling spelling = Spelling::as_is;
  const char* key = "";   // in scene files: "medium.anisotropy"
  const char* flag = "";  // "--anisotropy"
  const char* type = "";  // what follows the flag, as help has it; enums tell their names
  const char* help = "";
  Row row = {};
};

/// One field of a descriptor.
template <class Desc, class Value>
struct Setting : Facts {
  Value Desc::*field;

  constexpr Setting(Value Desc::*at, const Facts& facts) : Facts(facts), field(at) {}

  /// Whether it is this field.
  template <class Other>
  [[nodiscard]] constexpr bool is(Other Desc::*other) const {
    if constexpr (std::is_same_v<Other, Value>) {
      return field == other;
    } else {
      return false;
    }
  }
  /// What people may give.
  [[nodiscard]] constexpr Range given_range() const { return given.value_or(range); }
};

// Kinds, by a field's type.
template <class Value>
concept Enumerated = std::is_enum_v<Value>;
template <class Value>
concept Switch = std::same_as<Value, std::int32_t>;
template <class Value>
concept Count = std::unsigned_integral<Value>;
template <class Value>
concept Real = std::floating_point<Value>;
template <class Value>
concept Triple = std::is_array_v<Value> && std::extent_v<Value>
== 3;
/// x, y, width, height; a width or height of 0 reaches to the end.
template <class Value>
concept Rectangle = std::is_array_v<Value> && std::extent_v<Value>
== 4;

/// Whether all three are 0.
template <class Three>
[[nodiscard]] constexpr bool all_zero(const Three& value) {
  return value[0] == 0 && value[1] == 0 && value[2] == 0;
}

/// rows: a tuple of a descriptor's settings; name: of its struct.
template <class Desc>
struct Table;

/// Calls visit for each setting of a descriptor.
template <class Desc, class Visit>
constexpr void for_each(Visit&& visit) {
  std::apply([&](const auto&... setting) { (visit(setting), ...); }, Table<Desc>::rows);
}

/// Calls visit for one field's setting.
template <class Desc, class Value, class Visit>
constexpr void with(Value Desc::*field, Visit&& visit) {
  for_each<Desc>([&](const auto& setting) {
    if constexpr (std::is_same_v<std::decay_t<decltype(setting)>, Setting<Desc, Value>>) {
      if (setting.is(field)) visit(setting);
    }
  });
}

/// Whether two descriptors say the same.
template <class Desc>
[[nodiscard]] constexpr bool same(const Desc& a, const Desc& b) {
  bool all = true;
  for_each<Desc>([&](const auto& setting) {
    const auto& x = a.*setting.field;
    const auto& y = b.*setting.field;
    if constexpr (std::is_array_v<std::remove_cvref_t<decltype(x)>>) {
      for (std::size_t i = 0; i < std::size(x); ++i) all = all && x[i] == y[i];
    } else {
      all = all && x == y;
    }
  });
  return all;
}

/// Replaces zeros by what they stand for.
template <class Desc>
constexpr void spell_out_zeros(Desc& desc) {
  for_each<Desc>([&](const auto& setting) {
    auto& value = desc.*setting.field;
    using Value = std::remove_reference_t<decltype(value)>;
    if constexpr (Count<Value> || Real<Value>) {
      if (value == Value{} && setting.zero != 0.0) value = static_cast<Value>(setting.zero);
    } else if constexpr (Triple<Value>) {
      const bool none = all_zero(value);
      for (auto& component : value)
        component = none && setting.zero != 0.0 ? static_cast<float>(setting.zero) : component;
    }
  });
}

}  // namespace cumulet::settings
