#include "rows.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cumulet::demo {
namespace {

bool shown(const settings::Row& row) { return *row.label != '\0'; }

ImGuiSliderFlags flags_of(const settings::Row& row) {
  return row.logarithmic ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None;
}

/// Draws a slider with the range converted to the value's type. Typed values may have any value that users may set.
template <class Number>
bool slide(Ui& ui, const settings::SettingInfo& info, Number& value, const char* format) {
  const settings::Row& row = info.row;
  const bool zero = value == Number{} && *row.zero != '\0';
  return ui.slider(row.label, row.tip, value, static_cast<Number>(row.least), static_cast<Number>(row.most),
                   zero ? row.zero : format, flags_of(row), info.given.value_or(info.range));
}

}  // namespace

bool Rows::draw(const settings::SettingInfo& info, std::int32_t& value) {
  if (!shown(info.row)) return false;
  bool on = value != 0;
  if (!ui_.checkbox(info.row.label, info.row.tip, on)) return false;
  value = on ? 1 : 0;
  return true;
}

bool Rows::draw(const settings::SettingInfo& info, std::uint32_t& value) {
  if (!shown(info.row)) return false;
  if (info.row.most == 0.0) return ui_.integer(info.row.label, info.row.tip, value);
  return slide(ui_, info, value, "%u");
}

bool Rows::draw(const settings::SettingInfo& info, std::uint64_t& value) {
  return shown(info.row) && slide(ui_, info, value, "%llu");
}

bool Rows::draw(const settings::SettingInfo& info, float& value) {
  return shown(info.row) && slide(ui_, info, value, info.row.format);
}

bool Rows::draw(const settings::SettingInfo& info, double& value) {
  return shown(info.row) && slide(ui_, info, value, info.row.format);
}

bool Rows::draw(const settings::SettingInfo& info, float (&value)[3]) {
  const settings::Row& row = info.row;
  if (!shown(row)) return false;
  if (info.spelling == settings::Spelling::complement) {
    float spelled[3] = {1.0f - value[0], 1.0f - value[1], 1.0f - value[2]};
    if (!ui_.color(row.label, row.tip, spelled)) return false;
    for (std::size_t i = 0; i < 3; ++i) value[i] = std::clamp(1.0f - spelled[i], 0.0f, 1.0f);
    return true;
  }
  if (*row.color == '\0') {
    if (!ui_.color(row.label, row.tip, value)) return false;
    // Black would be all zeros, which means the library's default.
    constexpr float dark = 1e-6f;
    if (info.zero != 0.0) value[0] = std::max(value[0], dark);
    return true;
  }
  std::array<float, 3>& kept = hues_.try_emplace(row.label, row.hue).first->second;
  float strength = std::max({value[0], value[1], value[2]});
  if (strength > 0.0f)
    for (std::size_t i = 0; i < 3; ++i) kept[i] = value[i] / strength;
  float hue[3] = {kept[0], kept[1], kept[2]};
  bool changed = ui_.color(row.color, row.color_tip, hue);
  changed |= ui_.slider(row.label, row.tip, strength, static_cast<float>(row.least), static_cast<float>(row.most),
                        row.format, ImGuiSliderFlags_Logarithmic, info.given.value_or(info.range));
  if (!changed) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    kept[i] = hue[i];
    value[i] = hue[i] * strength;
  }
  return true;
}

bool Rows::draw(const settings::SettingInfo& info, float (&value)[4]) {
  const settings::Row& row = info.row;
  if (!shown(row)) return false;
  constexpr float a_pixel = 0.002f;
  std::array<double, 4> numbers{};
  std::ranges::copy(value, numbers.begin());
  if (!ui_.numbers(row.label, row.tip, numbers, a_pixel)) return false;
  std::ranges::transform(numbers, value,
                         [&](double number) { return static_cast<float>(std::clamp(number, row.least, row.most)); });
  return true;
}

bool Rows::choose(const settings::SettingInfo& info, int& value) {
  if (!shown(info.row)) return false;
  std::vector<Choice> choices;
  for (const settings::Choice& choice : info.choices) choices.push_back({choice.label, choice.value, choice.tip});
  std::ranges::sort(choices, {}, &Choice::value);  // default first
  return ui_.choose(info.row.label, info.row.tip, choices, value);
}

}  // namespace cumulet::demo
