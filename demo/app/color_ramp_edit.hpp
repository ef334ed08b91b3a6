#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ramp.hpp>
#include <span>
#include <string>

namespace cumulet::demo {

/// State of a color ramp's editor.
struct ColorRampView {
  float min_value = 0.0f;  // grid values at the ends of the bar
  float max_value = 1.0f;
  std::optional<std::size_t> held;               // stop dragged by the mouse; the range stays constant meanwhile
  std::optional<settings::ColorStop> taken_off;  // stop dragged off the bar, which returns if the mouse does
  std::size_t chosen = 0;                        // stop whose value and color can be edited
};

/// Fits the range to the stops and to the maximum grid value.
void fit(ColorRampView& view, const settings::ColorStops& stops, float max_value);

/// Returns the color at a value: linear between stops, constant beyond.
[[nodiscard]] std::array<float, 3> color_at(const settings::ColorStops& stops, float value);

/// Inserts a stop that leaves all colors as they are. Returns its index, or that of an existing stop with the same
/// value; nullopt if the maximum number of stops is reached.
std::optional<std::size_t> add_stop(settings::ColorStops& stops, float value);
/// Inserts this stop. Returns its index; nullopt if the maximum number is reached or the value has a stop.
std::optional<std::size_t> insert_stop(settings::ColorStops& stops, const settings::ColorStop& stop);
/// Changes the value of a stop, within the values of its neighbors.
void move_stop(settings::ColorStops& stops, std::size_t index, float value);
/// Removes a stop. Returns false if only two are left, the minimum for a color ramp.
bool remove_stop(settings::ColorStops& stops, std::size_t index);

/// Follows a drag of view.held to a value; off: the mouse is far from the bar, where a stop is removed until it
/// returns. Returns true if the stops have changed.
bool drag_stop(settings::ColorStops& stops, ColorRampView& view, float value, bool off);

/// Common colors for the panel.
struct ColorRampPreset {
  const char* label;
  const char* tip;
  std::span<const std::uint32_t> colors;  // sRGB as 0xrrggbb, at equal steps from the first to the last value
};
[[nodiscard]] std::span<const ColorRampPreset> color_ramp_presets();
/// Returns the stops of a preset for a grid with values from 0 to max_value.
[[nodiscard]] settings::ColorStops stops_of(const ColorRampPreset& preset, float max_value);
/// Returns the first stops of a color ramp over grid `index` (cumulet_ramp): those of density and flame change nothing,
/// and those of temperature are the colors of fire.
[[nodiscard]] settings::ColorStops first_stops(std::size_t index, float max_value, const cumulet_medium_desc& medium);

/// Returns the stops as the flags of color ramps take them: "0:0/0/0,1:1/0.5/0".
[[nodiscard]] std::string color_ramp_text(const settings::ColorStops& stops);
/// Returns the stops of such a text for a color ramp; nullopt if it is not one, or has colors that are too large.
[[nodiscard]] std::optional<settings::ColorStops> color_ramp_of_text(const settings::ColorRampInfo& info,
                                                                     const std::string& text);

}  // namespace cumulet::demo
