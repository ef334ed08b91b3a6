#include "option_values.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <image.hpp>
#include <program.hpp>
#include <ramp.hpp>
#include <system_error>

namespace cumulet::demo {
namespace {

void parse_light(std::string_view text, float (&rgb)[3]) {
  const std::array<double, 3> values = parse_three(text, settings::light_range);
  for (std::size_t i = 0; i < 3; ++i) rgb[i] = static_cast<float>(values[i]);
}

}  // namespace

std::string in_quotes(std::string_view text) { return std::string("'").append(text).append("'"); }

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::vector<std::string_view> words(std::string_view text) {
  constexpr std::string_view white = " \t\n\v\f\r";
  std::vector<std::string_view> parts;
  std::size_t at = text.find_first_not_of(white);
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(white, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(white, end);
  }
  return parts;
}

double parse_number(std::string_view text) {
  double value = 0.0;
  const std::string_view digits = text.substr(text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value))
    throw UsageError(in_quotes(text) + " is not a finite number");
  return value;
}

std::vector<double> parse_numbers(std::string_view text, std::size_t count) {
  const std::vector<std::string_view> parts = split(text, ',');
  if (parts.size() != count)
    throw UsageError(in_quotes(text) + " is not " + std::to_string(count) + " numbers separated by commas");
  std::vector<double> values;
  values.reserve(parts.size());
  for (const std::string_view part : parts) values.push_back(parse_number(part));
  return values;
}

std::uint64_t parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end == text.data() + text.size() && !text.empty();
  if (!number || error == std::errc::invalid_argument) throw UsageError(in_quotes(text) + " is not a whole number");
  if (error != std::errc{} || value < least || value > most)
    throw UsageError(in_quotes(text) + " is not from " + std::to_string(least) + " to " + std::to_string(most));
  return value;
}

std::array<double, 3> parse_three(std::string_view text, const settings::Range& range) {
  const std::vector<double> values = parse_numbers(text, 3);
  for (const double value : values) {
    if (range.holds(value)) continue;
    const bool negative = range.least == 0.0 && value < 0.0;
    throw UsageError(in_quotes(text) + (negative ? " has a negative number" : " has a number that is too large"));
  }
  return {values[0], values[1], values[2]};
}

void parse_size(std::string_view text, SceneOptions& scene) {
  const std::vector<std::string_view> sides = split(text, 'x');
  if (sides.size() != 2) throw UsageError(in_quotes(text) + " is not WIDTHxHEIGHT, such as 1280x720");
  scene.width = static_cast<std::uint32_t>(parse_integer(sides[0], 1, 16384));
  scene.height = static_cast<std::uint32_t>(parse_integer(sides[1], 1, 16384));
}

void parse_camera(std::string_view text, cumulet_camera_desc& camera) {
  const std::vector<std::string_view> parts = words(text);
  if (parts.size() != 3) throw UsageError(in_quotes(text) + " is not \"ex,ey,ez tx,ty,tz fovy\"");
  const std::vector<double> eye = parse_numbers(parts[0], 3);
  const std::vector<double> target = parse_numbers(parts[1], 3);
  if (eye == target) throw UsageError("the eye and the target are the same point");
  const double fovy = parse_number(parts[2]);
  if (!(fovy > 0.0 && fovy < 180.0))
    throw UsageError(in_quotes(parts[2]) + " is not an angle between 0 and 180 degrees");
  const cumulet_camera_desc before = camera;
  camera = {};
  camera.struct_size = sizeof camera;
  camera.lens_radius = before.lens_radius;
  camera.focus_distance = before.focus_distance;
  std::copy(eye.begin(), eye.end(), camera.eye);
  std::copy(target.begin(), target.end(), camera.target);
  camera.fovy_degrees = fovy;
}

void parse_sun(std::string_view text, cumulet_sun_sky_desc& light) {
  const std::vector<std::string_view> parts = words(text);
  if (parts.empty() || parts.size() > 2) throw UsageError(in_quotes(text) + " is not \"azimuth,elevation r,g,b\"");
  const std::vector<double> angles = parse_numbers(parts[0], 2);
  if (std::abs(angles[0]) > 360.0) throw UsageError("the azimuth is not from -360 to 360 degrees");
  if (std::abs(angles[1]) > 90.0) throw UsageError("the elevation is not from -90 to 90 degrees");
  if (parts.size() == 2) parse_light(parts[1], light.sun_irradiance);
  light.sun_azimuth_degrees = static_cast<float>(angles[0]);
  light.sun_elevation_degrees = static_cast<float>(angles[1]);
}

void parse_sky_model(std::string_view text, cumulet_sun_sky_desc& light) {
  const std::vector<double> numbers = parse_numbers(text, 2);
  const auto take = [&](float cumulet_sun_sky_desc::*field, double number) {
    settings::with(field, [&](const auto& setting) {
      if (!setting.given_range().holds(number))
        throw UsageError(std::string(setting.name) + " " + setting.given_range().refusal());
    });
    light.*field = static_cast<float>(number);
  };
  take(&cumulet_sun_sky_desc::turbidity, numbers[0]);
  take(&cumulet_sun_sky_desc::ground_albedo, numbers[1]);
  light.sky = CUMULET_SKY_PHYSICAL;
}

settings::RampPoints parse_ramp(std::string_view text) {
  settings::RampPoints points;
  if (text == "none") return points;
  for (const std::string_view point : split(text, ',')) {
    const std::vector<std::string_view> pair = split(point, ':');
    if (pair.size() != 2) throw UsageError(in_quotes(point) + " is not a pair INPUT:OUTPUT, such as 0.5:1");
    points.push_back({static_cast<float>(parse_number(pair[0])), static_cast<float>(parse_number(pair[1]))});
  }
  const std::string why = settings::ramp_refusal(points);
  if (!why.empty()) throw UsageError(in_quotes(text) + " " + why);
  return points;
}

namespace {

// Parses "#rrggbb" (sRGB) or "R/G/B" (linear).
std::array<float, 3> parse_color(std::string_view text) {
  std::array<float, 3> rgb{};
  if (text.starts_with('#')) {
    std::uint32_t hex = 0;
    const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), hex, 16);
    if (text.size() != 7 || error != std::errc{} || end != text.data() + text.size())
      throw UsageError(in_quotes(text) + " is not a color such as #ff8000");
    for (std::size_t i = 0; i < 3; ++i)
      rgb[i] = image::srgb_decode(static_cast<float>(hex >> (16 - 8 * i) & 0xFFU) / 255.0F);
    return rgb;
  }
  const std::vector<std::string_view> parts = split(text, '/');
  if (parts.size() != 3) throw UsageError(in_quotes(text) + " is not a color such as #ff8000 or 1/0.5/0");
  for (std::size_t i = 0; i < 3; ++i) rgb[i] = static_cast<float>(parse_number(parts[i]));
  return rgb;
}

}  // namespace

settings::ColorStops parse_color_ramp(const settings::ColorRampInfo& info, std::string_view text) {
  settings::ColorStops stops;
  if (text == "none") return stops;
  for (const std::string_view stop : split(text, ',')) {
    const std::vector<std::string_view> pair = split(stop, ':');
    if (pair.size() != 2) throw UsageError(in_quotes(stop) + " is not a pair INPUT:COLOR, such as 0.5:#ff8000");
    const std::array<float, 3> rgb = parse_color(pair[1]);
    stops.push_back({static_cast<float>(parse_number(pair[0])), rgb[0], rgb[1], rgb[2]});
  }
  const std::string why = settings::color_ramp_refusal(info, stops);
  if (!why.empty()) throw UsageError(in_quotes(text) + " " + why);
  return stops;
}

std::optional<settings::ClipBox> parse_clip_box(std::string_view text) {
  if (text == "none") return std::nullopt;
  settings::ClipBox box{};
  std::ranges::copy(parse_numbers(text, box.size()), box.begin());
  if (const std::string why = settings::clip_box_refusal(box); !why.empty()) throw UsageError("the box " + why);
  return box;
}

std::vector<settings::ClipPlane> parse_clip_planes(std::string_view text) {
  std::vector<settings::ClipPlane> planes;
  if (text == "none") return planes;
  for (const std::string_view word : words(text)) {
    settings::ClipPlane& plane = planes.emplace_back();
    std::ranges::copy(parse_numbers(word, plane.size()), plane.begin());
    if (const std::string why = settings::clip_plane_refusal(plane); !why.empty())
      throw UsageError("plane " + in_quotes(word) + " " + why);
  }
  if (planes.empty()) throw UsageError(in_quotes(text) + " has no plane");
  if (const std::string why = settings::clip_count_refusal(planes.size()); !why.empty())
    throw UsageError(in_quotes(text) + " " + why);
  return planes;
}

std::vector<std::string> parse_light_groups(std::string_view text) {
  std::vector<std::string> names;
  if (text == "none") return names;
  for (const std::string_view name : split(text, ',')) names.emplace_back(name);
  if (const std::string why = light_groups_refusal(names); !why.empty()) throw UsageError(in_quotes(text) + " " + why);
  return names;
}

}  // namespace cumulet::demo
