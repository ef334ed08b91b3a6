#pragma once

// Colors of light by its color temperature, as lamps are labeled. The library has no kelvin for lights: scene files
// store the color.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace cumulet::demo {

inline constexpr double min_kelvin = 1000.0;
inline constexpr double max_kelvin = 20000.0;

/// Linear Rec. 709.
using Rgb = std::array<float, 3>;

namespace detail {

/// light::black_body_color() at equal steps of 1 / kelvin, from the coldest to the hottest.
// clang-format off
inline constexpr std::array black_body_colors = {
    Rgb{4.5710f, 0.0394f, 0.0000f}, Rgb{4.4809f, 0.0662f, 0.0000f}, Rgb{4.3892f, 0.0935f, 0.0000f},
    Rgb{4.2958f, 0.1212f, 0.0000f}, Rgb{4.2009f, 0.1495f, 0.0000f}, Rgb{4.1044f, 0.1781f, 0.0000f},
    Rgb{4.0065f, 0.2072f, 0.0000f}, Rgb{3.9071f, 0.2368f, 0.0000f}, Rgb{3.8064f, 0.2667f, 0.0000f},
    Rgb{3.7043f, 0.2971f, 0.0000f}, Rgb{3.6010f, 0.3278f, 0.0000f}, Rgb{3.4966f, 0.3588f, 0.0000f},
    Rgb{3.3912f, 0.3901f, 0.0000f}, Rgb{3.2848f, 0.4218f, 0.0000f}, Rgb{3.1775f, 0.4537f, 0.0000f},
    Rgb{3.0696f, 0.4857f, 0.0000f}, Rgb{2.9610f, 0.5180f, 0.0000f}, Rgb{2.8520f, 0.5504f, 0.0000f},
    Rgb{2.7426f, 0.5829f, 0.0000f}, Rgb{2.6329f, 0.6155f, 0.0007f}, Rgb{2.5198f, 0.6471f, 0.0202f},
    Rgb{2.4064f, 0.6785f, 0.0433f}, Rgb{2.2932f, 0.7094f, 0.0703f}, Rgb{2.1801f, 0.7399f, 0.1021f},
    Rgb{2.0673f, 0.7696f, 0.1392f}, Rgb{1.9552f, 0.7986f, 0.1827f}, Rgb{1.8440f, 0.8265f, 0.2333f},
    Rgb{1.7338f, 0.8533f, 0.2924f}, Rgb{1.6251f, 0.8787f, 0.3610f}, Rgb{1.5182f, 0.9024f, 0.4406f},
    Rgb{1.4135f, 0.9243f, 0.5328f}, Rgb{1.3116f, 0.9438f, 0.6392f}, Rgb{1.2130f, 0.9607f, 0.7615f},
    Rgb{1.1187f, 0.9747f, 0.9012f}, Rgb{1.0296f, 0.9852f, 1.0594f}, Rgb{0.9468f, 0.9920f, 1.2360f},
    Rgb{0.8715f, 0.9949f, 1.4291f}, Rgb{0.8050f, 0.9940f, 1.6341f}, Rgb{0.7480f, 0.9898f, 1.8429f},
};
// clang-format on

}  // namespace detail

inline float luminance_of(const Rgb& color) { return 0.2126f * color[0] + 0.7152f * color[1] + 0.0722f * color[2]; }

/// Returns the color of a black body of this temperature, with luminance 1. Exact within 0.003.
inline Rgb color_of_kelvin(double kelvin) {
  const auto& table = detail::black_body_colors;
  constexpr auto steps = static_cast<double>(table.size() - 1);
  const double along =
      (1.0 / min_kelvin - 1.0 / std::clamp(kelvin, min_kelvin, max_kelvin)) / (1.0 / min_kelvin - 1.0 / max_kelvin);
  const std::size_t first = std::min(static_cast<std::size_t>(steps * along), table.size() - 2);
  const auto part = static_cast<float>(steps * along - static_cast<double>(first));
  Rgb color{};
  for (std::size_t i = 0; i < color.size(); ++i) color[i] = std::lerp(table[first][i], table[first + 1][i], part);
  return color;
}

/// A color temperature, and how far the color is from that of the black body.
struct Kelvin {
  double kelvin = 0.0;
  float distance = 0.0f;  // largest difference of a component, at luminance 1
};

/// Returns the nearest color temperature of a color. Black has none.
inline std::optional<Kelvin> nearest_kelvin(const Rgb& color) {
  const float luminance = luminance_of(color);
  if (!(luminance > 0.0f)) return std::nullopt;
  const auto distance = [&](double mired) {
    const Rgb body = color_of_kelvin(1e6 / mired);
    float most = 0.0f;
    for (std::size_t i = 0; i < color.size(); ++i) most = std::max(most, std::abs(color[i] / luminance - body[i]));
    return most;
  };
  double best = 1e6 / min_kelvin;
  constexpr double coarse = 10.0;  // mired, below which a change is hardly seen
  for (double mired = 1e6 / max_kelvin; mired < 1e6 / min_kelvin; mired += coarse)
    if (distance(mired) < distance(best)) best = mired;
  for (double step = coarse / 2.0; step > 1e-4; step /= 2.0)
    for (const double mired : {best - step, best + step})
      if (distance(mired) < distance(best)) best = mired;
  best = std::clamp(best, 1e6 / max_kelvin, 1e6 / min_kelvin);
  return Kelvin{1e6 / best, distance(best)};
}

}  // namespace cumulet::demo
