#pragma once

#include <array>
#include <map>
#include <settings.hpp>
#include <string>

#include "ui.hpp"

namespace cumulet::demo {

/// Panel rows of settings, as described in the settings table. Each draw() shows a value and returns true if the user
/// changed it. Settings without a row are not drawn.
class Rows {
 public:
  explicit Rows(Ui& ui) : ui_(ui) {}
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;
  ~Rows() = default;

  bool draw(const settings::SettingInfo& info, std::int32_t& value);
  bool draw(const settings::SettingInfo& info, std::uint32_t& value);
  bool draw(const settings::SettingInfo& info, std::uint64_t& value);
  bool draw(const settings::SettingInfo& info, float& value);
  bool draw(const settings::SettingInfo& info, double& value);
  /// Draws a light's color and strength (the largest component), or only a color.
  bool draw(const settings::SettingInfo& info, float (&value)[3]);
  /// Draws the numbers of a rectangle.
  bool draw(const settings::SettingInfo& info, float (&value)[4]);
  template <settings::Enumerated Enum>
  bool draw(const settings::SettingInfo& info, Enum& value) {
    int number = static_cast<int>(value);
    if (!choose(info, number)) return false;
    value = static_cast<Enum>(number);
    return true;
  }

 private:
  bool choose(const settings::SettingInfo& info, int& value);

  Ui& ui_;
  std::map<std::string, std::array<float, 3>> hues_;  // colors of lights, kept while their strength is 0
};

}  // namespace cumulet::demo
