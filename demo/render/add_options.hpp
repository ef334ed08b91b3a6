#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <names.hpp>
#include <program.hpp>
#include <settings.hpp>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "old_flags.hpp"
#include "option_values.hpp"

namespace cumulet::demo {

/// Adds a flag with a value. If it is repeated, the last one wins. A bad value is an error that names the flag.
inline CLI::Option* add(CLI::App& app, const char* group, const std::string& flag, const std::string& type,
                        std::function<void(const std::string&)> parse, const std::string& help) {
  const auto checked = [flag, parse = std::move(parse)](const std::string& text) {
    try {
      parse(text);
    } catch (const UsageError& error) {
      // The long spelling is easier to recognize in a script's log.
      throw CLI::ValidationError(flag.substr(flag.rfind("--")), error.what());
    }
  };
  return app.add_option_function<std::string>(flag, checked, help)->type_name(type)->group(group)->take_last();
}

/// Adds a flag whose text is the value.
inline void add_text(CLI::App& app, const char* group, const std::string& flag, const std::string& type,
                     std::string& target, const std::string& help) {
  add(
      app, group, flag, type, [&target](const std::string& text) { target = text; }, help);
}

/// Adds a flag with the name of a file or, if the type is DIR, of a folder. An empty name is an error.
inline void add_path(CLI::App& app, const char* group, const std::string& flag, const std::string& type,
                     std::function<void(const std::string&)> take, const std::string& help) {
  add(
      app, group, flag, type,
      [kind = type == "DIR" ? "folder" : "file", take = std::move(take)](const std::string& text) {
        if (text.empty()) throw UsageError(std::string("the ") + kind + "'s name is empty");
        take(text);
      },
      help);
}
inline void add_path(CLI::App& app, const char* group, const std::string& flag, const std::string& type,
                     std::string& target, const std::string& help) {
  add_path(
      app, group, flag, type, [&target](const std::string& text) { target = text; }, help);
}

/// Returns the value with this name; null if there is none. Reports a name of an earlier version. of: the text before
/// the name on the command line.
template <class Names>
auto* find_choice(const CLI::App& app, const std::string& of, const Names& names, std::string_view text) {
  for (const auto& name : names) {
    if (text == name.name) return &name;
    if constexpr (requires { name.old; }) {
      if (text.empty() || text != name.old) continue;
      report_renamed(app, of + ' ' + name.old, of + ' ' + name.name);
      return &name;
    }
  }
  return static_cast<decltype(&*std::begin(names))>(nullptr);
}

template <class Names, class Target>
CLI::Option* add_choice(CLI::App& app, const char* group, const std::string& flag, const Names& names, Target& target,
                        const std::string& help) {
  return add(
      app, group, flag, list_names(names, "|"),
      [&app, flag, names, &target](const std::string& text) {
        const auto* const found = find_choice(app, flag, names, text);
        if (found == nullptr) throw UsageError(in_quotes(text) + " is not one of " + list_names(names, ", "));
        target = static_cast<Target>(found->value);
      },
      help);
}

/// Returns true if the flag's text is a keyword that has been handled, so that it is not parsed as a value.
using TakeWord = std::function<bool(std::string_view flag, const std::string& text)>;

/// Parses a number in the range that users may set and that the field can represent.
template <class Desc, class Value>
Value parse_real(const settings::Setting<Desc, Value>& setting, const std::string& text) {
  const double number = parse_number(text);
  const auto value = static_cast<Value>(number);
  const settings::Range range = setting.given_range();
  if (!range.holds(number) || !range.holds(value)) throw UsageError(in_quotes(text) + " " + range.refusal());
  const bool negative = setting.spelling == settings::Spelling::zero_is_negative && value == Value{};
  return negative ? Value{-1} : value;
}

/// Parses a whole number in the range that users may set and that the field can represent.
template <class Desc, class Value>
Value parse_count(const settings::Setting<Desc, Value>& setting, const std::string& text) {
  const settings::Range range = setting.given_range();
  constexpr auto most = static_cast<double>(std::numeric_limits<Value>::max());
  return static_cast<Value>(parse_integer(
      text, static_cast<std::uint64_t>(std::max(range.least, 0.0)),
      range.most < most ? static_cast<std::uint64_t>(range.most) : std::uint64_t{std::numeric_limits<Value>::max()}));
}

/// Parses three numbers in the range that users may set and that the field can represent.
template <class Desc, class Value>
void parse_triple(const settings::Setting<Desc, Value>& setting, const std::string& text, Value& value) {
  const std::array<double, 3> given = parse_three(text, setting.given_range());
  if (setting.zero != 0.0 && settings::all_zero(given)) throw UsageError(in_quotes(text) + " must not be black");
  const bool complement = setting.spelling == settings::Spelling::complement;
  for (std::size_t i = 0; i < 3; ++i)
    value[i] = static_cast<std::remove_extent_t<Value>>(complement ? 1.0 - given[i] : given[i]);
}

/// Parses x, y, width and height.
template <class Desc, class Value>
void parse_rectangle(const settings::Setting<Desc, Value>& setting, const std::string& text, Value& value) {
  const std::vector<double> given = parse_numbers(text, 4);
  for (const double number : given)
    if (!setting.given_range().holds(number))
      throw UsageError(in_quotes(text) + " has a number that " + setting.given_range().refusal());
  std::ranges::transform(given, value, [](double number) { return static_cast<std::remove_extent_t<Value>>(number); });
}

template <class Desc, class Value>
void add_setting(CLI::App& app, const char* group, const settings::Setting<Desc, Value>& setting, Value& value,
                 const TakeWord& take_word) {
  const auto add_parsed = [&](auto parse) {
    const auto parse_or_take = [flag = setting.flag, parse, take_word](const std::string& text) {
      if (!take_word || !take_word(flag, text)) parse(text);
    };
    add(app, group, setting.flag, setting.type, parse_or_take, setting.help);
  };
  if constexpr (settings::Enumerated<Value>) {
    add_choice(app, group, setting.flag, setting.choices, value, setting.help);
  } else if constexpr (settings::Switch<Value>) {
    if (*setting.type != '\0') {
      add_choice(app, group, setting.flag, std::array{Name{"on", 1}, Name{"off", 0}}, value, setting.help);
    } else {
      app.add_flag_function(
             setting.flag, [&value](std::int64_t count) { value = count > 0 ? 1 : 0; }, setting.help)
          ->group(group);
    }
  } else if constexpr (settings::Count<Value>) {
    add_parsed([&value, setting](const std::string& text) { value = parse_count(setting, text); });
  } else if constexpr (settings::Real<Value>) {
    add_parsed([&value, setting](const std::string& text) { value = parse_real(setting, text); });
  } else if constexpr (settings::Rectangle<Value>) {
    add_parsed([&value, setting](const std::string& text) { parse_rectangle(setting, text, value); });
  } else {
    add_parsed([&value, setting](const std::string& text) { parse_triple(setting, text, value); });
  }
}

/// Adds the flags of a descriptor's settings.
template <class Desc>
void add_settings(CLI::App& app, const char* group, Desc& desc, const TakeWord& take_word = {}) {
  settings::for_each<Desc>([&](const auto& setting) {
    if (*setting.flag != '\0') add_setting(app, group, setting, desc.*setting.field, take_word);
  });
}

}  // namespace cumulet::demo
