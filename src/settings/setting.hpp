#pragma once

// The description of a setting, and functions that depend only on its type. The table is settings.hpp.

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

/// Returns the shortest text that is read back as the same number: 1e30, not 1e+30.
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
  bool open = false;  // the ends themselves are excluded

  /// Returns false for NaN.
  [[nodiscard]] constexpr bool holds(double value) const {
    return open ? value > least && value < most : value >= least && value <= most;
  }
  /// Returns the error text for a number out of range: "is not from 0 to 1".
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
  const char* old = "";  // its name in scene files of versions 1 and 2, and in older flags; "": the same
};

/// How a value is presented to users.
enum class Spelling {
  as_is,
  complement,       // as 1 - value, because users see a default of 1 and the struct has 0: the albedo
  zero_is_negative  // 0 as -1, because 0 in the struct means the default: the threshold
};

/// A row of the demo's panel. Integers without a maximum have an input field instead of a slider.
struct Row {
  const char* label = "";  // "": none
  const char* tip = "";
  double least = 0.0;
  double most = 0.0;
  const char* format = "%.3f";
  bool logarithmic = false;
  const char* zero = "";  // text for the value 0; "": as a number
  // For colored lights, whose strength is described above:
  const char* color = "";
  const char* color_tip = "";
  std::array<float, 3> hue = {1.0F, 1.0F, 1.0F};  // initial color of a light that was off
};

/// All metadata of a setting. "" means none.
struct SettingInfo {
  const char* name;                           // of the field, in C and C++
  Range range = any_number;                   // accepted by the C API
  std::optional<Range> given = std::nullopt;  // accepted by scene files and flags, if different
  double zero = 0.0;                          // the value that 0 means; for three numbers, if all are 0
  std::span<const Choice> choices = {};       // of an enum
  Spelling spelling = Spelling::as_is;
  const char* key = "";   // in scene files: "medium.anisotropy"
  const char* flag = "";  // "--anisotropy"
  const char* type = "";  // placeholder after the flag in the help text; enums list their names
  const char* help = "";
  Row row = {};
};

/// One field of a descriptor.
template <class Desc, class Value>
struct Setting : SettingInfo {
  Value Desc::*field;

  constexpr Setting(Value Desc::*at, const SettingInfo& info) : SettingInfo(info), field(at) {}

  /// Whether this setting is of that field.
  template <class Other>
  [[nodiscard]] constexpr bool is(Other Desc::*other) const {
    if constexpr (std::is_same_v<Other, Value>) {
      return field == other;
    } else {
      return false;
    }
  }
  /// Returns the range for users.
  [[nodiscard]] constexpr Range given_range() const { return given.value_or(range); }
};

// Kinds of settings, by the type of the field.
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
/// x, y, width, height; a width or height of 0 extends to the border.
template <class Value>
concept Rectangle = std::is_array_v<Value> && std::extent_v<Value>
== 4;

/// Whether all three are 0.
template <class Three>
[[nodiscard]] constexpr bool all_zero(const Three& value) {
  return value[0] == 0 && value[1] == 0 && value[2] == 0;
}

/// rows: a tuple of the settings of a descriptor; name: of its struct.
template <class Desc>
struct Table;

/// Calls visit for each setting of a descriptor.
template <class Desc, class Visit>
constexpr void for_each(Visit&& visit) {
  std::apply([&](const auto&... setting) { (visit(setting), ...); }, Table<Desc>::rows);
}

/// Calls visit for the setting of one field.
template <class Desc, class Value, class Visit>
constexpr void with(Value Desc::*field, Visit&& visit) {
  for_each<Desc>([&](const auto& setting) {
    if constexpr (std::is_same_v<std::decay_t<decltype(setting)>, Setting<Desc, Value>>) {
      if (setting.is(field)) visit(setting);
    }
  });
}

/// Whether all settings of two descriptors are equal.
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

/// Replaces zeros by the values that they mean.
template <class Desc>
constexpr void spell_out_zeros(Desc& desc) {
  for_each<Desc>([&](const auto& setting) {
    auto& value = desc.*setting.field;
    using Value = std::remove_reference_t<decltype(value)>;
    if constexpr (Enumerated<Value> || Count<Value> || Real<Value>) {
      if (value == Value{} && setting.zero != 0.0) value = static_cast<Value>(setting.zero);
    } else if constexpr (Triple<Value>) {
      const bool none = all_zero(value);
      for (auto& component : value)
        component = none && setting.zero != 0.0 ? static_cast<float>(setting.zero) : component;
    }
  });
}

}  // namespace cumulet::settings
