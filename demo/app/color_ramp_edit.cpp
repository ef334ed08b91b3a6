#include "color_ramp_edit.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <image.hpp>
#include <option_values.hpp>

namespace cumulet::demo {

using settings::ColorStop;
using settings::ColorStops;

namespace {

constexpr float farthest = settings::max_ramp_value;

float value_of(const ColorStop& stop) { return stop[0]; }

}  // namespace

void fit(ColorRampView& view, const ColorStops& stops, float max_value) {
  // An undo may have removed the dragged stop.
  if (view.held && *view.held >= stops.size()) view.held.reset();
  view.chosen = std::min(view.chosen, std::max<std::size_t>(stops.size(), 1) - 1);
  if (view.held || view.taken_off || stops.empty()) return;
  view.min_value = std::min(0.0f, value_of(stops.front()));
  view.max_value = std::max(max_value, value_of(stops.back()));
  if (!(view.max_value > view.min_value)) view.max_value = view.min_value + 1.0f;
}

std::array<float, 3> color_at(const ColorStops& stops, float value) {
  const auto above = std::ranges::upper_bound(stops, value, {}, value_of);
  const ColorStop& b = above == stops.end() ? stops.back() : *above;
  const ColorStop& a = above == stops.begin() ? stops.front() : *(above - 1);
  if (above == stops.begin() || above == stops.end()) return {b[1], b[2], b[3]};
  const double along = (double{value} - double{a[0]}) / (double{b[0]} - double{a[0]});
  std::array<float, 3> color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = static_cast<float>(std::lerp(double{a[i + 1]}, double{b[i + 1]}, along));
  return color;
}

std::optional<std::size_t> insert_stop(ColorStops& stops, const ColorStop& stop) {
  const auto at = std::ranges::lower_bound(stops, value_of(stop), {}, value_of);
  const auto index = static_cast<std::size_t>(at - stops.begin());
  if (at != stops.end() && value_of(*at) == value_of(stop)) return std::nullopt;
  if (stops.size() >= settings::max_ramp_points) return std::nullopt;
  stops.insert(at, stop);
  return index;
}

std::optional<std::size_t> add_stop(ColorStops& stops, float value) {
  const auto same = std::ranges::find(stops, value, value_of);
  if (same != stops.end()) return static_cast<std::size_t>(same - stops.begin());
  const std::array<float, 3> color = color_at(stops, value);
  return insert_stop(stops, {value, color[0], color[1], color[2]});
}

void move_stop(ColorStops& stops, std::size_t index, float value) {
  const float least = index > 0 ? std::nextafter(value_of(stops[index - 1]), farthest) : -farthest;
  const float most = index + 1 < stops.size() ? std::nextafter(value_of(stops[index + 1]), -farthest) : farthest;
  stops[index][0] = std::clamp(value, least, most);
}

bool remove_stop(ColorStops& stops, std::size_t index) {
  if (stops.size() <= 2) return false;
  stops.erase(stops.begin() + static_cast<std::ptrdiff_t>(index));
  return true;
}

bool drag_stop(ColorStops& stops, ColorRampView& view, float value, bool off) {
  if (view.taken_off) {
    if (off) return false;
    ColorStop stop = *view.taken_off;
    stop[0] = value;
    // Beside a stop with the same value there is no room: it stays off until the mouse moves on.
    view.held = insert_stop(stops, stop);
    if (!view.held) return false;
    view.chosen = *view.held;
    view.taken_off.reset();
    return true;
  }
  if (!view.held) return false;
  if (off && stops.size() > 2) {
    view.taken_off = stops[*view.held];
    stops.erase(stops.begin() + static_cast<std::ptrdiff_t>(*view.held));
    view.held.reset();
    view.chosen = std::min(view.chosen, stops.size() - 1);
    return true;
  }
  const float before = value_of(stops[*view.held]);
  move_stop(stops, *view.held, value);
  return value_of(stops[*view.held]) != before;
}

namespace {

constexpr auto grayscale = std::to_array<std::uint32_t>({0x000000, 0xffffff});
constexpr auto fire = std::to_array<std::uint32_t>({0x000000, 0x5a0800, 0xc62800, 0xff6a00, 0xffb13c, 0xfff1c8});
constexpr auto gas = std::to_array<std::uint32_t>({0x000000, 0x001a5c, 0x0a50d8, 0x45a8ff, 0xc8ecff});
constexpr auto cool_warm = std::to_array<std::uint32_t>({0x3b4cc0, 0x8db0fe, 0xdddddd, 0xf49a7b, 0xb40426});
constexpr auto viridis = std::to_array<std::uint32_t>(
    {0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725});
constexpr auto dust = std::to_array<std::uint32_t>({0xf6ead6, 0xc9a479, 0x7a5230});
constexpr auto white = std::to_array<std::uint32_t>({0xffffff, 0xffffff});

constexpr auto presets = std::to_array<ColorRampPreset>({
    {"Grayscale", "From black to white.", grayscale},
    {"Fire", "From black over red and orange to a warm white.", fire},
    {"Gas", "From black over blue to a cold white, as a gas flame.", gas},
    {"Cool to warm", "From blue over gray to red.", cool_warm},
    {"Viridis", "From violet over green to yellow, with an even increase of brightness.", viridis},
    {"Dust", "From sand to brown.", dust},
    {"White", "White at all values.", white},
});

}  // namespace

std::span<const ColorRampPreset> color_ramp_presets() { return presets; }

ColorStops stops_of(const ColorRampPreset& preset, float max_value) {
  ColorStops stops;
  const auto steps = static_cast<float>(preset.colors.size() - 1);
  for (const std::uint32_t color : preset.colors) {
    const auto component = [&](unsigned shift) {
      return image::srgb_decode(static_cast<float>(color >> shift & 0xFFU) / 255.0f);
    };
    stops.push_back(
        {max_value * (static_cast<float>(stops.size()) / steps), component(16), component(8), component(0)});
  }
  return stops;
}

ColorStops first_stops(std::size_t index, float max_value, const cumulet_medium_desc& medium) {
  if (index == CUMULET_RAMP_TEMPERATURE) return stops_of({"", "", fire}, max_value);
  ColorStops stops = stops_of({"", "", white}, max_value);
  const auto& color = medium.flame_color;
  const bool colored = std::ranges::any_of(color, [](float component) { return component != 0.0f; });
  if (index == CUMULET_RAMP_FLAME && colored) {
    for (ColorStop& stop : stops) std::ranges::copy(color, stop.begin() + 1);
  }
  return stops;
}

std::string color_ramp_text(const ColorStops& stops) {
  std::string text;
  for (const ColorStop& stop : stops) {
    if (!text.empty()) text += ',';
    text += settings::color_stop_text(stop);
  }
  return text;
}

std::optional<ColorStops> color_ramp_of_text(const settings::ColorRampInfo& info, const std::string& text) {
  try {
    ColorStops stops = parse_color_ramp(info, text);
    if (stops.empty()) return std::nullopt;
    return stops;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace cumulet::demo
