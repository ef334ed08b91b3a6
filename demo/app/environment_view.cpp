#include "environment_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <image.hpp>
#include <luminance.hpp>

#include "sun_dial.hpp"

namespace cumulet::demo {

Thumbnail expose(std::span<const float> radiance) {
  // The exposure is based on the geometric mean, which a small bright sun hardly changes. Black pixels count as dark
  // ones.
  constexpr double dark = 1e-6;
  constexpr double grey = 0.25;
  double sum = 0.0;
  for (std::size_t i = 0; i + 2 < radiance.size(); i += 3)
    sum += std::log(image::luminance(radiance.subspan(i, 3)) + dark);
  const double pixels = std::max(1.0, static_cast<double>(radiance.size()) / 3.0);
  const auto exposure = static_cast<float>(grey / std::exp(sum / pixels));
  Thumbnail made;
  for (std::size_t i = 0; i + 2 < radiance.size(); i += 3) {
    const std::array<float, 3> shown =
        image::tone_map_neutral({exposure * radiance[i], exposure * radiance[i + 1], exposure * radiance[i + 2]});
    for (const float c : shown)
      made.rgba.push_back(static_cast<std::uint8_t>(std::lround(255.0f * image::srgb_encode(std::min(c, 1.0f)))));
    made.rgba.push_back(255);
  }
  return made;
}

ThumbnailPtr make_thumbnail(const cumulet_environment* environment) {
  std::vector<float> radiance(std::size_t{3} * Thumbnail::width * Thumbnail::height);
  if (cumulet_environment_get_pixels(environment, Thumbnail::width, Thumbnail::height, radiance.data(),
                                     radiance.size()) != CUMULET_OK)
    return nullptr;
  return std::make_shared<const Thumbnail>(expose(radiance));
}

double left_edge(double rotation_degrees) { return rotation_degrees / 360.0; }

double dragged(double rotation_degrees, double width) { return wrap_degrees(rotation_degrees - 360.0 * width); }

double position_of(double azimuth_degrees) {
  const double position = 0.5 - wrap_degrees(azimuth_degrees) / 360.0;
  return position >= 1.0 ? 0.0 : position;
}

}  // namespace cumulet::demo
