#include "light_color_rows.hpp"

#include <algorithm>
#include <utility>

namespace cumulet::demo {
namespace {

constexpr int by_color = 0;
constexpr int by_temperature = 1;
constexpr float tolerance = 1e-3f;

Rgb scaled(const Rgb& color, float factor) { return {factor * color[0], factor * color[1], factor * color[2]}; }

}  // namespace

bool LightColorRows::temperature(Rgb& color) {
  const auto now = nearest_kelvin(color);
  double kelvin = now ? now->kelvin : max_kelvin;
  if (!ui_.slider(
          "Color temperature",
          "Candles have about 1900 K, bulbs 2700 K, the sun 5800 K and a blue sky 12000 K. The brightness stays.",
          kelvin, min_kelvin, 12000.0, "%.0f K", 0, settings::Range{min_kelvin, max_kelvin}))
    return false;
  color = scaled(color_of_kelvin(kelvin), luminance_of(color));
  return true;
}

bool LightColorRows::draw(const char* label, const char* tip, float (&rgb)[3]) {
  Rgb color = std::to_array(rgb);
  const auto now = nearest_kelvin(color);
  const bool is_body = now && now->distance < tolerance && as_color_ != color;
  int mode = is_body ? by_temperature : by_color;
  bool changed = false;
  if (ui_.choose("Color by", "A free color, or the color temperature of a lamp. Scene files store the color.",
                 {{"Color", by_color, "A color from the picker."},
                  {"Temperature", by_temperature, "A color temperature in kelvin, as lamps are labeled."}},
                 mode)) {
    as_color_.reset();
    if (mode == by_color) as_color_ = color;
    if (mode == by_temperature && now) {
      color = scaled(color_of_kelvin(now->kelvin), luminance_of(color));
      changed = true;
    }
  }
  if (mode == by_temperature) {
    changed |= temperature(color);
  } else {
    // A color field ends at 1. The brightness of a brighter color stays.
    const float peak = std::max({1.0f, color[0], color[1], color[2]});
    float shown[3] = {color[0] / peak, color[1] / peak, color[2] / peak};
    if (ui_.color(label, tip, shown)) {
      color = scaled(std::to_array(shown), peak);
      as_color_ = color;
      changed = true;
    }
  }
  if (changed) std::ranges::copy(color, rgb);
  return changed;
}

}  // namespace cumulet::demo
