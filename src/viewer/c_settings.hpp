#pragma once

// Settings descriptors, checked by the settings table.

#include <algorithm>
#include <string>

#include "settings/settings.hpp"
#include "viewer/c_support.hpp"

namespace cumulet::c_abi {

/// Returns why the descriptor's value of a field is invalid; "" if it is valid.
template <class Desc, class Value>
std::string refusal(const settings::Setting<Desc, Value>& setting, const Desc& desc) {
  const auto& value = desc.*setting.field;
  if constexpr (settings::Enumerated<Value>) {
    const unsigned given = number(value);
    const auto is = [&](const settings::Choice& c) { return given == static_cast<unsigned>(c.value); };
    const bool stands_for_another = given == 0 && setting.zero != 0.0;
    return stands_for_another || std::ranges::any_of(setting.choices, is) ? "" : "is unknown";
  } else if constexpr (settings::Switch<Value>) {
    return value == 0 || value == 1 ? "" : "is not 0 or 1";
  } else if constexpr (settings::Triple<Value> || settings::Rectangle<Value>) {
    const bool holds = std::ranges::all_of(value, [&](auto v) { return setting.range.holds(v); });
    const bool light = setting.range.most == settings::light_range.most;
    return holds ? "" : (light ? "is negative or not finite" : setting.range.refusal());
  } else if constexpr (settings::Real<Value>) {
    const bool stands_for_another = value == Value{} && setting.zero != 0.0;
    return stands_for_another || setting.range.holds(value) ? "" : setting.range.refusal();
  } else {
    static_assert(settings::Count<Value>);
    return setting.range.holds(static_cast<double>(value)) ? "" : setting.range.refusal();
  }
}

/// Reads a host's descriptor and replaces zeros by the defaults that they select. Throws Error(invalid_argument) with
/// the name of the field.
template <class Desc>
Desc read_settings(const Desc* desc) {
  using Table = settings::Table<Desc>;
  Desc checked = read_desc(desc, Table::name);
  settings::for_each<Desc>([&](const auto& setting) {
    const std::string why = refusal(setting, checked);
    if (!why.empty()) refuse(std::string(Table::name) + "." + setting.name + " " + why);
  });
  settings::spell_out_zeros(checked);
  return checked;
}

}  // namespace cumulet::c_abi
