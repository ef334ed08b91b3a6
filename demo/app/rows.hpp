#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <scene_file.hpp>
#include <settings.hpp>
#include <string>
#include <type_traits>

#include "model.hpp"
#include "ui.hpp"

namespace cumulet::demo {

/// Returns the defaults of a new scene, with a clear day.
template <class Desc>
const Desc& default_of() {
  static const Desc made = [] {
    Desc desc{};
    desc.struct_size = sizeof desc;
    SceneOptions scene;
    scene.set_daylight();
    scene.sampling.samples = default_samples;
    spell_out_defaults(scene);
    for_each_group(scene, [&](const auto& group) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(group)>, Desc>) desc = group;
    });
    settings::spell_out_zeros(desc);
    // Sequences that are opened in the demo are repeated.
    if constexpr (std::is_same_v<Desc, cumulet_playback_desc>) desc.repeat = CUMULET_REPEAT_LOOP;
    return desc;
  }();
  return made;
}

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
  /// Draws a setting and marks it if it differs from the default. A right click sets the default.
  template <class Desc, class Value>
  bool draw(const settings::Setting<Desc, Value>& setting, Value& value) {
    const settings::SettingInfo& info = setting;
    const bool changed = draw(info, value);
    if (*info.row.label == '\0') return changed;
    const Value& standard = default_of<Desc>().*setting.field;
    if constexpr (std::is_array_v<Value>) {
      if (!ui_.resets(!std::ranges::equal(value, standard))) return changed;
      std::ranges::copy(standard, value);
    } else {
      if (!ui_.resets(value != standard)) return changed;
      value = standard;
    }
    return true;
  }
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
